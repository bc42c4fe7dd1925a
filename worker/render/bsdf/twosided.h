/* SPDX-License-Identifier: Apache-2.0 */
/* An opaque BSDF on both sides. */
#ifndef WORKER_RENDER_BSDF_TWOSIDED_H
#define WORKER_RENDER_BSDF_TWOSIDED_H

#include "worker/render/bsdf/bsdf.h"

/* Makes an opaque BSDF scatter on its back as on its front. Mitsuba leaves backs black; public scenes in this
 * language are written for renderers that do not (the walls of `cornell-box` face outwards), and no scene benefits
 * from black backs. */
int bsdf_mirror_back(struct bsdf *b, struct arena *arena, struct error *e);

#endif
