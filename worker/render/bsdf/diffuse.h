/* SPDX-License-Identifier: Apache-2.0 */
/* Lambertian reflection, and the BSDF that Mitsuba gives to a shape without one. */
#ifndef WORKER_RENDER_BSDF_DIFFUSE_H
#define WORKER_RENDER_BSDF_DIFFUSE_H

#include "worker/render/bsdf/bsdf.h"

void bsdf_make_default(struct bsdf *b); /* diffuse with a reflectance of 0.5 */

/* Cosine-weighted density (per solid angle) and sampling, for other BSDFs that are nearly diffuse; f comes from
 * b->ops->eval. */
double diffuse_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
bool diffuse_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		    struct bsdf_sample *out);

#endif
