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

enum { GROUP = 16, BLOCK_MOST = 256, BLOCK_BYTES = 8192, TAIL_LEAST = 24 };

struct stream {
	const unsigned char *at, *end;
};

static const unsigned char *take_bytes(struct stream *s, size_t count)
{
	const unsigned char *from = s->at;
	if ((size_t)(s->end - s->at) < count)
		return NULL;
	s->at += count;
	return from;
}

/* Reads 16 numbers of `bits` each. A number whose bits are all ones is stored as a whole byte after the group. */
static bool read_group(struct stream *s, unsigned bits, unsigned char out[GROUP])
{
	const unsigned char *from = take_bytes(s, 2 * bits), *whole;
	unsigned sentinel = (1u << bits) - 1;
	if (!from)
		return false;
	for (unsigned i = 0; i < GROUP; i++) {
		unsigned bit = i * bits, place = bits == 1 ? bit % 8 : 8 - bits - bit % 8,
			 x = bits ? (unsigned)from[bit / 8] >> place & sentinel : 0;
		if (bits && bits < 8 && x == sentinel) {
			if (!(whole = take_bytes(s, 1)))
				return false;
			x = *whole;
		}
		out[i] = (unsigned char)x;
	}
	return true;
}

/* Reads one byte of each of `count` elements; `out` has room for whole groups. */
static bool read_plane(struct stream *s, unsigned control, size_t count, unsigned char *out)
{
	enum { ZEROS = 2, AS_THEY_ARE = 3 };
	static const unsigned char lengths[2][4] = {{0, 1, 2, 4}, {1, 2, 4, 8}};
	if (control == ZEROS) {
		memset(out, 0, count);
		return true;
	}
	if (control == AS_THEY_ARE) {
		const unsigned char *from = take_bytes(s, count);
		if (from)
			memcpy(out, from, count);
		return from != NULL;
	}
	size_t groups = (count + GROUP - 1) / GROUP;
	const unsigned char *header = take_bytes(s, (groups + 3) / 4);
	for (size_t g = 0; header && g < groups; g++)
		if (!read_group(s, lengths[control][header[g / 4] >> g % 4 * 2 & 3], out + g * GROUP))
			return false;
	return header != NULL;
}

/* Zigzag decoding: returns the integer at this place in the sequence 0, -1, 1, -2, 2, ... */
static uint32_t unfold(uint32_t place)
{
	return place & 1 ? ~(place >> 1) : place >> 1;
}

enum { BYTES, PAIRS, ROTATED, KINDS };

/* Returns the four bytes of a channel in the next element, from those in the last one. */
static uint32_t next(uint32_t last, unsigned channel, uint32_t delta)
{
	unsigned width = channel == BYTES ? 8 : 16, turn = channel >> 4;
	uint32_t mask = (1u << width) - 1, out = 0;
	if ((channel & 15) == ROTATED)
		return last ^ (delta >> turn | delta << ((32 - turn) & 31));
	for (unsigned at = 0; at < 32; at += width)
		out |= (((last >> at & mask) + unfold(delta >> at & mask)) & mask) << at;
	return out;
}

/* Reads one channel of a block. to: where it is in the first element; last: its value in the element before. */
static bool read_channel(struct stream *s, unsigned controls, unsigned channel, size_t count, size_t stride,
			 unsigned char *to, uint32_t *last)
{
	unsigned char planes[4][BLOCK_MOST];
	for (int k = 0; k < 4; k++)
		if (!read_plane(s, controls >> 2 * k & 3, count, planes[k]))
			return false;
	for (size_t i = 0; i < count; i++) {
		const unsigned char bytes[4] = {planes[0][i], planes[1][i], planes[2][i], planes[3][i]};
		*last = next(*last, channel, get32(bytes));
		put32(to + i * stride, *last);
	}
	return true;
}

bool gltf_meshopt_v1(const unsigned char *bytes, size_t size, size_t count, size_t stride, unsigned char *out)
{
	size_t channels = stride / 4, tail = stride + channels, most = BLOCK_BYTES / stride & ~(size_t)(GROUP - 1);
	size_t padded = tail < TAIL_LEAST ? TAIL_LEAST : tail;
	uint32_t last[BLOCK_MOST / 4];
	if (size < 1 + padded || bytes[0] != GLTF_MESHOPT_V1)
		return false;
	const unsigned char *kinds = bytes + size - channels, *base = bytes + size - tail;
	struct stream s = {bytes + 1, bytes + size - padded};
	most = most < BLOCK_MOST ? most : BLOCK_MOST;
	for (size_t c = 0; c < channels; c++) {
		last[c] = get32(base + 4 * c);
		if ((kinds[c] & 15) >= KINDS || (kinds[c] > 15 && (kinds[c] & 15) != ROTATED))
			return false;
	}
	for (size_t first = 0, n; first < count; first += n) {
		n = count - first < most ? count - first : most;
		const unsigned char *controls = take_bytes(&s, channels);
		for (size_t c = 0; c < channels; c++)
			if (!controls ||
			    !read_channel(&s, controls[c], kinds[c], n, stride, out + first * stride + 4 * c, &last[c]))
				return false;
	}
	return s.at == s.end;
}
