/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Values that Mitsuba 0.5 and 0.6 accept and that have no exact counterpart here. Each replacement is noted. One
 * thread; allocates in the arena.
 */
#ifndef WORKER_RENDER_SCENE_OLD_VALUES_H
#define WORKER_RENDER_SCENE_OLD_VALUES_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/notes.h"

/*
 * v: the value of parameter p, of the element el inside `owner`, which is an object of class cls; of a file of version
 * < 2. Its range and choices have not been checked yet. 0, whether or not it was replaced, or -ENOMEM.
 *
 * - Words of which there is a list lose their capitals.
 * - Reflectances, transmittances and opacities above 1 are scaled to at most 0.99, as Mitsuba does, unless the material
 *   says that it need not conserve energy.
 * - The components of the complex index of a metal lose their signs, on which nothing depends.
 * - The microfacet distributions `phong` and `as` become `beckmann` of the same roughness.
 */
int old_value(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
	      const struct param *p, enum plugin_class cls, struct arena *arena, struct value *v);

#endif
