/* SPDX-License-Identifier: Apache-2.0 */
/* The 64-bit hash FNV-1a (Fowler, Noll and Vo), for input that no adversary chooses. Pure. */
#ifndef COMMON_BASE_FNV_H
#define COMMON_BASE_FNV_H

#include <stddef.h>
#include <stdint.h>

#define FNV_OFFSET_BASIS 0xcbf29ce484222325u

/* Continues `hash`, the hash of the preceding bytes or FNV_OFFSET_BASIS, with `size` more bytes. */
static inline uint64_t fnv_add(uint64_t hash, const void *bytes, size_t size)
{
	const unsigned char *p = bytes;
	for (size_t i = 0; i < size; i++)
		hash = (hash ^ p[i]) * 0x100000001b3u;
	return hash;
}

#endif
