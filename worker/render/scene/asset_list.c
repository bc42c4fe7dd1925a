/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/asset_list.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int asset_list_add(struct asset_list *l, const char *name, const struct xml_element *by, struct arena *arena)
{
	if (l->count == l->room) {
		size_t room = l->room ? 2 * l->room : 64;
		struct asset_use *more = arena_alloc(arena, room, sizeof *more);
		if (!more)
			return -ENOMEM;
		if (l->count)
			memcpy(more, l->uses, l->count * sizeof *more);
		l->uses = more;
		l->room = room;
	}
	l->uses[l->count] = (struct asset_use){name, by, l->count};
	l->count++;
	return 0;
}

static int compare_uses(const void *a, const void *b)
{
	const struct asset_use *x = a, *y = b;
	int order = strcmp(x->name, y->name);
	return order ? order : x->at < y->at ? -1 : x->at > y->at;
}

static const char *place_of(const struct xml_element *by, struct arena *arena)
{
	char text[512] = "";
	const char *type = by ? xml_attribute(by, "type") : NULL;
	if (type)
		snprintf(text, sizeof text, "%.300s:%d: <%.64s type=\"%.64s\">", by->file, by->line, by->name, type);
	else if (by)
		snprintf(text, sizeof text, "%.300s:%d: <%.64s>", by->file, by->line, by->name);
	return arena_strdup(arena, text);
}

int asset_list_finish(struct asset_list *l, const char *but, struct arena *arena)
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
		if ((n > 0 && strcmp(l->names[n - 1], use->name) == 0) || strcmp(use->name, but) == 0)
			continue;
		l->names[n] = use->name;
		if (!(l->places[n++] = place_of(use->by, arena)))
			return -ENOMEM;
	}
	l->count = n;
	return 0;
}
