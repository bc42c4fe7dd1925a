/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scripts of messages (messages.h) and their mutation by protobuf-c's descriptors.
 *
 * script_mutate parses the input into steps, adds, repeats, drops, swaps or changes some, and writes them again. A
 * changed step is parsed as an Envelope, one field at a random depth gets another value (a boundary, a neighbour, bytes
 * from libFuzzer), and the message is packed again. A step that does not parse is mutated by libFuzzer as bytes. All
 * memory comes from one buffer that each mutation starts anew, so nothing needs to be freed.
 */
#include "tests/fuzz/messages.h"

#include <stdbool.h>
#include <string.h>

/* ---- memory of one mutation ---- */

enum { SPACE_BYTES = 1 << 22, STRING_BYTES_MAX = 256, STEP_PREFIX = 5, PART_BYTES_MAX = 0xffff };

static struct {
	_Alignas(16) uint8_t bytes[SPACE_BYTES];
	size_t used;
	uint64_t random;
} mutator;

static void *allocate(void *user, size_t size)
{
	(void)user;
	size_t need = (size + 15) & ~(size_t)15;
	if (need < size || need > SPACE_BYTES - mutator.used)
		return NULL;
	void *p = mutator.bytes + mutator.used;
	mutator.used += need;
	return memset(p, 0, need);
}

static void free_nothing(void *user, void *p)
{
	(void)user;
	(void)p;
}

static ProtobufCAllocator allocator = {allocate, free_nothing, NULL};

static void begin_mutation(unsigned seed)
{
	mutator.used = 0;
	mutator.random = seed * UINT64_C(0x9E3779B97F4A7C15) + 1;
}

static uint64_t random_below(uint64_t below)
{
	mutator.random ^= mutator.random << 13;
	mutator.random ^= mutator.random >> 7;
	mutator.random ^= mutator.random << 17;
	return (mutator.random >> 8) % below;
}

/* ---- fields ---- */

static uint64_t mutate_integer(uint64_t original)
{
	switch (random_below(8)) {
	case 0:
		return random_below(5);
	case 1:
		return original + 1;
	case 2:
		return original - 1;
	case 3:
		return original ^ UINT64_C(1) << random_below(64);
	case 4:
		return UINT64_MAX >> random_below(64);
	case 5:
		return UINT64_C(1) << random_below(64);
	case 6:
		return original * 2;
	default:
		return random_below(300);
	}
}

static double mutate_double(double original)
{
	static const double values[] = {0,
					-0.0,
					1,
					-1,
					0.5,
					1e-320,
					1e-9,
					1e9,
					1e18,
					1e308,
					-1e308,
					(double)__builtin_inf(),
					-(double)__builtin_inf(),
					(double)__builtin_nan("")};
	return random_below(4)	 ? values[random_below(sizeof values / sizeof *values)]
	       : random_below(2) ? original * 2
				 : original + 1;
}

static char *mutate_text(const char *original)
{
	static const char *const texts[] = {"",
					    "s.xml",
					    "../s.xml",
					    "/etc/passwd",
					    "a/b",
					    "a//b",
					    ".",
					    "path",
					    "bdpt",
					    "pssmlt",
					    "hslt",
					    "p1",
					    "p2",
					    "independent=0.1,hslt=0.9",
					    "hslt@b2c0",
					    "tolerance=0.1",
					    "-dispersion,+aperture",
					    "all",
					    "\xc3\xa9",
					    "\xff",
					    "a\nb",
					    "%s%n"};
	char *p = allocate(NULL, STRING_BYTES_MAX);
	if (!p)
		return NULL;
	if (random_below(2)) {
		strcpy(p, texts[random_below(sizeof texts / sizeof *texts)]);
		return p;
	}
	size_t length = original ? strlen(original) : 0;
	length = length < STRING_BYTES_MAX - 1 ? length : STRING_BYTES_MAX - 1;
	if (original)
		memcpy(p, original, length);
	length = LLVMFuzzerMutate((uint8_t *)p, length, STRING_BYTES_MAX - 1);
	p[length] = 0;
	return p;
}

