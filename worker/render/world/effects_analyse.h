/* SPDX-License-Identifier: Apache-2.0 */
/* Determines which effects a scene needs. One thread; allocates nothing. */
#ifndef WORKER_RENDER_WORLD_EFFECTS_ANALYSE_H
#define WORKER_RENDER_WORLD_EFFECTS_ANALYSE_H

#include "worker/render/world/effects.h"

struct effects_source;
struct world;

/* Sets w->effects from shapes, BSDFs and emitters, and shape[] (one per shape, see visibility_bounds.h). */
void effects_analyse(struct world *w, const struct effects_source *src, const struct effects_override *forced,
		     enum visibility *shape);

#endif
