/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All heap memory. Tests make the n-th allocation fail (tests/support/failing_memory.h) and check that nothing leaks or
 * crashes. Memory is zeroed. Any thread.
 */
#ifndef COMMON_BASE_MEM_H
#define COMMON_BASE_MEM_H

#include <stddef.h>

void *mem_alloc(size_t count, size_t size); /* NULL if count * size overflows or memory is out */
void *mem_grow(void *p, size_t old_size,
	       size_t new_size); /* as realloc; the new part is zeroed; p stays valid on failure */
char *mem_strdup(const char *s);
void mem_free(void *p);

/* Call at the start of a program: up to so many freed bytes are kept for the next allocations, and larger blocks are
 * returned to the kernel at once. Without it, a daemon that allocates and frees buffers of megabytes spends a fifth
 * of its time on page faults, and one that reads large meshes keeps half as much memory again unused, because the C
 * library raises its threshold by itself. */
void mem_keep(size_t bytes);

#endif