static ProtobufCBinaryData mutate_bytes(ProtobufCBinaryData original)
{
	ProtobufCBinaryData b = {0, allocate(NULL, STRING_BYTES_MAX)};
	if (!b.data)
		return b;
	b.len = original.len < STRING_BYTES_MAX ? original.len : STRING_BYTES_MAX;
	if (b.len)
		memcpy(b.data, original.data, b.len);
	b.len = LLVMFuzzerMutate(b.data, b.len, STRING_BYTES_MAX);
	return b;
}

static size_t type_size(ProtobufCType t)
{
	switch (t) {
	case PROTOBUF_C_TYPE_INT32:
	case PROTOBUF_C_TYPE_SINT32:
	case PROTOBUF_C_TYPE_SFIXED32:
	case PROTOBUF_C_TYPE_UINT32:
	case PROTOBUF_C_TYPE_FIXED32:
	case PROTOBUF_C_TYPE_ENUM:
	case PROTOBUF_C_TYPE_FLOAT:
		return 4;
	case PROTOBUF_C_TYPE_BOOL:
		return sizeof(protobuf_c_boolean);
	case PROTOBUF_C_TYPE_BYTES:
		return sizeof(ProtobufCBinaryData);
	default:
		return 8;
	}
}

static void change_message(ProtobufCMessage *m);

static ProtobufCMessage *new_message(const ProtobufCMessageDescriptor *d)
{
	ProtobufCMessage *m = allocate(NULL, d->sizeof_message);
	if (m)
		d->message_init(m);
	return m;
}

/* Changes one value of a field in place. */
static void change_value(const ProtobufCFieldDescriptor *f, void *at)
{
	uint64_t n = 0;
	double d;
	switch (f->type) {
	case PROTOBUF_C_TYPE_STRING:
		*(char **)at = mutate_text(*(char **)at);
		return;
	case PROTOBUF_C_TYPE_BYTES:
		*(ProtobufCBinaryData *)at = mutate_bytes(*(ProtobufCBinaryData *)at);
		return;
	case PROTOBUF_C_TYPE_MESSAGE:
		if (!*(ProtobufCMessage **)at)
			*(ProtobufCMessage **)at = new_message(f->descriptor);
		if (*(ProtobufCMessage **)at)
			change_message(*(ProtobufCMessage **)at);
		return;
	case PROTOBUF_C_TYPE_DOUBLE:
		memcpy(&d, at, sizeof d);
		d = mutate_double(d);
		memcpy(at, &d, sizeof d);
		return;
	default:
		memcpy(&n, at, type_size(f->type));
		n = f->type == PROTOBUF_C_TYPE_BOOL ? !n : mutate_integer(n);
		memcpy(at, &n, type_size(f->type));
	}
}

static void change_list(const ProtobufCFieldDescriptor *f, void *at, size_t *count)
{
	size_t element_size = type_size(f->type);
	uint8_t *list = *(uint8_t **)at;
	if (*count && random_below(2)) {
		change_value(f, list + random_below(*count) * element_size);
	} else if (*count && random_below(2)) {
		size_t removed = random_below(*count);
		memmove(list + removed * element_size, list + (removed + 1) * element_size,
			(*count - removed - 1) * element_size);
		--*count;
	} else {
		uint8_t *grown = allocate(NULL, (*count + 1) * element_size);
		if (!grown)
			return;
		if (*count)
			memcpy(grown, list, *count * element_size);
		if (*count && random_below(2))
			memcpy(grown + *count * element_size, list + random_below(*count) * element_size, element_size);
		else
			change_value(f, grown + *count * element_size);
		if (f->type >= PROTOBUF_C_TYPE_STRING && f->type != PROTOBUF_C_TYPE_BYTES &&
		    !*(void **)(void *)(grown + *count * element_size))
			return;
		*(uint8_t **)at = grown;
		++*count;
	}
}

