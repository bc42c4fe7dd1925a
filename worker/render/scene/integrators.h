/* SPDX-License-Identifier: Apache-2.0 */
/* What Mitsuba's integrators, one in another, would show of a scene. Pure; any thread. */
#ifndef WORKER_RENDER_SCENE_INTEGRATORS_H
#define WORKER_RENDER_SCENE_INTEGRATORS_H

#include "worker/render/scene/node.h"

#include <stdbool.h>
#include <stddef.h>

/* What becomes of the image of an integrator of this type. */
struct integrator_image {
	bool other;    /* Mitsuba's is not of all light: ours is of that, or of what the integrator inside asks for */
	bool direct;   /* of light that is scattered once */
	bool prb;      /* of short paths, unless the scene says otherwise */
	bool no_media; /* without media */
};
/* The i-th known type; NULL after the last. */
const char *integrators_at(size_t i, struct integrator_image *out);

/* The one inside n; of several (`multichannel`, `aov`) the first that shows light, if any does. NULL: none. */
const struct scene_node *integrators_inner(const struct scene_node *n);

/* Whether its image is of something other than all light: a part of it, or normals, depths and the like. */
bool integrators_show_other(const struct scene_node *n);

/* Whether its type is one of Mitsuba's, or of one of the integrators here. */
bool integrators_are_known(const struct scene_node *n);

/* Edges of the longest path, by the innermost that states them; -1: no limit. */
int64_t integrators_depth(const struct scene_node *n);

/* The first in n, or inside it, whose image has no media in Mitsuba; NULL: none. n may be NULL. */
const struct scene_node *integrators_without_media(const struct scene_node *n);

#endif
