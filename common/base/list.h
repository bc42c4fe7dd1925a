/* SPDX-License-Identifier: Apache-2.0 */
/* A list that grows by doubling. One thread. */
#ifndef COMMON_BASE_LIST_H
#define COMMON_BASE_LIST_H

#include <stddef.h>

struct list {
	void *items; /* mem_alloc'd */
	size_t count, room;
	size_t size; /* of an item */
};

/* Room for one more item, for the caller to fill; NULL: no memory, and the list is as before. Pointers to items are
 * valid until the next call. */
void *list_push(struct list *l);
void list_free(struct list *l); /* leaves it empty */

/* Room for one more in an array of `count` items that only this has made larger, or NULL, an empty one. It grows at the
 * powers of two, so its capacity need not be known. Returns the array, which may have moved; NULL: no memory, and it is
 * as before. */
void *list_room(void *items, size_t count, size_t size);

int double_compare(const void *a, const void *b); /* for qsort: ascending */

#endif
