/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Frames, the units of files and connections.
 *
 * In memory and in journals, a frame is: u32 BE header length (at least 1), u32 BE payload length, header, payload. On
 * a connection, all but the first frame in each direction also have checksums: after the lengths follow the u32 BE
 * CRC-32C of header and payload, and the u32 BE CRC-32C of the twelve bytes before it, so that a damaged length is
 * detected before the receiver waits for that many bytes. The first frame is Hello or its answer, which every version
 * must be able to read.
 *
 * Frames are received piece by piece. Lengths are checked against limits before anything is allocated, and memory grows
 * with the bytes received, not with those announced. No I/O; one thread at a time.
 */
#ifndef COMMON_WIRE_FRAME_H
#define COMMON_WIRE_FRAME_H

#include "common/base/buf.h"
#include "common/base/error.h"

#include <stdint.h>

enum { FRAME_PREFIX_SIZE = 8, FRAME_CHECKED_PREFIX_SIZE = 16 };

struct frame_limits {
	uint32_t header, payload;
};

struct frame_reader {
	struct frame_limits limits; /* may be changed between frames */
	bool has_checksums;	    /* the first frame has been received */
	unsigned char prefix[FRAME_CHECKED_PREFIX_SIZE];
	uint32_t prefix_size;		    /* bytes of the prefix received so far */
	uint32_t header_size, payload_size; /* as announced by the prefix */
	uint32_t crc;			    /* CRC of the part of header and payload received so far */
	struct buf header, payload;
};

void frame_reader_init(struct frame_reader *r, struct frame_limits limits);
void frame_reader_fini(struct frame_reader *r);

/* Takes bytes up to the end of a frame; *used is their number. Returns 1 if a frame is complete (header and payload are
 * then valid until the next call), 0 if more bytes are needed, -EMSGSIZE if a length exceeds its limit, -EBADMSG if
 * there is no header, -EILSEQ if a checksum does not match, or -ENOMEM. */
int frame_reader_feed(struct frame_reader *r, const unsigned char *bytes, size_t count, size_t *used, struct error *e);
/* Releases a complete frame early; frame_reader_feed releases it, too. */
void frame_reader_reset(struct frame_reader *r);
bool frame_reader_is_midway(const struct frame_reader *r); /* part of a frame has been received */
/* Returns the bytes of header and payload of the frame being received; 0 if not known yet. */
uint64_t frame_reader_frame_size(const struct frame_reader *r);

void frame_prefix_read(const unsigned char in[FRAME_PREFIX_SIZE], uint32_t *header_size, uint32_t *payload_size);
void frame_prefix_write(unsigned char out[FRAME_PREFIX_SIZE], uint32_t header_size, uint32_t payload_size);
/* Writes the prefix with checksums that all frames but the first have on a connection. content: header and payload. */
void frame_checked_prefix_write(unsigned char out[FRAME_CHECKED_PREFIX_SIZE],
				const unsigned char prefix[FRAME_PREFIX_SIZE], const unsigned char *content,
				size_t size);

#endif
