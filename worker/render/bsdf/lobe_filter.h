/* SPDX-License-Identifier: Apache-2.0 */
/* Removes some lobes from a BSDF; the light that they would scatter is absorbed. */
#ifndef WORKER_RENDER_BSDF_LOBE_FILTER_H
#define WORKER_RENDER_BSDF_LOBE_FILTER_H

#include "worker/render/bsdf/bsdf.h"

enum { BSDF_WITHOUT_TRANSMISSION = 1, BSDF_WITHOUT_DELTA = 2, BSDF_WITHOUT_SMOOTH = 4 };

/* Removes the lobes given by the bits above from b; allocates in the arena. -ENOMEM. */
int bsdf_filter_lobes(struct bsdf *b, unsigned lobes, struct arena *arena, struct error *e);

#endif
