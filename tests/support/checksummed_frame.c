/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/checksummed_frame.h"

#include "common/base/mem.h"
#include "common/wire/frame.h"

#include <stdlib.h>
#include <string.h>

static unsigned char *add_checksums(const unsigned char prefix[FRAME_PREFIX_SIZE], const unsigned char *content,
				    size_t size, bool first, size_t *out_size)
{
	size_t head = first ? FRAME_PREFIX_SIZE : FRAME_CHECKED_PREFIX_SIZE;
	unsigned char *checked = malloc(head + size + 1);
	if (!checked)
		abort();
	if (first)
		memcpy(checked, prefix, FRAME_PREFIX_SIZE);
	else
		frame_checked_prefix_write(checked, prefix, content, size);
	if (size)
		memcpy(checked + head, content, size);
	*out_size = head + size;
	return checked;
}

static bool is_hello(const unsigned char *header, size_t size)
{
	struct envelope env;
	struct error e;
	if (envelope_unpack(&env, header, size, &e))
		return false;
	bool first = env.message->body_case == FARM__ENVELOPE__BODY_HELLO ||
		     env.message->body_case == FARM__ENVELOPE__BODY_HELLO_ACK;
	envelope_fini(&env);
	return first;
}

unsigned char *checksummed_frame(const unsigned char *frame, size_t size, size_t *out_size)
{
	uint32_t header, payload;
	frame_prefix_read(frame, &header, &payload);
	return add_checksums(frame, frame + FRAME_PREFIX_SIZE, size - FRAME_PREFIX_SIZE,
			     is_hello(frame + FRAME_PREFIX_SIZE, header), out_size);
}

/* Returns a hello with its checksum, since it may have been changed after packing; NULL: it is not a hello, or has
 * fields of another version. */
static unsigned char *repack_hello(const void *header, size_t size, size_t *out_size)
{
	Farm__Envelope *m = farm__envelope__unpack(NULL, size, header);
	const ProtobufCMessage *hello = !m						 ? NULL
					: m->body_case == FARM__ENVELOPE__BODY_HELLO	 ? &m->hello->base
					: m->body_case == FARM__ENVELOPE__BODY_HELLO_ACK ? &m->hello_ack->base
											 : NULL;
	unsigned char *checked = hello && !hello->n_unknown_fields && !m->base.n_unknown_fields
					 ? checksummed_frame_from_message(m, NULL, 0, out_size)
					 : NULL;
	if (m)
		farm__envelope__free_unpacked(m, NULL);
	return checked;
}

unsigned char *checksummed_frame_from_parts(const void *header, size_t header_size, const void *payload,
					    size_t payload_size, bool first, size_t *out_size)
{
	unsigned char *hello = first && !payload_size ? repack_hello(header, header_size, out_size) : NULL;
	if (hello)
		return hello;
	unsigned char prefix[FRAME_PREFIX_SIZE], *content = malloc(header_size + payload_size + 1);
	if (!content)
		abort();
	frame_prefix_write(prefix, (uint32_t)header_size, (uint32_t)payload_size);
	if (header_size)
		memcpy(content, header, header_size);
	if (payload_size)
		memcpy(content + header_size, payload, payload_size);
	unsigned char *checked = add_checksums(prefix, content, header_size + payload_size, first, out_size);
	free(content);
	return checked;
}

unsigned char *checksummed_frame_from_message(const Farm__Envelope *m, const void *payload, size_t payload_size,
					      size_t *out_size)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	if (envelope_pack(m, payload, payload_size, &frame, &size, &e))
		abort();
	unsigned char *checked = checksummed_frame(frame, size, out_size);
	mem_free(frame);
	return checked;
}
