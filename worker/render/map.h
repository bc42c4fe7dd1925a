/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What all leases of a plan share besides the world: the map of brightness if the integrator redistributes. It follows
 * from the plan's seed, film and depths, so every machine makes the same. One thread makes it, all read it.
 */
#ifndef WORKER_RENDER_MAP_H
#define WORKER_RENDER_MAP_H

#include "common/base/error.h"
#include "common/plan/plan.h"

struct brightness;
struct world;

/* *out: NULL if the integrator does not redistribute. Ticks. -ENOMEM, -EINVAL, -EDOM */
int render_map_new(const struct world *w, const struct plan *p, struct brightness **out, struct error *e);
void render_map_free(struct brightness *map); /* takes NULL */

#endif
