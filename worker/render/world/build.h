/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Builds a world, the scene that all threads share, from a description (world.h shows its contents). It is immutable
 * after it is built. One thread builds; any thread reads.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_H
#define WORKER_RENDER_WORLD_BUILD_H

#include "worker/render/scene/report.h"
#include "worker/render/world/summary.h"

struct world;

/* Checks a scene: reads every mesh, texture and material and determines the effects, but does not build Embree's tree
 * (except to report black backs in small scenes). Workers can render a scene that passes. */
int world_check(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		struct render_summary *out, struct error *e);

/* Like world_check(), but continues after an error in a shape, a material or an emitter. *report (report_init)
 * collects these errors, each once; *out is only filled in if there are none. Any other error is returned, as by
 * world_check(). */
int world_check_all(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		    struct report *report, struct render_summary *out, struct error *e);

/* Builds a world with Embree's tree; ticks meanwhile (common/base/liveness.h). The scene description
 * may be freed afterwards. */
int world_new(struct world **out, const struct scene *s, const struct asset_source *assets,
	      const struct render_options *o, struct error *e);
void world_free(struct world *w);
/* Changes the settings (render_options.accuracy) of an existing world while no lease runs in it. *can_apply is false if
 * one of the changed settings requires building again: then a new world is needed, and this one is unchanged. */
int world_set_accuracy(struct world *w, const char *text, bool *can_apply, struct error *e);
void world_summary(const struct world *w, struct render_summary *out);
/* Returns X+Y+Z of the brightest emitter; used by canvas_grid_exponent if the bootstrap is black. */
double world_brightness_bound(const struct world *w);
/* Whether some emitter is a beam, whose light `path` does not find. */
bool world_has_beam(const struct world *w);
size_t world_embree_bytes(const struct world *w);

#endif
