/* SPDX-License-Identifier: Apache-2.0 */
/* FNV-1a of 64 bits (Fowler, Noll and Vo): a hash of bytes that nobody chooses to collide. Pure. */
#ifndef COMMON_BASE_FNV_H
#define COMMON_BASE_FNV_H

#include <stddef.h>
#include <stdint.h>

#define FNV_BEGIN 0xcbf29ce484222325u

/* On from the hash of what was before. */
static inline uint64_t fnv_add(uint64_t hash, const void *bytes, size_t size)
{
	const unsigned char *p = bytes;
	for (size_t i = 0; i < size; i++)
		hash = (hash ^ p[i]) * 0x100000001b3u;
	return hash;
}

#endif
