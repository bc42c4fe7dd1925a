/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Packs and unpacks messages with protobuf-c: a frame's header is one Farm__Envelope (proto/farm.proto). Messages are
 * unpacked into memory that is bounded by a multiple of their length. A message with fields that this version does not
 * know is refused: new fields must be agreed upon in Hello, which may have unknown fields, as its answer may. Any
 * thread, one message at a time.
 */
#ifndef COMMON_WIRE_ENVELOPE_H
#define COMMON_WIRE_ENVELOPE_H

#include "common/base/error.h"

#include "proto/farm.pb-c.h"

#include <stdbool.h>
#include <stddef.h>

enum { FARM_VERSION = 13 };

struct envelope_block;

/* Make an envelope to be packed; valid to the end of the enclosing block. ENVELOPE(JOB_END, job_end, .job = 7) makes
 * the message, too, whose other members are 0 or empty; ENVELOPE_OF(JOB_END, job_end, &m) is the envelope of the
 * message m. The second argument is the message's member of Envelope. */
#define ENVELOPE_OF(BODY, member, message)                                               \
	(&(Farm__Envelope){.base = PROTOBUF_C_MESSAGE_INIT(&farm__envelope__descriptor), \
			   .body_case = FARM__ENVELOPE__BODY_##BODY,                     \
			   .member = (message)})
#define MESSAGE(member, ...)                                     \
	((__typeof__(*(Farm__Envelope){.body_case = 0}.member)){ \
		.base = PROTOBUF_C_MESSAGE_INIT(&farm__##member##__descriptor), __VA_ARGS__})
#define ENVELOPE(BODY, member, ...) ENVELOPE_OF(BODY, member, &MESSAGE(member, __VA_ARGS__))

/* An unpacked message and its memory. Zeroed memory is an empty envelope. */
struct envelope {
	Farm__Envelope *message;
	struct envelope_block *blocks;
	size_t bytes;	       /* memory of all blocks */
	size_t used, limit;    /* while unpacking: bytes handed out to protobuf-c, and their limit */
	bool is_out_of_memory; /* an allocation failed */
};

/* Unpacks a message. Returns 0; -EBADMSG if the message does not parse, has unknown fields or no body, or needs more
 * memory than its length allows; -EILSEQ if it is Hello or its answer, of this version, with a wrong checksum; -ENOMEM.
 */
int envelope_unpack(struct envelope *env, const unsigned char *bytes, size_t size, struct error *e);
void envelope_fini(struct envelope *env);
/* Unpacks a stored frame that must contain the message `expected`: a result in a journal, a submission or plan in the
 * database. The payload points into the frame. Returns 0, or an error of envelope_unpack; -EBADMSG also for another
 * length or another message. */
int envelope_unpack_frame(struct envelope *env, Farm__Envelope__BodyCase expected, const unsigned char *frame,
			  size_t size, const unsigned char **payload, size_t *payload_size, struct error *e);

/* Packs a message into a frame in one piece, which is freed with mem_free: prefix, header, and room for the payload,
 * which is copied from `payload` unless that is NULL. Adds the checksum of Hello and its answer. Returns 0, -EMSGSIZE
 * if a length does not fit into 32 bits, or -ENOMEM. */
int envelope_pack(const Farm__Envelope *message, const void *payload, size_t payload_size, unsigned char **bytes,
		  size_t *size, struct error *e);

/* Returns whether a text from outside may be displayed and stored: not NULL, valid UTF-8, no control characters, at
 * most `max` bytes. */
bool envelope_text_is_valid(const char *text, size_t max);

#endif
