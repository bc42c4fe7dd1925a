/* SPDX-License-Identifier: Apache-2.0 */
/* A list that grows by doubling. One thread. */
#ifndef COMMON_BASE_LIST_H
#define COMMON_BASE_LIST_H

#include <stddef.h>

struct list {
	void *items;	  /* allocated with mem.h */
	size_t count;	  /* items in use */
	size_t capacity;  /* items that fit */
	size_t item_size; /* bytes of an item */
};

/* Appends one item, which the caller fills, and returns it; NULL if memory is out, and then the list is unchanged.
 * Pointers to items are valid until the next call. */
void *list_push(struct list *l);
/* Frees the items; the list is empty and can be used again. */
void list_fini(struct list *l);

/* Makes room for one more item in an array of `count` items of `item_size` bytes. The array must be NULL (if count is
 * 0) or have been grown by this function alone: it doubles whenever count is a power of two, so no capacity is stored.
 * Returns the array, which may have moved; NULL if memory is out, and then the array is unchanged. */
void *list_grow_array(void *items, size_t count, size_t size);

/* Compares two doubles for qsort, ascending. */
int compare_doubles(const void *a, const void *b);

#endif
