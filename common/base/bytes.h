/* SPDX-License-Identifier: Apache-2.0 */
/* Little-endian numbers in files, messages and chain states, on any machine. */
#ifndef COMMON_BASE_BYTES_H
#define COMMON_BASE_BYTES_H

#include <stdint.h>
#include <string.h>

static inline void put_bytes(uint8_t *p, uint64_t v, int count)
{
	for (int i = 0; i < count; i++)
		p[i] = (uint8_t)(v >> (8 * i));
}

static inline uint64_t get_bytes(const uint8_t *p, int count)
{
	uint64_t v = 0;
	for (int i = 0; i < count; i++)
		v |= (uint64_t)p[i] << (8 * i);
	return v;
}

static inline uint32_t get16(const uint8_t *p)
{
	return (uint32_t)get_bytes(p, 2);
}

static inline void put32(uint8_t *p, uint32_t v)
{
	put_bytes(p, v, 4);
}

static inline uint32_t get32(const uint8_t *p)
{
	return (uint32_t)get_bytes(p, 4);
}

static inline void put64(uint8_t *p, uint64_t v)
{
	put_bytes(p, v, 8);
}

static inline uint64_t get64(const uint8_t *p)
{
	return get_bytes(p, 8);
}

static inline float get_float(const uint8_t *p)
{
	uint32_t bits = get32(p);
	float v;
	memcpy(&v, &bits, sizeof v);
	return v;
}

static inline void put_double(uint8_t *p, double v)
{
	uint64_t bits;
	memcpy(&bits, &v, sizeof bits);
	put64(p, bits);
}

static inline double get_double(const uint8_t *p)
{
	uint64_t bits = get64(p);
	double v;
	memcpy(&v, &bits, sizeof v);
	return v;
}

#endif
