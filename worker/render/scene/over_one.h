/* SPDX-License-Identifier: Apache-2.0 */
/*
 * With `lenient`: reflectances and other shares of a material that are above 1, which no surface has, count as 1, with
 * a note each. In files of 0.6 values of reflectances have been scaled before (old_values.h). One thread; allocates in
 * the arena.
 */
#ifndef WORKER_RENDER_SCENE_OVER_ONE_H
#define WORKER_RENDER_SCENE_OVER_ONE_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/notes.h"

#define OVER_ONE_HINT "; --lenient counts it as 1"

/* Whether the value of p, a parameter of such a plug-in, is only wrong in being above 1. */
bool over_one(enum plugin_class cls, const struct param *p, const struct value *v);

/* Makes such a value 1, or such a component of a colour or spectrum; others stay. 0 or -ENOMEM. */
int over_one_value(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		   enum plugin_class cls, const struct param *p, struct arena *arena, struct value *v);

/* The same for the colours of a texture that p has, made from `el`: *texture becomes a copy, since another plug-in may
 * take its numbers for heights; there is one for all that refer to it. Images have values up to 1 anyway. Without
 * `lenient` such a colour is refused. 0, -ENOMEM, -ERANGE or REPORT_TOLD. */
int over_one_texture(const struct notes *t, enum plugin_class cls, const struct param *p, bool lenient,
		     struct arena *arena, struct xml_element *el, const struct scene_node **texture);

#endif
