/* SPDX-License-Identifier: Apache-2.0 */
/* Lambert's reflectance, and the BSDF that Mitsuba gives a shape without one. */
#ifndef WORKER_RENDER_BSDF_DIFFUSE_H
#define WORKER_RENDER_BSDF_DIFFUSE_H

#include "worker/render/bsdf/bsdf.h"

void bsdf_default(struct bsdf *b); /* diffuse 0.5 */

/* Its density, that of the cosine, and its sampling by eval, for others like it. */
double diffuse_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi);
bool diffuse_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
		    struct bsdf_sample *out);

#endif
