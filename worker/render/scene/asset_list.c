/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/asset_list.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

int asset_list_add(struct asset_list *l, const char *name, struct arena *arena)
{
	if (l->count == l->room) {
		size_t room = l->room ? 2 * l->room : 64;
		const char **more = arena_alloc(arena, room, sizeof *more);
		if (!more)
			return -ENOMEM;
		if (l->count)
			memcpy(more, l->names, l->count * sizeof *more);
		l->names = more;
		l->room = room;
	}
	l->names[l->count++] = name;
	return 0;
}

static int compare_names(const void *a, const void *b)
{
	const char *const *x = a, *const *y = b;
	return strcmp(*x, *y);
}

void asset_list_finish(struct asset_list *l, const char *but)
{
	size_t n = 0;
	if (l->count)
		qsort(l->names, l->count, sizeof *l->names, compare_names);
	for (size_t i = 0; i < l->count; i++)
		if ((n == 0 || strcmp(l->names[n - 1], l->names[i]) != 0) && strcmp(l->names[i], but) != 0)
			l->names[n++] = l->names[i];
	l->count = n;
}
