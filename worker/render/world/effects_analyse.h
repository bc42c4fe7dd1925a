/* SPDX-License-Identifier: Apache-2.0 */
/* Which effects a scene calls for. One thread; allocates nothing. */
#ifndef WORKER_RENDER_WORLD_EFFECTS_ANALYSE_H
#define WORKER_RENDER_WORLD_EFFECTS_ANALYSE_H

#include "worker/render/world/effects.h"

struct effects_source;
struct world;

/* Fills w->effects from shapes, BSDFs and emitters, and shape[] (one a shape, see reach.h). */
void effects_analyse(struct world *w, const struct effects_source *src, const struct effects_choice *forced,
		     enum visibility_bounds *shape);

#endif
