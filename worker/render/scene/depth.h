/* SPDX-License-Identifier: Apache-2.0 */
/* How long paths are, in edges: the longest that are simulated, whatever a scene asks for, and those of `direct`. */
#ifndef WORKER_RENDER_SCENE_DEPTH_H
#define WORKER_RENDER_SCENE_DEPTH_H

#include <stdbool.h>
#include <string.h>

enum { SCENE_MAX_DEPTH = 128, SCENE_DIRECT_DEPTH = 2 };

/* Whether an integrator of this type shows, as Mitsuba's `direct` and its variants, light that is scattered once. */
static inline bool depth_is_direct(const char *type)
{
	return strncmp(type, "direct", strlen("direct")) == 0;
}

#endif
