/* SPDX-License-Identifier: Apache-2.0 */
/*
 * With `lenient`, reflectances and other fractions of a material that are above 1, which is impossible, count as 1,
 * with a note each. In files of 0.6, reflectances have already been scaled (old_values.h). One thread; allocates in the
 * arena.
 */
#ifndef WORKER_RENDER_SCENE_LIMIT_TO_ONE_H
#define WORKER_RENDER_SCENE_LIMIT_TO_ONE_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/notes.h"

#define OVER_ONE_HINT "; --lenient counts it as 1"

/* Returns whether the value of p, a parameter of a plug-in of class cls, is wrong only in being above 1. */
bool limit_to_one_applies(enum plugin_class cls, const struct param *p, const struct value *v);

/* Limits such a value, or each component of a colour or spectrum, to 1; other values stay. Returns 0 or -ENOMEM. */
int limit_value_to_one(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		       enum plugin_class cls, const struct param *p, struct arena *arena, struct value *v);

/* Like limit_value_to_one(), for the colours of a texture, made from `el`, that is the value of p. *texture becomes a
 * copy, which all such parameters share: another plug-in may use the original's numbers as heights. Images never have
 * values above 1. Without `lenient` such a colour is refused. Returns 0, -ENOMEM, -ERANGE or REPORT_ALREADY_REPORTED.
 */
int limit_texture_to_one(const struct notes *t, enum plugin_class cls, const struct param *p, bool lenient,
			 struct arena *arena, struct xml_element *el, const struct scene_node **texture);

#endif
