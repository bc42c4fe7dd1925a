/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Frames. In memory and in journals: u32 BE header length (1..), u32 BE payload length, header, payload. On a
 * connection, all but the first frame in each direction (hello or its answer, which every version must be able to read)
 * also have checksums: after the lengths follow u32 BE CRC-32C of header and payload, and u32 BE CRC-32C of the twelve
 * bytes before it, so that a damaged length is detected before anybody waits for that many bytes. Frames are read piece
 * by piece; lengths are checked against limits before anything is allocated, and memory grows with received bytes, not
 * with promised ones. No I/O; one thread at a time.
 */
#ifndef COMMON_WIRE_FRAME_H
#define COMMON_WIRE_FRAME_H

#include "common/base/buf.h"
#include "common/base/error.h"

#include <stdint.h>

enum { FRAME_PREFIX = 8, FRAME_CHECKED_PREFIX = 16 };

struct frame_limits {
	uint32_t header, payload;
};

struct frame_reader {
	struct frame_limits limits; /* may be changed between frames */
	bool checked;		    /* the first frame has been received */
	unsigned char prefix[FRAME_CHECKED_PREFIX];
	uint32_t prefix_size, header_size, payload_size;
	uint32_t sum; /* of the received part of header and payload */
	struct buf header, payload;
};

void frame_reader_init(struct frame_reader *r, struct frame_limits limits);
void frame_reader_fini(struct frame_reader *r);

/* Takes bytes up to the end of a frame; *used says how many. 1: a frame is complete (header and payload are valid
 * until the next call), 0: more bytes are needed, -EMSGSIZE: a length exceeds its limit, -EBADMSG: no header,
 * -EILSEQ: a checksum does not match, -ENOMEM. */
int frame_reader_take(struct frame_reader *r, const unsigned char *bytes, size_t count, size_t *used, struct error *e);
/* Releases the complete frame; otherwise the next call of frame_reader_take does. */
void frame_reader_drop(struct frame_reader *r);
bool frame_reader_is_midway(const struct frame_reader *r); /* part of a frame has been received */
/* Bytes of header and payload of the frame that is being received; 0: not known yet. */
uint64_t frame_reader_size(const struct frame_reader *r);

void frame_prefix_read(const unsigned char in[FRAME_PREFIX], uint32_t *header_size, uint32_t *payload_size);
void frame_prefix_write(unsigned char out[FRAME_PREFIX], uint32_t header_size, uint32_t payload_size);
/* The prefix of a frame on a connection, for all frames but the first; `content` is header and payload. */
void frame_add_checksums(unsigned char out[FRAME_CHECKED_PREFIX], const unsigned char prefix[FRAME_PREFIX],
			 const unsigned char *content, size_t size);

#endif
