/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Decodes the format of appendix A of KHR_meshopt_compression. Elements are stored in blocks. A block stores the first
 * bytes of all its elements, then the second bytes, and so on; four of these planes form a channel. A plane consists of
 * deltas to the previous element, in groups of 16 that are packed with as few bits as they need. The deltas of the very
 * first element refer to a base element at the end of the stream; after it, one byte for each channel states the kind
 * of its deltas. Failures: streams that end too early or too late, unknown kinds of deltas.
 */
#include "worker/render/gltf/gltf_meshopt_v1.h"

#include "common/base/bytes.h"

#include <string.h>

enum { GROUP_SIZE = 16, BLOCK_ELEMENTS_MAX = 256, BLOCK_BYTES = 8192, TAIL_BYTES_MIN = 24 };

struct stream {
	const unsigned char *cursor, *end;
};

static const unsigned char *read_bytes(struct stream *s, size_t count)
{
	const unsigned char *start = s->cursor;
	if ((size_t)(s->end - s->cursor) < count)
		return NULL;
	s->cursor += count;
	return start;
}

/* Reads 16 numbers of `bits` each. A number whose bits are all ones is stored as a whole byte after the group. */
static bool read_group(struct stream *s, unsigned bits, unsigned char out[GROUP_SIZE])
{
	const unsigned char *packed = read_bytes(s, 2 * bits), *escaped;
	unsigned sentinel = (1u << bits) - 1;
	if (!packed)
		return false;
	for (unsigned i = 0; i < GROUP_SIZE; i++) {
		unsigned bit = i * bits, shift = bits == 1 ? bit % 8 : 8 - bits - bit % 8,
			 x = bits ? (unsigned)packed[bit / 8] >> shift & sentinel : 0;
		if (bits && bits < 8 && x == sentinel) {
			if (!(escaped = read_bytes(s, 1)))
				return false;
			x = *escaped;
		}
		out[i] = (unsigned char)x;
	}
	return true;
}

/* Reads one byte of each of `count` elements; `out` has room for whole groups. */
static bool read_plane(struct stream *s, unsigned control, size_t count, unsigned char *out)
{
	enum { ZEROS = 2, LITERAL = 3 };
	static const unsigned char lengths[2][4] = {{0, 1, 2, 4}, {1, 2, 4, 8}};
	if (control == ZEROS) {
		memset(out, 0, count);
		return true;
	}
	if (control == LITERAL) {
		const unsigned char *literal = read_bytes(s, count);
		if (literal)
			memcpy(out, literal, count);
		return literal != NULL;
	}
	size_t groups = (count + GROUP_SIZE - 1) / GROUP_SIZE;
	const unsigned char *header = read_bytes(s, (groups + 3) / 4);
	for (size_t g = 0; header && g < groups; g++)
		if (!read_group(s, lengths[control][header[g / 4] >> g % 4 * 2 & 3], out + g * GROUP_SIZE))
			return false;
	return header != NULL;
}

/* Zigzag decoding: returns the integer at this place in the sequence 0, -1, 1, -2, 2, ... */
static uint32_t zigzag_decode(uint32_t value)
{
	return value & 1 ? ~(value >> 1) : value >> 1;
}

enum { DELTA_BYTES, DELTA_PAIRS, DELTA_ROTATED, DELTA_KINDS };

/* Returns the four bytes of a channel in the next element, from those in the last one. */
static uint32_t next_value(uint32_t previous, unsigned channel, uint32_t delta)
{
	unsigned width = channel == DELTA_BYTES ? 8 : 16, rotation = channel >> 4;
	uint32_t mask = (1u << width) - 1, out = 0;
	if ((channel & 15) == DELTA_ROTATED)
		return previous ^ (delta >> rotation | delta << ((32 - rotation) & 31));
	for (unsigned shift = 0; shift < 32; shift += width)
		out |= (((previous >> shift & mask) + zigzag_decode(delta >> shift & mask)) & mask) << shift;
	return out;
}

/* Reads one channel of a block. out: where it is in the first element; previous: its value in the element before. */
static bool read_channel(struct stream *s, unsigned controls, unsigned channel, size_t count, size_t stride,
			 unsigned char *out, uint32_t *previous)
{
	unsigned char planes[4][BLOCK_ELEMENTS_MAX];
	for (int k = 0; k < 4; k++)
		if (!read_plane(s, controls >> 2 * k & 3, count, planes[k]))
			return false;
	for (size_t i = 0; i < count; i++) {
		const unsigned char bytes[4] = {planes[0][i], planes[1][i], planes[2][i], planes[3][i]};
		*previous = next_value(*previous, channel, get32(bytes));
		put32(out + i * stride, *previous);
	}
	return true;
}

bool gltf_meshopt_v1_decode(const unsigned char *bytes, size_t size, size_t count, size_t stride, unsigned char *out)
{
	size_t channels = stride / 4, tail = stride + channels,
	       block_elements = BLOCK_BYTES / stride & ~(size_t)(GROUP_SIZE - 1);
	size_t padded = tail < TAIL_BYTES_MIN ? TAIL_BYTES_MIN : tail;
	uint32_t previous[BLOCK_ELEMENTS_MAX / 4];
	if (size < 1 + padded || bytes[0] != GLTF_MESHOPT_V1)
		return false;
	const unsigned char *kinds = bytes + size - channels, *base = bytes + size - tail;
	struct stream s = {bytes + 1, bytes + size - padded};
	block_elements = block_elements < BLOCK_ELEMENTS_MAX ? block_elements : BLOCK_ELEMENTS_MAX;
	for (size_t c = 0; c < channels; c++) {
		previous[c] = get32(base + 4 * c);
		if ((kinds[c] & 15) >= DELTA_KINDS || (kinds[c] > 15 && (kinds[c] & 15) != DELTA_ROTATED))
			return false;
	}
	for (size_t first = 0, n; first < count; first += n) {
		n = count - first < block_elements ? count - first : block_elements;
		const unsigned char *controls = read_bytes(&s, channels);
		for (size_t c = 0; c < channels; c++)
			if (!controls || !read_channel(&s, controls[c], kinds[c], n, stride,
						       out + first * stride + 4 * c, &previous[c]))
				return false;
	}
	return s.cursor == s.end;
}
