/* SPDX-License-Identifier: Apache-2.0 */
/* Numbers in files, messages and chain states: little endian on any machine, floating point numbers as the bits of
 * their IEEE 754 representation. */
#ifndef COMMON_BASE_BYTES_H
#define COMMON_BASE_BYTES_H

#include <stdbool.h>
#include <stddef.h>
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

static inline void put_float(uint8_t *p, float v)
{
	uint32_t bits;
	memcpy(&bits, &v, sizeof bits);
	put32(p, bits);
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

/* ---- arrays of numbers of 1, 2, 4 or 8 bytes */

static inline bool is_little_endian(void)
{
	const uint16_t one = 1;
	uint8_t first;
	memcpy(&first, &one, 1);
	return first == 1;
}

/* Copies `count` numbers of `width` bytes, each with its bytes in reverse order; to and from may be the same. */
static inline void reverse_bytes_of_numbers(uint8_t *to, const uint8_t *from, size_t width, size_t count)
{
	for (; count; count--, to += width, from += width)
		for (size_t i = 0; i < (width + 1) / 2; i++) {
			uint8_t low = from[i], high = from[width - 1 - i];
			to[i] = high;
			to[width - 1 - i] = low;
		}
}

/* Converts `count` numbers of `width` bytes from the machine's byte order to little endian, or back. `to` and `from`
 * are either the same or do not overlap. */
static inline void copy_numbers(void *to, const void *from, size_t width, size_t count)
{
	if (!is_little_endian())
		reverse_bytes_of_numbers(to, from, width, count);
	else if (to != from && count)
		memcpy(to, from, width * count);
}

#endif
