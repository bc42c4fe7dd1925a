/* SPDX-License-Identifier: Apache-2.0 */
/* An opaque BSDF on both sides. */
#ifndef WORKER_RENDER_BSDF_TWOSIDED_H
#define WORKER_RENDER_BSDF_TWOSIDED_H

#include "worker/render/bsdf/bsdf.h"

/* Makes an opaque BSDF scatter on its back as on its front, unless backs are to be black. Mitsuba leaves them black;
 * some public scenes in its language are written for renderers that do not (the walls of `cornell-box` face outwards).
 */
int bsdf_mirror_back(struct bsdf *b, const struct bsdf_build *build, struct error *e);

#endif
