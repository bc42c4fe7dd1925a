/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Packs messages into frames and unpacks them, with protobuf-c.
 *
 * envelope_unpack gives protobuf-c an allocator that hands out pieces of a few blocks, up to a limit that is a multiple
 * of the message's length; all blocks are freed at once. Then the message is searched for fields that this version does
 * not know. The frames of Hello and its answer have no checksum; these messages contain one, which is computed after
 * packing.
 *
 * Failures: a message that is refused (-EBADMSG, -EILSEQ) leaves an empty envelope. If memory is really out, the error
 * is -ENOMEM, not that of a message that needs more than its limit.
 */
#include "common/wire/envelope.h"

#include "common/base/bytes.h"
#include "common/base/crc.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/wire/frame.h"

#include <stdalign.h>
#include <stdint.h>
#include <string.h>

enum {
	BLOCK_BYTES = 1 << 14,
	/* The first block has FIRST_BLOCK_BASE + FIRST_BLOCK_FACTOR * the message's length, at most BLOCK_BYTES,
	 * because thousands of small messages may be held at the same time. */
	FIRST_BLOCK_BASE = 512,
	FIRST_BLOCK_FACTOR = 4,
	/* Memory allowed per byte of a message, in addition to UNPACKED_BYTES_BASE. Valid messages need at most 8
	 * (packed varints of one byte each). */
	AMPLIFICATION = 16,
	UNPACKED_BYTES_BASE = 1 << 16,
	CHECKSUM_SIZE = 4, /* the checksum, a fixed32 with the highest field number, so it comes last in the message */
};

struct envelope_block {
	struct envelope_block *next;
	size_t size, used;
	alignas(16) unsigned char bytes[];
};

static void *allocate_bounded(void *user, size_t size)
{
	struct envelope *env = user;
	size_t need = (size + 15) & ~(size_t)15;
	if (need < size || need > env->limit - env->used)
		return NULL;
	struct envelope_block *b = env->blocks;
	if (!b || b->size - b->used < need) {
		size_t first = FIRST_BLOCK_BASE +
			       FIRST_BLOCK_FACTOR * ((env->limit - UNPACKED_BYTES_BASE) / AMPLIFICATION),
		       usual = b || first > BLOCK_BYTES ? BLOCK_BYTES : first, capacity = need > usual ? need : usual;
		b = mem_alloc(1, sizeof *b + capacity);
		env->is_out_of_memory = !b;
		if (!b)
			return NULL;
		b->size = capacity;
		b->next = env->blocks;
		env->blocks = b;
		env->bytes += sizeof *b + capacity;
	}
	void *p = b->bytes + b->used;
	b->used += need;
	env->used += need;
	return p;
}

static void ignore_free(void *user, void *p)
{
	(void)user;
	(void)p;
}

static bool has_only_known_fields(const ProtobufCMessage *m);

/* Returns whether all fields of the sub-messages in field f of m are known. */
static bool submessages_are_known(const ProtobufCMessage *m, const ProtobufCFieldDescriptor *f)
{
	const char *base = (const char *)m;
	const void *field = base + f->offset;
	if (f->label == PROTOBUF_C_LABEL_REPEATED) {
		size_t count = *(const size_t *)(const void *)(base + f->quantifier_offset);
		ProtobufCMessage *const *messages = *(ProtobufCMessage *const *const *)field;
		for (size_t i = 0; i < count; i++)
			if (!has_only_known_fields(messages[i]))
				return false;
		return true;
	}
	if ((f->flags & PROTOBUF_C_FIELD_FLAG_ONEOF) &&
	    *(const uint32_t *)(const void *)(base + f->quantifier_offset) != f->id)
		return true;
	const ProtobufCMessage *message = *(ProtobufCMessage *const *)field;
	return !message || has_only_known_fields(message);
}

/* Hello and its answer may have unknown fields: a peer of a newer version says so in Hello and must get an answer. */
static bool may_be_newer(const ProtobufCMessage *m)
{
	return m->descriptor == &farm__hello__descriptor || m->descriptor == &farm__hello_ack__descriptor;
}

/* Returns whether the message has no unknown fields. The schema is not recursive, so the depth is bounded. */
static bool has_only_known_fields(const ProtobufCMessage *m)
{
	if (m->n_unknown_fields && !may_be_newer(m))
		return false;
	for (unsigned i = 0; i < m->descriptor->n_fields; i++) {
		const ProtobufCFieldDescriptor *f = &m->descriptor->fields[i];
		if (f->type == PROTOBUF_C_TYPE_MESSAGE && !submessages_are_known(m, f))
			return false;
	}
	return true;
}

/* Returns whether the message contains a checksum: Hello and its answer, of this version. Their frames have none, since
 * other versions could not read it. */
static bool has_checksum(const Farm__Envelope *m)
{
	return (m->body_case == FARM__ENVELOPE__BODY_HELLO && m->hello->version == FARM_VERSION) ||
	       (m->body_case == FARM__ENVELOPE__BODY_HELLO_ACK && m->hello_ack->version == FARM_VERSION);
}

