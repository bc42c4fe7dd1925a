/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Packing and unpacking of messages. A packed message is read back unchanged, and the macros make the same bytes as
 * protobuf-c's functions. Refused, with an error and without leaks: unknown fields, damaged bytes, texts that are not
 * UTF-8, and messages that would take far more memory than they have bytes. Running out of memory is an error of its
 * own, not the sender's fault.
 */
#include "common/wire/envelope.h"
#include "common/wire/frame.h"
#include "common/base/mem.h"
#include "tests/support/failing_memory.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdlib.h>
#include <string.h>

static unsigned char *pack_hello(uint32_t version, size_t *size)
{
	Farm__Hello hello;
	Farm__Envelope m;
	struct error e;
	unsigned char *bytes;
	char name[] = "w1", print[] = "0123";
	farm__hello__init(&hello);
	farm__envelope__init(&m);
	hello.version = version;
	hello.role = FARM__ROLE__ROLE_WORKER;
	hello.name = name;
	hello.fingerprint = print;
	m.body_case = FARM__ENVELOPE__BODY_HELLO;
	m.hello = &hello;
	assert_int_equal(envelope_pack(&m, "tail", 4, &bytes, size, &e), 0);
	return bytes;
}

static void message_is_unpacked_as_it_was_packed(void **state)
{
	(void)state;
	size_t size;
	unsigned char *bytes = pack_hello(1, &size);
	struct envelope env;
	struct error e;
	assert_memory_equal(bytes + size - 4, "tail", 4);
	assert_int_equal(bytes[3], size - 8 - 4);
	assert_int_equal(envelope_unpack(&env, bytes + FRAME_PREFIX_SIZE, size - FRAME_PREFIX_SIZE - 4, &e), 0);
	assert_int_equal(env.message->body_case, FARM__ENVELOPE__BODY_HELLO);
	assert_string_equal(env.message->hello->name, "w1");
	assert_int_equal(env.message->hello->role, FARM__ROLE__ROLE_WORKER);
	envelope_fini(&env);
	for (size_t n = 0; n < size - FRAME_PREFIX_SIZE - 4;
	     n++) { /* cut anywhere: refused, or read as another message, but never a crash */
		if (envelope_unpack(&env, bytes + FRAME_PREFIX_SIZE, n, &e) == 0)
			envelope_fini(&env);
		assert_null(env.blocks);
	}
	mem_free(bytes);
}

static void assert_same_bytes(const Farm__Envelope *a, const Farm__Envelope *b)
{
	unsigned char *x, *y;
	size_t size, other;
	struct error e;
	assert_int_equal(envelope_pack(a, NULL, 0, &x, &size, &e), 0);
	assert_int_equal(envelope_pack(b, NULL, 0, &y, &other, &e), 0);
	assert_int_equal(size, other);
	assert_memory_equal(x, y, size);
	mem_free(x);
	mem_free(y);
}

/* A message made by the macros has the same bytes as one initialised by protobuf-c's functions: every kind without
 * members, and one kind with some members. */
