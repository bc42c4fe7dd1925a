/* SPDX-License-Identifier: Apache-2.0 */
/* What emitters of daylight have in common. Private to worker/render/emitter. */
#ifndef WORKER_RENDER_EMITTER_SUNSKY_H
#define WORKER_RENDER_EMITTER_SUNSKY_H

#include "worker/render/emitter/daylight.h"
#include "worker/render/emitter/envmap.h"

/* The axes of the map, of which the second is up. -EINVAL, -ENOTSUP: to_world does more than rotate. */
int sunsky_axes_read(const struct scene_node *n, const struct emitter_build *build, struct envmap_axes *axes,
		     struct error *e);
/* A direction of daylight_position in these axes. Mitsuba 3 mirrors the compass. */
vec3 sunsky_compass(vec3 d, bool dialect_3);
/* The albedo of the ground for X, Y and Z. */
int sunsky_albedo(const struct scene_node *n, const struct emitter_build *build, double albedo[3], struct error *e);
/* -ERANGE: the month has no such day. */
int sunsky_check_day(const struct scene_node *n, int year, int month, int day, struct error *e);

#endif
