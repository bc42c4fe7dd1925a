/* SPDX-License-Identifier: Apache-2.0 */
/* How long paths are, in edges: the longest that are simulated, whatever a scene asks for, and those of `direct`
 * and of `prb`. */
#ifndef WORKER_RENDER_SCENE_DEPTH_H
#define WORKER_RENDER_SCENE_DEPTH_H

#include "common/base/text.h"

#include <string.h>

enum { SCENE_MAX_DEPTH = 128, SCENE_DIRECT_DEPTH = 2, SCENE_PRB_DEPTH = 6 };

/* Whether an integrator of this type shows, as Mitsuba's `direct` and its variants, light that is scattered once. */
static inline bool depth_is_direct(const char *type)
{
	return strncmp(type, "direct", strlen("direct")) == 0;
}

/* Whether it is one of Mitsuba 3's for derivatives on surfaces, which end after six edges unless they say otherwise. */
static inline bool depth_is_prb(const char *type)
{
	static const char *const names[] = {"prb", "prb_basic", "prb_projective", "prb_reparam"};
	return text_is_among(type, names, sizeof names / sizeof *names);
}

#endif
