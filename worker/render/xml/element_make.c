/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/xml/element_make.h"

#include <assert.h>

void element_link(struct xml_element *parent, struct xml_element *el)
{
	el->parent = parent;
	if (parent->last)
		parent->last->next = el;
	else
		parent->first = el;
	parent->last = el;
}

struct xml_element *element_make(struct xml_element *parent, const char *name, const char *file, int line,
				 struct arena *arena)
{
	struct xml_element *el = arena_alloc(arena, 1, sizeof *el);
	struct xml_attribute *attributes = arena_alloc(arena, ELEMENT_MAKE_ATTRIBUTES, sizeof *attributes);
	if (!el || !attributes)
		return NULL;
	*el = (struct xml_element){.name = name, .file = file, .line = line, .attributes = attributes};
	if (parent)
		element_link(parent, el);
	return el;
}

void element_put(struct xml_element *el, const char *name, const char *value)
{
	assert(el->attribute_count < ELEMENT_MAKE_ATTRIBUTES);
	el->attributes[el->attribute_count++] = (struct xml_attribute){name, value};
}

bool element_value(struct xml_element *in, const char *kind, const char *name, const char *value, struct arena *arena)
{
	struct xml_element *el = element_make(in, kind, in->file, in->line, arena);
	if (!el)
		return false;
	el->snake = in->snake;
	element_put(el, "name", name);
	element_put(el, "value", value);
	return true;
}
