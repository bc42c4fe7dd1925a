/* SPDX-License-Identifier: Apache-2.0 */
#include "common/wire/frame.h"

#include "common/base/crc.h"

#include <string.h>

static uint32_t read_u32(const unsigned char *p)
{
	return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

static void write_u32(unsigned char *p, uint32_t v)
{
	p[0] = (unsigned char)(v >> 24);
	p[1] = (unsigned char)(v >> 16);
	p[2] = (unsigned char)(v >> 8);
	p[3] = (unsigned char)v;
}

void frame_prefix_write(unsigned char out[FRAME_PREFIX_SIZE], uint32_t header_size, uint32_t payload_size)
{
	write_u32(out, header_size);
	write_u32(out + 4, payload_size);
}

void frame_prefix_read(const unsigned char in[FRAME_PREFIX_SIZE], uint32_t *header_size, uint32_t *payload_size)
{
	*header_size = read_u32(in);
	*payload_size = read_u32(in + 4);
}

void frame_checked_prefix_write(unsigned char out[FRAME_CHECKED_PREFIX_SIZE],
				const unsigned char prefix[FRAME_PREFIX_SIZE], const unsigned char *content,
				size_t size)
{
	memcpy(out, prefix, FRAME_PREFIX_SIZE);
	write_u32(out + 8, crc32c(0, content, size));
	write_u32(out + 12, crc32c(0, out, 12));
}

void frame_reader_init(struct frame_reader *r, struct frame_limits limits)
{
	memset(r, 0, sizeof *r);
	r->limits = limits;
}

void frame_reader_fini(struct frame_reader *r)
{
	buf_fini(&r->header);
	buf_fini(&r->payload);
}

static uint32_t expected_prefix_size(const struct frame_reader *r)
{
	return r->has_checksums ? FRAME_CHECKED_PREFIX_SIZE : FRAME_PREFIX_SIZE;
}

static bool is_complete(const struct frame_reader *r)
{
	return r->prefix_size && r->prefix_size == expected_prefix_size(r) && r->header.size == r->header_size &&
	       r->payload.size == r->payload_size;
}

bool frame_reader_is_midway(const struct frame_reader *r)
{
	return r->prefix_size && !is_complete(r);
}

uint64_t frame_reader_frame_size(const struct frame_reader *r)
{
	return (uint64_t)r->header_size + r->payload_size;
}

/* Frees large buffers, so that an idle connection holds little memory. */
void frame_reader_reset(struct frame_reader *r)
{
	enum { KEPT_BYTES_MAX = 1 << 16 };
	bool complete = is_complete(r);
	if (r->header.capacity > KEPT_BYTES_MAX)
		buf_fini(&r->header);
	if (r->payload.capacity > KEPT_BYTES_MAX)
		buf_fini(&r->payload);
	r->header.size = r->payload.size = 0;
	r->has_checksums = r->has_checksums || complete;
	r->prefix_size = r->header_size = r->payload_size = r->crc = 0;
}

static int refuse_corrupted(struct error *e)
{
	return error_set(e, EILSEQ, "data was changed in transit: the checksum of a message does not match");
}

/* Checks the prefix, sets the sizes, and bounds the buffers by them. */
static int parse_prefix(struct frame_reader *r, struct error *e)
{
	if (r->has_checksums && crc32c(0, r->prefix, 12) != read_u32(r->prefix + 12))
		return refuse_corrupted(e);
	frame_prefix_read(r->prefix, &r->header_size, &r->payload_size);
	if (r->header_size == 0)
		return error_set(e, EBADMSG, "a frame without a header");
	if (r->header_size > r->limits.header)
		return error_set(e, EMSGSIZE, "a header of %u bytes, at most %u are allowed now", r->header_size,
				 r->limits.header);
	if (r->payload_size > r->limits.payload)
		return error_set(e, EMSGSIZE, "a payload of %u bytes, at most %u are allowed now", r->payload_size,
				 r->limits.payload);
	r->header.limit = r->header.capacity > r->header_size ? r->header.capacity : r->header_size;
	r->payload.limit = r->payload.capacity > r->payload_size ? r->payload.capacity : r->payload_size;
	return 0;
}

/* Appends bytes to one of the two buffers until it holds `expected` bytes. */
static int fill_buffer(struct frame_reader *r, struct buf *b, size_t expected, const unsigned char *bytes, size_t count,
		       size_t *used, struct error *e)
{
	size_t n = expected - b->size < count - *used ? expected - b->size : count - *used;
	if (!buf_append(b, bytes + *used, n))
		return error_set(e, ENOMEM, "no memory for a frame of %zu bytes", expected);
	if (r->has_checksums)
		r->crc = crc32c(r->crc, bytes + *used, n);
	*used += n;
	return 0;
}

int frame_reader_feed(struct frame_reader *r, const unsigned char *bytes, size_t count, size_t *used, struct error *e)
{
	*used = 0;
	if (is_complete(r))
		frame_reader_reset(r);
	uint32_t prefix = expected_prefix_size(r);
	if (r->prefix_size < prefix) {
		while (r->prefix_size < prefix && *used < count)
			r->prefix[r->prefix_size++] = bytes[(*used)++];
		if (r->prefix_size < prefix)
			return 0;
		int rc = parse_prefix(r, e);
		if (rc)
			return rc;
	}
	int rc = fill_buffer(r, &r->header, r->header_size, bytes, count, used, e);
	if (!rc)
		rc = fill_buffer(r, &r->payload, r->payload_size, bytes, count, used, e);
	if (rc || !is_complete(r))
		return rc;
	return r->has_checksums && r->crc != read_u32(r->prefix + 8) ? refuse_corrupted(e) : 1;
}
