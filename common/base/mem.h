/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All heap memory of the project. Tests make the n-th allocation fail (tests/support/failing_memory.h) and check that
 * nothing leaks or crashes. Memory is zeroed, except for mem_strdup's. Any thread.
 */
#ifndef COMMON_BASE_MEM_H
#define COMMON_BASE_MEM_H

#include <stddef.h>

/* Returns NULL if count * size overflows or memory is out. */
void *mem_alloc(size_t count, size_t size);
/* Like realloc, but the new part is zeroed; p stays valid on failure. */
void *mem_grow(void *p, size_t old_size, size_t new_size);
char *mem_strdup(const char *s);
void mem_free(void *p);

/* Call at the start of a program: up to `bytes` of freed memory are kept for the next allocations, and blocks larger
 * than that (or than 32 MiB) are returned to the kernel as soon as they are freed. Without this call, a daemon that
 * allocates and frees buffers of megabytes spends a fifth of its time on page faults, and one that reads large meshes
 * keeps half as much memory again unused, because the C library adapts its thresholds by itself. */
void mem_retain_freed(size_t bytes);

#endif
