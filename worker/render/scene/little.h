/* SPDX-License-Identifier: Apache-2.0 */
/* Numbers of binary files, least byte first. The caller has checked that the bytes are there. */
#ifndef WORKER_RENDER_SCENE_LITTLE_H
#define WORKER_RENDER_SCENE_LITTLE_H

#include <stdint.h>

static inline uint32_t little_u16(const unsigned char *p)
{
	return (uint32_t)p[0] | (uint32_t)p[1] << 8;
}

static inline uint32_t little_u32(const unsigned char *p)
{
	return little_u16(p) | little_u16(p + 2) << 16;
}

#endif
