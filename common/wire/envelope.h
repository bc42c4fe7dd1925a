/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The only user of protobuf-c: a frame's header is one Farm__Envelope (proto/farm.proto). Messages are unpacked into
 * memory bounded by a multiple of their length. A message with fields that this version does not know is refused: new
 * fields must be agreed upon in Hello, the only message in which unknown fields are skipped. Any thread, one message at
 * a time.
 */
#ifndef COMMON_WIRE_ENVELOPE_H
#define COMMON_WIRE_ENVELOPE_H

#include "common/base/error.h"

#include "proto/farm.pb-c.h"

#include <stdbool.h>
#include <stddef.h>

enum { FARM_VERSION = 13 };

struct envelope_block;

/* A message to be packed, by its member in Envelope: ENVELOPE(JOB_END, job_end, .job = 7) is one in its envelope, and
 * ENVELOPE_OF(JOB_END, job_end, &m) the envelope of one that exists. What is not given is 0 or empty. Valid to the end
 * of the block. */
#define ENVELOPE_OF(BODY, member, message)                                               \
	(&(Farm__Envelope){.base = PROTOBUF_C_MESSAGE_INIT(&farm__envelope__descriptor), \
			   .body_case = FARM__ENVELOPE__BODY_##BODY,                     \
			   .member = (message)})
#define MESSAGE(member, ...)                                     \
	((__typeof__(*(Farm__Envelope){.body_case = 0}.member)){ \
		.base = PROTOBUF_C_MESSAGE_INIT(&farm__##member##__descriptor), __VA_ARGS__})
#define ENVELOPE(BODY, member, ...) ENVELOPE_OF(BODY, member, &MESSAGE(member, __VA_ARGS__))

/* An unpacked message and its memory. Zeroed memory is a valid empty one for envelope_fini. */
struct envelope {
	Farm__Envelope *message;
	struct envelope_block *blocks;
	size_t bytes;	    /* of memory that it holds */
	size_t used, limit; /* of it, while it is unpacked */
	bool memory_out;
};

/* -EBADMSG: does not parse, unknown fields, no body, or needs more memory than its length allows; -EILSEQ: hello or
 * its answer, of this version, with a wrong checksum (its last field); -ENOMEM. */
int envelope_unpack(struct envelope *env, const unsigned char *bytes, size_t size, struct error *e);
void envelope_fini(struct envelope *env);
/* A stored frame that must have this message: a result in a journal, a submission or plan in the ledger. -EBADMSG,
 * -ENOMEM. The payload points into the frame. */
int envelope_unpack_frame(struct envelope *env, Farm__Envelope__BodyCase want, const unsigned char *frame, size_t size,
			  const unsigned char **payload, size_t *payload_size, struct error *e);

/* A frame in one piece, mem_alloc'd: prefix, header and room for the payload, which is copied from `payload` unless
 * that is NULL. Adds the checksum of hello and its answer. -EMSGSIZE: a length does not fit. */
int envelope_pack(const Farm__Envelope *message, const void *payload, size_t payload_size, unsigned char **bytes,
		  size_t *size, struct error *e);

/* Whether text from outside may be displayed and stored: not NULL, valid UTF-8, no control characters, at most `max`
 * bytes. */
bool envelope_text_ok(const char *text, size_t max);

#endif
