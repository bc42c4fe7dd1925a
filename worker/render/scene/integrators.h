/* SPDX-License-Identifier: Apache-2.0 */
/* What Mitsuba's integrators, possibly nested, would show of a scene. Pure; any thread. */
#ifndef WORKER_RENDER_SCENE_INTEGRATORS_H
#define WORKER_RENDER_SCENE_INTEGRATORS_H

#include "common/base/spelling.h"
#include "worker/render/scene/node.h"

#include <stdbool.h>
#include <stddef.h>

/* How the image of a scene with an integrator of this type differs from the full light transport. */
struct integrator_image {
	bool shows_other; /* Mitsuba's image shows something else: here it shows all light, or what a nested integrator
		       asks for */
	bool is_direct;	  /* shows light that is scattered at most once */
	bool is_prb;	  /* has short paths, unless the scene says otherwise */
	bool lacks_media; /* shows no media */
};
/* Returns the i-th known type; NULL after the last. */
const char *integrator_type_at(size_t i, struct integrator_image *out);

/* Returns the integrator inside n; of several (`multichannel`, `aov`), the first that shows light, or else the first
 * of all. NULL if there is none. */
const struct scene_node *integrator_inner(const struct scene_node *n);

/* Returns whether its image shows something other than all light: a part of it, or normals, depths and the like. */
bool integrator_shows_other(const struct scene_node *n);

/* Returns whether its type is one of Mitsuba's or of this program's own. */
bool integrator_is_known(const struct scene_node *n);

/* Returns the number of edges of the longest path, as stated by the innermost integrator that states it; -1: no
 * limit. */
int64_t integrator_depth(const struct scene_node *n);

/* Returns the first integrator, n or one inside it, whose image has no media in Mitsuba; NULL if there is none. n
 * may be NULL. */
const struct scene_node *integrator_find_without_media(const struct scene_node *n);

/* Offers the types of known integrators. */
void integrator_offer_types(struct spelling *s);

#endif
