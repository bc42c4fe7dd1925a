/* SPDX-License-Identifier: Apache-2.0 */
/* Streams over an open TLS connection: bytes arrive unchanged, and a stream that is cut, changed, replayed, or not TLS
 * at all ends the connection. */
#include "tests/support/tls_pair.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include <malloc.h>
#include <openssl/crypto.h>
#include <stdlib.h>

static size_t held; /* bytes that OpenSSL has allocated */

static void *count_malloc(size_t size, const char *file, int line)
{
	(void)file, (void)line;
	void *p = malloc(size);
	held += p ? malloc_usable_size(p) : 0;
	return p;
}

static void count_free(void *p, const char *file, int line)
{
	(void)file, (void)line;
	held -= p ? malloc_usable_size(p) : 0;
	free(p);
}

static void *count_realloc(void *p, size_t size, const char *file, int line)
{
	(void)file, (void)line;
	size_t before = p ? malloc_usable_size(p) : 0;
	void *q = realloc(p, size);
	if (q || !size)
		held += (q ? malloc_usable_size(q) : 0) - before;
	return q;
}

static void write_bytes(struct pair_end *x, size_t size)
{
	static unsigned char bytes[1 << 16];
	for (size_t i = 0; i < size; i++)
		bytes[i] = (unsigned char)(i * 7);
	assert_int_equal(tls_link_write(x->link, bytes, size, &x->e), 0);
}

static void what_is_said_arrives(void **state)
{
	(void)state;
	pair_shake(pair_at(pair_ours, "node"), pair_at(pair_ours, "farm"), 100000);
	write_bytes(&pair_caller, 60000);
	write_bytes(&pair_listener, 1);
	pair_carry(&pair_caller, &pair_listener, 999);
	pair_carry(&pair_listener, &pair_caller, 1);
	assert_int_equal(pair_listener.got_size, 60000);
	assert_int_equal(pair_caller.got_size, 1);
	for (size_t i = 0; i < 60000; i++)
		assert_int_equal(pair_listener.got[i], (unsigned char)(i * 7));
	pair_hang_up();
}

/* A worker sends much at once, and then waits. */
static void bursts_leave_no_memory(void **state)
{
	(void)state;
	pair_shake(pair_at(pair_ours, "node"), pair_at(pair_ours, "farm"), 100000);
	write_bytes(&pair_caller, 100);
	pair_carry(&pair_caller, &pair_listener, 100000);
	size_t before = held;
	write_bytes(&pair_caller, 60000);
	assert_true(held > before + 60000);
	pair_carry(&pair_caller, &pair_listener, 100000);
	print_message("%zd bytes left of 60,000 sent\n", (ssize_t)(held - before));
	assert_true(held < before + 8192);
	write_bytes(&pair_listener, 60000);
	pair_carry(&pair_listener, &pair_caller, 20000); /* stops in the middle of records */
	assert_true(held < before + 8192);
	assert_int_equal(pair_listener.got_size, 60100);
	assert_int_equal(pair_caller.got_size, 60000);
	pair_hang_up();
}

/* No byte of an incomplete record is delivered. */
static void half_a_record_says_nothing(void **state)
{
	(void)state;
	const unsigned char *bytes;
	pair_shake(pair_at(pair_ours, "node"), pair_at(pair_ours, "farm"), 100000);
	write_bytes(&pair_caller, 10000);
	size_t size = tls_link_output(pair_caller.link, &bytes);
	assert_int_equal(tls_link_take(pair_listener.link, bytes, size - 1, &pair_listener.e), 0);
	pair_read(&pair_listener);
	assert_int_equal(pair_listener.rc, 0);
	assert_int_equal(pair_listener.got_size, 0);
	pair_hang_up();
}

static void a_changed_bit_ends_it(void **state)
{
	(void)state;
	unsigned char copied[2048];
	for (size_t bit = 0; bit < 8; bit++) {
		const unsigned char *bytes;
		pair_shake(pair_at(pair_ours, "node"), pair_at(pair_ours, "farm"), 100000);
		write_bytes(&pair_caller, 1000);
		size_t size = tls_link_output(pair_caller.link, &bytes);
		assert_true(size > 1000 && size < sizeof copied);
		memcpy(copied, bytes, size);
		copied[5 + 100 * bit] ^= (unsigned char)(1 << bit);
		assert_int_equal(tls_link_take(pair_listener.link, copied, size, &pair_listener.e), 0);
		pair_read(&pair_listener);
		assert_int_equal(pair_listener.rc, -EPROTO);
		assert_int_equal(pair_listener.got_size, 0);
		pair_hang_up();
	}
}