static void macros_make_the_same_messages_as_protobuf(void **state)
{
	(void)state;
	Farm__Envelope m;
#define EMPTY(BODY, member)                                               \
	{                                                                 \
		__typeof__(*m.member) empty;                              \
		farm__envelope__init(&m);                                 \
		farm__##member##__init(&empty);                           \
		m.body_case = FARM__ENVELOPE__BODY_##BODY;                \
		m.member = &empty;                                        \
		assert_same_bytes(ENVELOPE(BODY, member), &m);            \
		assert_same_bytes(ENVELOPE_OF(BODY, member, &empty), &m); \
	}
	EMPTY(HELLO, hello)
	EMPTY(HELLO_ACK, hello_ack)
	EMPTY(HEARTBEAT, heartbeat)
	EMPTY(BYE, bye)
	EMPTY(FAULT, fault)
	EMPTY(BLOB_GET, blob_get)
	EMPTY(BLOB_CHUNK, blob_chunk)
	EMPTY(LEASE_REQUEST, lease_request)
	EMPTY(LEASE_GRANT, lease_grant)
	EMPTY(LEASE_RESULT, lease_result)
	EMPTY(LEASE_ACK, lease_ack)
	EMPTY(LEASE_FAILED, lease_failed)
	EMPTY(JOB_GET, job_get)
	EMPTY(JOB_INFO, job_info)
	EMPTY(JOB_END, job_end)
	EMPTY(LEASE_REVOKE, lease_revoke)
	EMPTY(SUBMIT, submit)
	EMPTY(SUBMIT_ANSWER, submit_answer)
	EMPTY(JOB_LIST, job_list)
	EMPTY(JOB_LIST_ANSWER, job_list_answer)
	EMPTY(CANCEL, cancel)
	EMPTY(DONE, done)
	EMPTY(WATCH, watch)
	EMPTY(JOB_STATUS, job_status)
	EMPTY(FETCH, fetch)
	EMPTY(FETCH_CHUNK, fetch_chunk)
	EMPTY(CONTROL, control)
	EMPTY(WORKER_LIST, worker_list)
	EMPTY(WORKER_LIST_ANSWER, worker_list_answer)
#undef EMPTY
	char text[] = "so far", output[] = "a.exr";
	Farm__FetchChunk chunk;
	farm__envelope__init(&m);
	farm__fetch_chunk__init(&chunk);
	chunk.job = 7;
	chunk.offset = 1ull << 40;
	chunk.error = text;
	chunk.output = output;
	m.body_case = FARM__ENVELOPE__BODY_FETCH_CHUNK;
	m.fetch_chunk = &chunk;
	assert_same_bytes(
		ENVELOPE(FETCH_CHUNK, fetch_chunk, .job = 7, .offset = 1ull << 40, .error = text, .output = output),
		&m);
}

/* A hello of this version with any bit flipped is never taken for that hello. */
static void changed_hello_is_never_taken_for_a_hello(void **state)
{
	(void)state;
	size_t size;
	unsigned char *bytes = pack_hello(FARM_VERSION, &size);
	struct envelope env;
	struct error e;
	size_t header = size - FRAME_PREFIX_SIZE - 4, detected_count = 0;
	assert_int_equal(envelope_unpack(&env, bytes + FRAME_PREFIX_SIZE, header, &e), 0);
	envelope_fini(&env);
	for (size_t bit = 0; bit < 8 * header; bit++) {
		bytes[FRAME_PREFIX_SIZE + bit / 8] ^= (unsigned char)(1u << bit % 8);
		int rc = envelope_unpack(&env, bytes + FRAME_PREFIX_SIZE, header, &e);
		detected_count += rc == -EILSEQ;
		if (!rc)
			assert_true(env.message->body_case != FARM__ENVELOPE__BODY_HELLO ||
				    env.message->hello->version != FARM_VERSION);
		envelope_fini(&env);
		bytes[FRAME_PREFIX_SIZE + bit / 8] ^= (unsigned char)(1u << bit % 8);
	}
	assert_true(detected_count > 4 * header); /* the other flips give another message, or none */
	mem_free(bytes);
}

static int unpack_code(const char *bytes, size_t size)
{
	struct envelope env;
	struct error e;
	int rc = envelope_unpack(&env, (const unsigned char *)bytes, size, &e);
	envelope_fini(&env);
	return rc;
}

/* The sender is not at fault. */
static void lack_of_memory_is_not_the_senders_fault(void **state)
{
	(void)state;
	struct envelope env;
	struct error e;
	mem_fail_after(0);
	int rc = envelope_unpack(&env, (const unsigned char *)"\x1a\x00", 2, &e);
	mem_fail_after(-1);
	assert_int_equal(rc, -ENOMEM);
	assert_null(env.blocks);
}

