/* SPDX-License-Identifier: Apache-2.0 */
/* Changes a world according to its effects. One thread; allocates in the world's arena. */
#ifndef WORKER_RENDER_WORLD_EFFECTS_APPLY_H
#define WORKER_RENDER_WORLD_EFFECTS_APPLY_H

#include "worker/render/world/effects.h"

struct world;

/* Removes what no path can meet and what was switched off. -EINVAL if the choice cannot be
 * applied to this scene; -ENOMEM. */
int effects_apply(struct world *w, const struct effects_override *forced, const enum visibility *shape,
		  struct error *e);

#endif
