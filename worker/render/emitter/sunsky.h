/* SPDX-License-Identifier: Apache-2.0 */
/* Functions shared by emitters of daylight. Private to worker/render/emitter. */
#ifndef WORKER_RENDER_EMITTER_SUNSKY_H
#define WORKER_RENDER_EMITTER_SUNSKY_H

#include "worker/render/emitter/daylight.h"
#include "worker/render/emitter/envmap.h"

/* Reads to_world into the axes of the map, the second of which is up. -EINVAL or -ENOTSUP if it does more than
 * rotate. */
int sunsky_read_axes(const struct scene_node *n, const struct emitter_build *build, struct envmap_axes *axes,
		     struct error *e);
/* Converts a direction of daylight_sun_direction to the axes of the map. Mitsuba 3 mirrors the compass. */
vec3 sunsky_map_direction(vec3 d, bool dialect_3);
/* Reads the albedo of the ground for X, Y and Z. -ENOTSUP if it is textured. */
int sunsky_read_albedo(const struct scene_node *n, const struct emitter_build *build, double albedo[3],
		       struct error *e);
/* Returns -ERANGE if the month has no such day, otherwise 0. */
int sunsky_check_day(const struct scene_node *n, int year, int month, int day, struct error *e);

#endif
