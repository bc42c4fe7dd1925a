/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/asset_list.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int asset_list_add(struct asset_list *l, const char *name, const struct xml_element *element, struct arena *arena)
{
	if (l->count == l->capacity) {
		size_t capacity = l->capacity ? 2 * l->capacity : 64;
		struct asset_use *grown = arena_alloc(arena, capacity, sizeof *grown);
		if (!grown)
			return -ENOMEM;
		if (l->count)
			memcpy(grown, l->uses, l->count * sizeof *grown);
		l->uses = grown;
		l->capacity = capacity;
	}
	l->uses[l->count] = (struct asset_use){name, element, l->count};
	l->count++;
	return 0;
}

static int compare_uses(const void *a, const void *b)
{
	const struct asset_use *x = a, *y = b;
	int order = strcmp(x->name, y->name);
	return order ? order : x->index < y->index ? -1 : x->index > y->index;
}

static const char *format_place(const struct xml_element *element, struct arena *arena)
{
	char text[512] = "";
	const char *type = element ? xml_attribute_value(element, "type") : NULL;
	if (type)
		snprintf(text, sizeof text, "%.300s:%d: <%.64s type=\"%.64s\">", element->file, element->line,
			 element->name, type);
	else if (element)
		snprintf(text, sizeof text, "%.300s:%d: <%.64s>", element->file, element->line, element->name);
	return arena_strdup(arena, text);
}

int asset_list_finish(struct asset_list *l, const char *excluded, struct arena *arena)
{
	size_t n = 0;
	l->names = arena_alloc(arena, l->count, sizeof *l->names);
	l->places = arena_alloc(arena, l->count, sizeof *l->places);
	if (!l->names || !l->places)
		return -ENOMEM;
	if (l->count)
		qsort(l->uses, l->count, sizeof *l->uses, compare_uses);
	for (size_t i = 0; i < l->count; i++) {
		const struct asset_use *use = &l->uses[i];
		if ((n > 0 && strcmp(l->names[n - 1], use->name) == 0) || strcmp(use->name, excluded) == 0)
			continue;
		l->names[n] = use->name;
		if (!(l->places[n++] = format_place(use->element, arena)))
			return -ENOMEM;
	}
	l->count = n;
	return 0;
}