/* Chooses a field. Of a message's alternatives, the one that is set, or now and then another. */
static const ProtobufCFieldDescriptor *choose_field(ProtobufCMessage *m)
{
	const ProtobufCMessageDescriptor *d = m->descriptor;
	const ProtobufCFieldDescriptor *f = &d->fields[random_below(d->n_fields)];
	if (!(f->flags & PROTOBUF_C_FIELD_FLAG_ONEOF))
		return f;
	uint32_t *chosen = (uint32_t *)(void *)((uint8_t *)m + f->quantifier_offset);
	const ProtobufCFieldDescriptor *current = protobuf_c_message_descriptor_get_field(d, *chosen);
	if (current && random_below(16))
		return current;
	*chosen = f->id;
	*(void **)(void *)((uint8_t *)m + f->offset) = NULL;
	return f;
}

static void change_message(ProtobufCMessage *m)
{
	if (!m->descriptor->n_fields)
		return;
	const ProtobufCFieldDescriptor *f = choose_field(m);
	uint8_t *base = (uint8_t *)m, *at = base + f->offset;
	if (f->label == PROTOBUF_C_LABEL_REPEATED)
		change_list(f, at, (size_t *)(void *)(base + f->quantifier_offset));
	else if (f->type == PROTOBUF_C_TYPE_MESSAGE && !(f->flags & PROTOBUF_C_FIELD_FLAG_ONEOF) &&
		 random_below(16) == 0)
		*(void **)(void *)at = NULL;
	else
		change_value(f, at);
}

/* Returns NULL if the message has become too large. */
static const uint8_t *change_packed(const uint8_t *bytes, size_t *size)
{
	ProtobufCMessage *m = protobuf_c_message_unpack(&farm__envelope__descriptor, &allocator, *size, bytes);
	if (!m)
		m = new_message(&farm__envelope__descriptor);
	for (uint64_t i = 0, n = 1 + random_below(4); i < n && m; i++)
		change_message(m);
	size_t packed = m ? protobuf_c_message_get_packed_size(m) : 0;
	uint8_t *out = packed ? allocate(NULL, packed) : NULL;
	if (out)
		*size = protobuf_c_message_pack(m, out);
	return out;
}

size_t message_mutate(uint8_t *bytes, size_t size, size_t max_size, unsigned seed)
{
	begin_mutation(seed);
	size_t changed = size;
	const uint8_t *out = random_below(8) ? change_packed(bytes, &changed) : NULL;
	if (!out || changed > max_size)
		return LLVMFuzzerMutate(bytes, size, max_size);
	memcpy(bytes, out, changed);
	return changed;
}

/* ---- scripts ---- */

size_t script_read(const uint8_t *bytes, size_t size, struct step steps[SCRIPT_STEPS])
{
	size_t count = 0;
	const uint8_t *p = bytes, *end = bytes + size;
	for (; count < SCRIPT_STEPS && end - p > STEP_PREFIX; count++) {
		size_t header = (size_t)p[1] << 8 | p[2], payload = (size_t)p[3] << 8 | p[4];
		struct step *s = &steps[count];
		s->speaker = p[0];
		p += STEP_PREFIX;
		s->header = p;
		s->header_size = header < (size_t)(end - p) ? header : (size_t)(end - p);
		p += s->header_size;
		s->payload = p;
		s->payload_size = payload < (size_t)(end - p) ? payload : (size_t)(end - p);
		p += s->payload_size;
	}
	return count;
}

