/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/default_light.h"

#include "worker/render/scene/element_make.h"
#include "worker/render/scene/plugin.h"

#include <string.h>

static bool has_child(const struct xml_element *around, const char *name)
{
	for (const struct xml_element *el = around->first; el; el = el->next)
		if (!el->ignored && (strcmp(el->name, name) == 0 || has_child(el, name)))
			return true;
	return false;
}

/* Neither realistic nor meant to be: the sun is large and the sky goes on below the horizon, so that any model can be
 * seen. */
static bool make_daylight(struct xml_element *scene, struct arena *arena)
{
	struct xml_element *light = element_make(scene, "emitter", scene->file, scene->line, arena), *place, *turn;
	if (!light)
		return false;
	element_put(light, "type", "sunsky");
	if (!element_value(light, "float", "scale", "2", arena) ||
	    !element_value(light, "boolean", "extend", "true", arena) ||
	    !element_value(light, "float", "sun_radius_scale", "15", arena) ||
	    !(place = element_make(light, "transform", scene->file, scene->line, arena)) ||
	    !(turn = element_make(place, "rotate", scene->file, scene->line, arena)))
		return false;
	element_put(place, "name", "to_world");
	element_put(turn, "y", "1");
	element_put(turn, "angle", "-120");
	return true;
}

bool default_light_add(struct xml_tree *t, const struct plugin_decl *decls, struct arena *arena)
{
	if (t->dialect_3 || t->holes || has_child(t->root, "emitter") || !has_child(t->root, "shape") ||
	    t->note_count >= XML_NOTES_MAX || !plugin_find(decls, PLUGIN_EMITTER, "sunsky"))
		return true;
	t->notes[t->note_count++] = "has no emitter: sun and sky are added, as by Mitsuba 0.6";
	t->element_count++;
	return make_daylight(t->root, arena);
}
