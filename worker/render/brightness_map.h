/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What all leases of a plan share besides the world: the map of brightness, if the integrator redistributes energy. It
 * follows from the plan's seed, film and depths, so every machine makes the same map. One thread makes it, all read it.
 */
#ifndef WORKER_RENDER_BRIGHTNESS_MAP_H
#define WORKER_RENDER_BRIGHTNESS_MAP_H

#include "common/base/error.h"
#include "common/plan/plan.h"

struct brightness;
struct world;

/* Makes the map; *out is NULL if the integrator does not redistribute. Ticks. Returns -ENOMEM, -EINVAL or -EDOM. */
int render_brightness_map_new(const struct world *w, const struct plan *p, struct brightness **out, struct error *e);
void render_brightness_map_free(struct brightness *map); /* accepts NULL */

#endif