size_t script_write(const struct step *steps, size_t count, uint8_t *bytes, size_t max_size)
{
	uint8_t *p = bytes;
	for (size_t i = 0; i < count; i++) {
		const struct step *s = &steps[i];
		if (s->header_size > PART_BYTES_MAX || s->payload_size > PART_BYTES_MAX ||
		    STEP_PREFIX + s->header_size + s->payload_size > max_size - (size_t)(p - bytes))
			return 0;
		*p++ = s->speaker;
		*p++ = (uint8_t)(s->header_size >> 8);
		*p++ = (uint8_t)s->header_size;
		*p++ = (uint8_t)(s->payload_size >> 8);
		*p++ = (uint8_t)s->payload_size;
		if (s->header_size)
			memmove(p, s->header, s->header_size);
		p += s->header_size;
		if (s->payload_size)
			memmove(p, s->payload, s->payload_size);
		p += s->payload_size;
	}
	return (size_t)(p - bytes);
}

size_t script_add(uint8_t *bytes, size_t size, size_t max_size, uint8_t speaker, const Farm__Envelope *m,
		  const void *payload, size_t payload_size)
{
	static uint8_t header[PART_BYTES_MAX];
	struct step s = {.speaker = speaker, .header = header, .payload = payload, .payload_size = payload_size};
	s.header_size = farm__envelope__get_packed_size(m);
	if (s.header_size > sizeof header)
		return size;
	farm__envelope__pack(m, header);
	return size + script_write(&s, 1, bytes + size, max_size - size);
}

static void change_payload(struct step *s)
{
	size_t max_size = s->payload_size + 64 < PART_BYTES_MAX ? s->payload_size + 64 : PART_BYTES_MAX;
	uint8_t *p = allocate(NULL, max_size);
	if (!p)
		return;
	if (s->payload_size)
		memcpy(p, s->payload, s->payload_size);
	s->payload_size = LLVMFuzzerMutate(p, s->payload_size, max_size);
	s->payload = p;
}

static void change_step(struct step *s, unsigned speakers)
{
	size_t size = s->header_size;
	const uint8_t *changed;
	switch (random_below(10)) {
	case 0:
		s->speaker = (uint8_t)random_below(speakers);
		break;
	case 1:
	case 2:
		change_payload(s);
		break;
	default:
		changed = change_packed(s->header, &size);
		if (changed) {
			s->header = changed;
			s->header_size = size;
		}
	}
}

static size_t change_script(struct step *steps, size_t count, unsigned speakers)
{
	size_t at = count ? random_below(count) : 0;
	switch (count ? random_below(12) : 0) {
	case 0: /* add a step */
		if (count == SCRIPT_STEPS)
			return count;
		memmove(steps + at + 1, steps + at, (count - at) * sizeof *steps);
		steps[at] = (struct step){.speaker = (uint8_t)random_below(speakers), .header = mutator.bytes};
		change_step(&steps[at], speakers);
		return count + 1;
	case 1: /* repeat a step */
		if (count < SCRIPT_STEPS)
			steps[count++] = steps[at];
		return count;
	case 2: /* drop a step */
		memmove(steps + at, steps + at + 1, (count - at - 1) * sizeof *steps);
		return count - 1;
	case 3: { /* swap steps */
		size_t other = random_below(count);
		struct step s = steps[at];
		steps[at] = steps[other];
		steps[other] = s;
		return count;
	}
	default:
		change_step(&steps[at], speakers);
		return count;
	}
}

size_t script_mutate(uint8_t *bytes, size_t size, size_t max_size, unsigned seed, unsigned speakers)
{
	struct step steps[SCRIPT_STEPS];
	begin_mutation(seed);
	uint8_t *copy = allocate(NULL, size + 1); /* the input may overwrite the bytes that the steps point at */
	if (!copy || random_below(32) == 0)
		return LLVMFuzzerMutate(bytes, size, max_size);
	if (size)
		memcpy(copy, bytes, size);
	size_t count = script_read(copy, size, steps);
	for (uint64_t i = 0, n = 1 + random_below(3); i < n; i++)
		count = change_script(steps, count, speakers);
	size_t changed = script_write(steps, count, bytes, max_size);
	return changed ? changed : LLVMFuzzerMutate(bytes, size, max_size);
}
