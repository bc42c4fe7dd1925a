/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/list.h"

#include "common/base/mem.h"

void *list_push(struct list *l)
{
	if (l->count == l->capacity) {
		size_t capacity = l->capacity ? 2 * l->capacity : 256;
		void *grown = mem_grow(l->items, l->capacity * l->item_size, capacity * l->item_size);
		if (!grown)
			return NULL;
		l->items = grown;
		l->capacity = capacity;
	}
	return (char *)l->items + l->item_size * l->count++;
}

void list_fini(struct list *l)
{
	mem_free(l->items);
	*l = (struct list){.item_size = l->item_size};
}

void *list_grow_array(void *items, size_t count, size_t size)
{
	return count & (count - 1) ? items : mem_grow(items, count * size, (count ? 2 * count : 1) * size);
}

int compare_doubles(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}
