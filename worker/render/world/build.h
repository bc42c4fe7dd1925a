/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes a world from a description: the scene that all threads share, immutable after it is built (world.h has its
 * contents). One thread builds; any thread reads.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_H
#define WORKER_RENDER_WORLD_BUILD_H

#include "worker/render/scene/report.h"
#include "worker/render/world/summary.h"

struct world;

/* Reads every mesh, texture and material and determines the effects: everything but Embree's own building. A scene
 * that passes can be rendered by workers. */
int render_check(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		 struct render_summary *out, struct error *e);

/* The same, going on after an error in a shape, a material or an emitter. *found (report_init) has all of these, each
 * once; *out is filled in if there is none. Any other error ends it, as above. */
int render_check_all(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		     struct report *found, struct render_summary *out, struct error *e);

/* Builds Embree's scene, and ticks meanwhile (common/base/liveness.h). The scene description may be freed
 * afterwards. */
int world_new(struct world **w, const struct scene *s, const struct asset_source *assets,
	      const struct render_options *o, struct error *e);
void world_free(struct world *w);
/* Sets other settings (render_options.settings) for an existing world, while no lease runs in it, if the changed
 * ones do not require building again. *fits false: a new world is needed, and this one is unchanged. */
int world_set_accuracy(struct world *w, const char *accuracy, bool *fits, struct error *e);
void world_summary(const struct world *w, struct render_summary *out);
/* X+Y+Z of the brightest emitter, for canvas_grid_exponent if the bootstrap is black. */
double world_brightest(const struct world *w);
/* Whether some light is that of a beam, which `path` does not find. */
bool world_has_beam(const struct world *w);
size_t world_embree_bytes(const struct world *w);

#endif
