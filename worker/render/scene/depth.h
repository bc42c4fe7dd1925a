/* SPDX-License-Identifier: Apache-2.0 */
/* Lengths of paths, in edges: the limit for all scenes, the depth of `direct`, and the default depth of `prb`. */
#ifndef WORKER_RENDER_SCENE_DEPTH_H
#define WORKER_RENDER_SCENE_DEPTH_H

#include "common/base/text.h"

#include <string.h>

enum { SCENE_DEPTH_MAX = 128, SCENE_DIRECT_DEPTH = 2, SCENE_PRB_DEPTH = 6 };

/* Returns whether an integrator of this type shows only light that is scattered at most once, as Mitsuba's `direct`
 * and its variants do. */
static inline bool depth_is_direct(const char *type)
{
	return strncmp(type, "direct", strlen("direct")) == 0;
}

/* Returns whether the type is one of Mitsuba 3's differentiable surface integrators, whose paths end after six edges
 * unless the scene says otherwise. */
static inline bool depth_is_prb(const char *type)
{
	static const char *const names[] = {"prb", "prb_basic", "prb_projective", "prb_reparam"};
	return text_is_among(type, names, sizeof names / sizeof *names);
}

#endif
