/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/list.h"

#include "common/base/mem.h"

void *list_push(struct list *l)
{
	if (l->count == l->room) {
		size_t room = l->room ? 2 * l->room : 256;
		void *more = mem_grow(l->items, l->room * l->size, room * l->size);
		if (!more)
			return NULL;
		l->items = more;
		l->room = room;
	}
	return (char *)l->items + l->size * l->count++;
}

void list_free(struct list *l)
{
	mem_free(l->items);
	*l = (struct list){.size = l->size};
}

void *list_room(void *items, size_t count, size_t size)
{
	return count & (count - 1) ? items : mem_grow(items, count * size, (count ? 2 * count : 1) * size);
}

int double_compare(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}
