/* SPDX-License-Identifier: Apache-2.0 */
/* Opaque BSDFs that scatter on both sides. */
#ifndef WORKER_RENDER_BSDF_TWOSIDED_H
#define WORKER_RENDER_BSDF_TWOSIDED_H

#include "worker/render/bsdf/bsdf.h"

/* Makes an opaque BSDF scatter on its back as on its front, unless build->has_black_backs is set. Backs are black in
 * Mitsuba, but some public scenes in its format are written for renderers in which they are not (the walls of
 * `cornell-box` face outwards). -ENOMEM. */
int bsdf_mirror_back(struct bsdf *b, const struct bsdf_build *build, struct error *e);

#endif