static void unknown_fields_are_refused(void **state)
{
	(void)state;
	assert_int_equal(unpack_code("", 0), -EBADMSG);
	assert_int_equal(unpack_code("\x1a\x00", 2), 0);		    /* a heartbeat */
	assert_int_equal(unpack_code("\x1a\x02\x78\x01", 4), -EBADMSG);	    /* with an unknown field 15 inside */
	assert_int_equal(unpack_code("\x1a\x00\xf8\x3f\x01", 5), -EBADMSG); /* with an unknown field beside the
									     * heartbeat */
	/* Submit{files{unknown}}: deep inside a repeated field (Submit is field 40, files is field 8) */
	assert_int_equal(unpack_code("\xc2\x02\x02\x42\x00", 5), 0);
	assert_int_equal(unpack_code("\xc2\x02\x04\x42\x02\x78\x01", 7), -EBADMSG);
}

/* A megabyte of empty strings would take some 60 MB: refused above 16 bytes of memory per byte of message. */
static void message_that_expands_too_far_is_refused(void **state)
{
	(void)state;
	enum { INNER = 1 << 20 };
	char *bytes = calloc(1, INNER + 16);
	assert_non_null(bytes);
	char head[] = {(char)0xc2, 0x02, (char)0x80, (char)0x80, 0x40}; /* Submit of 2^20 bytes */
	memcpy(bytes, head, sizeof head);
	for (size_t i = 0; i < INNER; i += 2)
		bytes[sizeof head + i] = 0x1a; /* an empty Define */
	assert_int_equal(unpack_code(bytes, sizeof head + INNER), -EBADMSG);
	free(bytes);
}

/* Thousands of small messages may wait, so each is counted by the memory that it takes. */
static void memory_of_a_message_is_counted(void **state)
{
	(void)state;
	enum { NAME = 100000 };
	struct envelope small, large;
	struct error e;
	unsigned char *bytes;
	const unsigned char *payload;
	char *name = calloc(1, NAME + 1);
	size_t size, payload_size;
	assert_non_null(name);
	memset(name, 'n', NAME);
	assert_int_equal(envelope_unpack(&small, (const unsigned char *)"\x1a\x00", 2, &e), 0);
	assert_in_range(small.bytes, small.used, 1000);
	assert_int_equal(envelope_pack(ENVELOPE(SUBMIT, submit, .name = name), NULL, 0, &bytes, &size, &e), 0);
	assert_int_equal(
		envelope_unpack_frame(&large, FARM__ENVELOPE__BODY_SUBMIT, bytes, size, &payload, &payload_size, &e),
		0);
	assert_in_range(large.bytes, NAME + 1, 2 * NAME);
	envelope_fini(&small);
	envelope_fini(&large);
	mem_free(bytes);
	free(name);
}

static void malformed_text_is_refused(void **state)
{
	(void)state;
	assert_true(envelope_text_is_valid("", 0));
	assert_true(envelope_text_is_valid("gr\xc3\xbcn \xf0\x9f\x98\x80", 20));
	assert_false(envelope_text_is_valid("abc", 2));
	assert_false(envelope_text_is_valid("a\nb", 9));
	assert_false(envelope_text_is_valid("a\xc2\x9b"
					    "b",
					    9));		 /* a terminal control character */
	assert_false(envelope_text_is_valid("\xc0\xaf", 9));	 /* overlong */
	assert_false(envelope_text_is_valid("\xed\xa0\x80", 9)); /* a surrogate */
	assert_false(envelope_text_is_valid("\xe2\x82", 9));	 /* truncated */
	assert_false(envelope_text_is_valid("\xff", 9));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(message_is_unpacked_as_it_was_packed),
		cmocka_unit_test(macros_make_the_same_messages_as_protobuf),
		cmocka_unit_test(changed_hello_is_never_taken_for_a_hello),
		cmocka_unit_test(lack_of_memory_is_not_the_senders_fault),
		cmocka_unit_test(unknown_fields_are_refused),
		cmocka_unit_test(message_that_expands_too_far_is_refused),
		cmocka_unit_test(memory_of_a_message_is_counted),
		cmocka_unit_test(malformed_text_is_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
