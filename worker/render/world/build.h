/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Making a world of a description: the scene that all threads share, built once and immutable then (world.h has its
 * inside). One thread builds; any thread reads.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_H
#define WORKER_RENDER_WORLD_BUILD_H

#include "worker/render/world/summary.h"

struct world;

/* Reads every mesh, texture and material and says what the scene calls for; all but Embree's own building. What passes
 * here is a scene that workers can render. */
int render_check(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		 struct render_summary *out, struct error *e);

/* Builds Embree's scene, and ticks meanwhile (common/base/liveness.h). The scene description may be freed afterwards.
 */
int world_new(struct world **w, const struct scene *s, const struct asset_source *assets,
	      const struct render_options *o, struct error *e);
void world_free(struct world *w);
/* Other settings (render_options.settings) for a world that is there, while no lease runs in it: whether those that
 * differ can do without building again, and then they are set. *fits false: a new world is needed, this one is as it
 * was. */
int world_set_accuracy(struct world *w, const char *accuracy, bool *fits, struct error *e);
void world_summary(const struct world *w, struct render_summary *out);
/* X+Y+Z of the brightest emitter, for canvas_grid_exponent when the bootstrap is black. */
double world_brightest(const struct world *w);
size_t world_embree_bytes(const struct world *w);

#endif
