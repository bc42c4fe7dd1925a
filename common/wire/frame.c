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

void frame_prefix_write(unsigned char out[FRAME_PREFIX], uint32_t header_size, uint32_t payload_size)
{
	write_u32(out, header_size);
	write_u32(out + 4, payload_size);
}

void frame_prefix_read(const unsigned char in[FRAME_PREFIX], uint32_t *header_size, uint32_t *payload_size)
{
	*header_size = read_u32(in);
	*payload_size = read_u32(in + 4);
}

void frame_add_checksums(unsigned char out[FRAME_CHECKED_PREFIX], const unsigned char prefix[FRAME_PREFIX],
			 const unsigned char *content, size_t size)
{
	memcpy(out, prefix, FRAME_PREFIX);
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

static uint32_t prefix_wanted(const struct frame_reader *r)
{
	return r->checked ? FRAME_CHECKED_PREFIX : FRAME_PREFIX;
}

static bool is_whole(const struct frame_reader *r)
{
	return r->prefix_size && r->prefix_size == prefix_wanted(r) && r->header.size == r->header_size &&
	       r->payload.size == r->payload_size;
}

bool frame_reader_is_midway(const struct frame_reader *r)
{
	return r->prefix_size && !is_whole(r);
}

uint64_t frame_reader_size(const struct frame_reader *r)
{
	return (uint64_t)r->header_size + r->payload_size;
}

/* Frees large buffers, so that an idle connection holds little memory. */
void frame_reader_drop(struct frame_reader *r)
{
	enum { KEEP = 1 << 16 };
	bool whole = is_whole(r);
	if (r->header.capacity > KEEP)
		buf_fini(&r->header);
	if (r->payload.capacity > KEEP)
		buf_fini(&r->payload);
	r->header.size = r->payload.size = 0;
	r->checked = r->checked || whole;
	r->prefix_size = r->header_size = r->payload_size = r->sum = 0;
}

static int refuse_changed(struct error *e)
{
	return error_set(e, EILSEQ, "data was changed in transit: the checksum of a message does not match");
}

/* Checks the prefix, sets the sizes, and bounds the buffers by them. */
static int take_prefix(struct frame_reader *r, struct error *e)
{
	if (r->checked && crc32c(0, r->prefix, 12) != read_u32(r->prefix + 12))
		return refuse_changed(e);
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

/* Appends bytes to one of the two buffers until it holds `want` bytes. */
static int take_part(struct frame_reader *r, struct buf *b, size_t want, const unsigned char *bytes, size_t count,
		     size_t *used, struct error *e)
{
	size_t n = want - b->size < count - *used ? want - b->size : count - *used;
	if (!buf_append(b, bytes + *used, n))
		return error_set(e, ENOMEM, "no memory for a frame of %zu bytes", want);
	if (r->checked)
		r->sum = crc32c(r->sum, bytes + *used, n);
	*used += n;
	return 0;
}

int frame_reader_take(struct frame_reader *r, const unsigned char *bytes, size_t count, size_t *used, struct error *e)
{
	*used = 0;
	if (is_whole(r))
		frame_reader_drop(r);
	uint32_t prefix = prefix_wanted(r);
	if (r->prefix_size < prefix) {
		while (r->prefix_size < prefix && *used < count)
			r->prefix[r->prefix_size++] = bytes[(*used)++];
		if (r->prefix_size < prefix)
			return 0;
		int rc = take_prefix(r, e);
		if (rc)
			return rc;
	}
	int rc = take_part(r, &r->header, r->header_size, bytes, count, used, e);
	if (!rc)
		rc = take_part(r, &r->payload, r->payload_size, bytes, count, used, e);
	if (rc || !is_whole(r))
		return rc;
	return r->checked && r->sum != read_u32(r->prefix + 8) ? refuse_changed(e) : 1;
}