static bool checksum_matches(const unsigned char *bytes, size_t size)
{
	if (size < CHECKSUM_SIZE)
		return false;
	return crc32c(0, bytes, size - CHECKSUM_SIZE) == get32(bytes + size - CHECKSUM_SIZE);
}

static void write_checksum(unsigned char *bytes, size_t size)
{
	put32(bytes + size - CHECKSUM_SIZE, crc32c(0, bytes, size - CHECKSUM_SIZE));
}

int envelope_unpack(struct envelope *env, const unsigned char *bytes, size_t size, struct error *e)
{
	memset(env, 0, sizeof *env);
	env->limit = UNPACKED_BYTES_BASE + AMPLIFICATION * size;
	ProtobufCAllocator allocator = {allocate_bounded, ignore_free, env};
	Farm__Envelope *m = farm__envelope__unpack(&allocator, size, bytes);
	const char *fault = NULL;
	if (!m)
		fault = "a message that does not parse";
	else if (!has_only_known_fields(&m->base))
		fault = "a message with fields that this version of the protocol does not know";
	else if (m->body_case == FARM__ENVELOPE__BODY__NOT_SET)
		fault = "an envelope without a message";
	if (fault) {
		bool out_of_memory = env->is_out_of_memory;
		envelope_fini(env);
		return out_of_memory ? error_set(e, ENOMEM, "no memory for a message")
				     : error_set(e, EBADMSG, "%s", fault);
	}
	if (has_checksum(m) && !checksum_matches(bytes, size)) {
		envelope_fini(env);
		return error_set(e, EILSEQ, "a hello was changed in transit");
	}
	env->message = m;
	return 0;
}

void envelope_fini(struct envelope *env)
{
	while (env->blocks) {
		struct envelope_block *next = env->blocks->next;
		mem_free(env->blocks);
		env->blocks = next;
	}
	memset(env, 0, sizeof *env);
}

int envelope_unpack_frame(struct envelope *env, Farm__Envelope__BodyCase expected, const unsigned char *frame,
			  size_t size, const unsigned char **payload, size_t *payload_size, struct error *e)
{
	uint32_t header = 0, payload_length = 0;
	*payload = NULL;
	*payload_size = 0;
	if (size >= FRAME_PREFIX_SIZE)
		frame_prefix_read(frame, &header, &payload_length);
	if (size < FRAME_PREFIX_SIZE || (uint64_t)header + payload_length != size - FRAME_PREFIX_SIZE)
		return error_set(e, EBADMSG, "a frame of another length");
	int rc = envelope_unpack(env, frame + FRAME_PREFIX_SIZE, header, e);
	if (!rc && env->message->body_case != expected) {
		envelope_fini(env);
		rc = error_set(e, EBADMSG, "another message than was expected");
	}
	*payload = frame + FRAME_PREFIX_SIZE + header;
	*payload_size = payload_length;
	return rc;
}

static int pack_frame(const Farm__Envelope *message, const void *payload, size_t payload_size, unsigned char **bytes,
		      size_t *size, struct error *e)
{
	size_t header = farm__envelope__get_packed_size(message);
	if (header == 0 || header > UINT32_MAX || payload_size > UINT32_MAX)
		return error_set(e, EMSGSIZE, "a message of %zu + %zu bytes does not fit into a frame", header,
				 payload_size);
	size_t frame_size = FRAME_PREFIX_SIZE + header + payload_size;
	unsigned char *p = mem_alloc(frame_size, 1);
	if (!p)
		return error_set(e, ENOMEM, "no memory for a frame of %zu bytes", frame_size);
	frame_prefix_write(p, (uint32_t)header, (uint32_t)payload_size);
	farm__envelope__pack(message, p + FRAME_PREFIX_SIZE);
	if (has_checksum(message))
		write_checksum(p + FRAME_PREFIX_SIZE, header);
	if (payload && payload_size)
		memcpy(p + FRAME_PREFIX_SIZE + header, payload, payload_size);
	*bytes = p;
	*size = frame_size;
	return 0;
}

int envelope_pack(const Farm__Envelope *message, const void *payload, size_t payload_size, unsigned char **bytes,
		  size_t *size, struct error *e)
{
	Farm__Envelope copy = *message;
	Farm__Hello hello;
	Farm__HelloAck ack;
	if (has_checksum(message) && message->body_case == FARM__ENVELOPE__BODY_HELLO) {
		hello = *message->hello;
		hello.check = 1; /* makes room for the checksum: a value of 0 would not be packed */
		copy.hello = &hello;
	} else if (has_checksum(message)) {
		ack = *message->hello_ack;
		ack.check = 1;
		copy.hello_ack = &ack;
	}
	return pack_frame(&copy, payload, payload_size, bytes, size, e);
}

bool envelope_text_is_valid(const char *text, size_t max)
{
	return text && strnlen(text, max + 1) <= max && text_is_clean(text);
}
