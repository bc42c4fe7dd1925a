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
 * Replaces *v, the value of parameter p, if need be. It is given by the element el inside `owner`, an object of class
 * cls, in a file of version < 2; its range and choices have not been checked yet. Returns 0, whether or not the value
 * was replaced, or -ENOMEM.
 *
 * - Words that must be one of a list are converted to lower case.
 * - Reflectances, transmittances and opacities above 1 are scaled to at most 0.99, as Mitsuba does, unless the material
 *   states that it need not conserve energy.
 * - The components of a metal's complex index of refraction lose their signs, on which nothing depends.
 * - The microfacet distributions `phong` and `as` become `beckmann` of the same roughness.
 */
int old_values_adapt(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		     const struct param *p, enum plugin_class cls, struct arena *arena, struct value *v);

#endif
