/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The one door to protobuf-c: a frame's header is one Farm__Envelope (proto/farm.proto). Messages are unpacked into
 * memory that is bounded by a multiple of their length, and one with fields that this version does not know is
 * refused: what is new must have been agreed upon in Hello, where alone unknown fields are passed over. Any thread, one
 * message at a time.
 */
#ifndef COMMON_WIRE_ENVELOPE_H
#define COMMON_WIRE_ENVELOPE_H

#include "common/base/error.h"

#include "proto/farm.pb-c.h"

#include <stdbool.h>
#include <stddef.h>

enum { FARM_VERSION = 10 };

struct envelope_block;

/* An unpacked message and its memory. Zeroed memory is an empty one; envelope_fini may be called on it. */
struct envelope {
	Farm__Envelope *message;
	struct envelope_block *blocks;
	size_t used, limit;
	bool memory_out;
};

/* -EBADMSG: does not parse, unknown fields, no body, or needs more memory than its length may ask for; -EILSEQ: hello
 * or its answer, of this version, whose checksum (its last field) is not that of its bytes; -ENOMEM. */
int envelope_unpack(struct envelope *env, const unsigned char *bytes, size_t size, struct error *e);
void envelope_fini(struct envelope *env);

/* A frame in one piece, mem_alloc'd: prefix, header and room for the payload, of which `payload` (if not NULL) is
 * copied. Hello and its answer get their checksum here. -EMSGSIZE when a length does not fit. */
int envelope_pack(const Farm__Envelope *message, const void *payload, size_t payload_size, unsigned char **bytes,
		  size_t *size, struct error *e);

/* Text from outside is fit to be shown and stored: not NULL, valid UTF-8, no control characters, at most `max` bytes.
 */
bool envelope_text_ok(const char *text, size_t max);

#endif
