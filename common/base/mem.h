/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The one door for memory. Tests make the n-th allocation fail (tests/support/failing_memory.h) and check that nothing
 * leaks or crashes.
 * Returned memory is zeroed. Any thread.
 */
#ifndef COMMON_BASE_MEM_H
#define COMMON_BASE_MEM_H

#include <stddef.h>

void *mem_alloc(size_t count, size_t size);		   /* NULL when count * size overflows or memory is out */
void *mem_grow(void *p, size_t old_size, size_t new_size); /* as realloc; the new part is zeroed; p lives on failure */
char *mem_strdup(const char *s);
void mem_free(void *p);

/* At the start of a program: up to so many freed bytes wait for the next allocations, and what is larger goes back to
 * the kernel at once. A daemon that takes and frees buffers of megabytes spends a fifth of its time on pages that the
 * kernel takes back and zeroes again; one that reads large meshes and then works for hours keeps half as much again for
 * nothing, because the C library raises the limit itself each time. */
void mem_keep(size_t bytes);

#endif
