/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/xml/element_make.h"

#include <assert.h>

void element_append(struct xml_element *parent, struct xml_element *el)
{
	el->parent = parent;
	if (parent->last_child)
		parent->last_child->next_sibling = el;
	else
		parent->first_child = el;
	parent->last_child = el;
}

struct xml_element *element_make(struct xml_element *parent, const char *name, const char *file, int line,
				 struct arena *arena)
{
	struct xml_element *el = arena_alloc(arena, 1, sizeof *el);
	struct xml_attribute *attributes = arena_alloc(arena, ELEMENT_MAKE_ATTRIBUTES_MAX, sizeof *attributes);
	if (!el || !attributes)
		return NULL;
	*el = (struct xml_element){.name = name, .file = file, .line = line, .attributes = attributes};
	if (parent)
		element_append(parent, el);
	return el;
}

void element_add_attribute(struct xml_element *el, const char *name, const char *value)
{
	assert(el->attribute_count < ELEMENT_MAKE_ATTRIBUTES_MAX);
	el->attributes[el->attribute_count++] = (struct xml_attribute){name, value};
}

bool element_add_parameter(struct xml_element *parent, const char *kind, const char *name, const char *value,
			   struct arena *arena)
{
	struct xml_element *el = element_make(parent, kind, parent->file, parent->line, arena);
	if (!el)
		return false;
	el->is_camel_case = parent->is_camel_case;
	element_add_attribute(el, "name", name);
	element_add_attribute(el, "value", value);
	return true;
}