/* A replayed record does not decrypt, because TLS numbers its records. */
static void a_replayed_record_ends_it(void **state)
{
	(void)state;
	unsigned char copied[2048];
	const unsigned char *bytes;
	pair_shake(pair_at(pair_ours, "node"), pair_at(pair_ours, "farm"), 100000);
	write_bytes(&pair_caller, 1000);
	size_t size = tls_link_output(pair_caller.link, &bytes);
	assert_true(size < sizeof copied);
	memcpy(copied, bytes, size);
	for (int i = 0; i < 2 && !pair_listener.rc; i++) {
		assert_int_equal(tls_link_take(pair_listener.link, copied, size, &pair_listener.e), 0);
		pair_read(&pair_listener);
	}
	assert_int_equal(pair_listener.got_size, 1000);
	assert_int_equal(pair_listener.rc, -EPROTO);
	pair_hang_up();
}

static void nonsense_ends_it(void **state)
{
	(void)state;
	uint32_t random = 12345;
	for (int round = 0; round < 200; round++) {
		unsigned char bytes[512];
		for (size_t i = 0; i < sizeof bytes; i++)
			bytes[i] = (unsigned char)((random = random * 1664525 + 1013904223) >> 24);
		bytes[0] = 22;	 /* otherwise it would be recognised as plaintext at once */
		if (round % 2) { /* a record, well-formed on the outside */
			bytes[1] = 3;
			bytes[2] = 1;
			bytes[3] = 1;
			bytes[4] = 0xfb;
		}
		pair_open(&pair_listener, pair_at(pair_ours, "farm"), true);
		pair_listener.rc = tls_link_take(pair_listener.link, bytes, sizeof bytes, &pair_listener.e);
		pair_read(&pair_listener);
		assert_true(pair_listener.rc == -EPROTO || pair_listener.rc == -EACCES ||
			    (!pair_listener.rc && !pair_listener.got_size));
		assert_false(tls_link_is_open(pair_listener.link));
		pair_close(&pair_listener);
	}
}

static void a_handshake_does_not_grow(void **state)
{
	(void)state;
	unsigned char header[5] = {22, 3, 1, 0x40, 0}, zeroes[1024] = {1, 0xff, 0xff, 0xff};
	size_t total = 0;
	pair_open(&pair_listener, pair_at(pair_ours, "farm"), true);
	while (!pair_listener.rc && total < 1 << 20) {
		pair_listener.rc = tls_link_take(pair_listener.link, total % (1 << 14) ? zeroes : header,
						 total % (1 << 14) ? 1024 : 5, &pair_listener.e);
		total += 1024;
		pair_read(&pair_listener);
	}
	assert_true(pair_listener.rc < 0 && total <= 1 << 17);
	pair_close(&pair_listener);
}

static void plaintext_is_known(void **state)
{
	(void)state;
	const unsigned char *bytes;
	pair_open(&pair_listener, pair_at(pair_ours, "farm"), true);
	assert_int_equal(tls_link_take(pair_listener.link, "\0\0\0\x10", 4, &pair_listener.e), -EACCES);
	assert_non_null(strstr(pair_listener.e.text, "does not use TLS"));
	assert_int_equal(tls_link_output(pair_listener.link, &bytes), sizeof tls_none_here);
	assert_true(tls_is_first_byte(*bytes) && !tls_is_first_byte(0));
	pair_close(&pair_listener);
	/* The same bytes tell a caller with TLS that the peer has none. */
	pair_open(&pair_caller, pair_at(pair_ours, "node"), false);
	pair_read(&pair_caller);
	assert_int_equal(tls_link_take(pair_caller.link, tls_none_here, sizeof tls_none_here, &pair_caller.e), 0);
	pair_read(&pair_caller);
	assert_int_equal(pair_caller.rc, -EACCES);
	assert_non_null(strstr(pair_caller.e.text, "does not speak TLS"));
	pair_close(&pair_caller);
}

int main(void)
{
	if (CRYPTO_set_mem_functions(count_malloc, count_realloc, count_free) != 1)
		return 1;
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_said_arrives),	      cmocka_unit_test(bursts_leave_no_memory),
		cmocka_unit_test(half_a_record_says_nothing), cmocka_unit_test(a_changed_bit_ends_it),
		cmocka_unit_test(a_replayed_record_ends_it),  cmocka_unit_test(nonsense_ends_it),
		cmocka_unit_test(a_handshake_does_not_grow),  cmocka_unit_test(plaintext_is_known),
	};
	return cmocka_run_group_tests(tests, pair_make_folders, pair_remove_folders);
}
