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

static size_t allocated_bytes; /* bytes that OpenSSL has allocated */

static void *count_malloc(size_t size, const char *file, int line)
{
	(void)file, (void)line;
	void *p = malloc(size);
	allocated_bytes += p ? malloc_usable_size(p) : 0;
	return p;
}

static void count_free(void *p, const char *file, int line)
{
	(void)file, (void)line;
	allocated_bytes -= p ? malloc_usable_size(p) : 0;
	free(p);
}

static void *count_realloc(void *p, size_t size, const char *file, int line)
{
	(void)file, (void)line;
	size_t before = p ? malloc_usable_size(p) : 0;
	void *q = realloc(p, size);
	if (q || !size)
		allocated_bytes += (q ? malloc_usable_size(q) : 0) - before;
	return q;
}

static void write_bytes(struct tls_pair_end *x, size_t size)
{
	static unsigned char bytes[1 << 16];
	for (size_t i = 0; i < size; i++)
		bytes[i] = (unsigned char)(i * 7);
	assert_int_equal(tls_link_write(x->link, bytes, size, &x->e), 0);
}

static void written_bytes_arrive_unchanged(void **state)
{
	(void)state;
	tls_pair_handshake(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_ours, "farm"), 100000);
	write_bytes(&tls_pair_caller, 60000);
	write_bytes(&tls_pair_listener, 1);
	tls_pair_carry(&tls_pair_caller, &tls_pair_listener, 999);
	tls_pair_carry(&tls_pair_listener, &tls_pair_caller, 1);
	assert_int_equal(tls_pair_listener.received_size, 60000);
	assert_int_equal(tls_pair_caller.received_size, 1);
	for (size_t i = 0; i < 60000; i++)
		assert_int_equal(tls_pair_listener.received[i], (unsigned char)(i * 7));
	tls_pair_close();
}

/* A worker sends much at once, and then waits. */
static void burst_leaves_no_memory_allocated(void **state)
{
	(void)state;
	tls_pair_handshake(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_ours, "farm"), 100000);
	write_bytes(&tls_pair_caller, 100);
	tls_pair_carry(&tls_pair_caller, &tls_pair_listener, 100000);
	size_t before = allocated_bytes;
	write_bytes(&tls_pair_caller, 60000);
	assert_true(allocated_bytes > before + 60000);
	tls_pair_carry(&tls_pair_caller, &tls_pair_listener, 100000);
	print_message("%zd bytes left of 60,000 sent\n", (ssize_t)(allocated_bytes - before));
	assert_true(allocated_bytes < before + 8192);
	write_bytes(&tls_pair_listener, 60000);
	tls_pair_carry(&tls_pair_listener, &tls_pair_caller, 20000); /* stops in the middle of records */
	assert_true(allocated_bytes < before + 8192);
	assert_int_equal(tls_pair_listener.received_size, 60100);
	assert_int_equal(tls_pair_caller.received_size, 60000);
	tls_pair_close();
}

/* No byte of an incomplete record is delivered. */
static void incomplete_record_delivers_nothing(void **state)
{
	(void)state;
	const unsigned char *bytes;
	tls_pair_handshake(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_ours, "farm"), 100000);
	write_bytes(&tls_pair_caller, 10000);
	size_t size = tls_link_output(tls_pair_caller.link, &bytes);
	assert_int_equal(tls_link_receive(tls_pair_listener.link, bytes, size - 1, &tls_pair_listener.e), 0);
	tls_pair_end_read(&tls_pair_listener);
	assert_int_equal(tls_pair_listener.rc, 0);
	assert_int_equal(tls_pair_listener.received_size, 0);
	tls_pair_close();
}

static void changed_bit_ends_the_connection(void **state)
{
	(void)state;
	unsigned char copied[2048];
	for (size_t bit = 0; bit < 8; bit++) {
		const unsigned char *bytes;
		tls_pair_handshake(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_ours, "farm"), 100000);
		write_bytes(&tls_pair_caller, 1000);
		size_t size = tls_link_output(tls_pair_caller.link, &bytes);
		assert_true(size > 1000 && size < sizeof copied);
		memcpy(copied, bytes, size);
		copied[5 + 100 * bit] ^= (unsigned char)(1 << bit);
		assert_int_equal(tls_link_receive(tls_pair_listener.link, copied, size, &tls_pair_listener.e), 0);
		tls_pair_end_read(&tls_pair_listener);
		assert_int_equal(tls_pair_listener.rc, -EPROTO);
		assert_int_equal(tls_pair_listener.received_size, 0);
		tls_pair_close();
	}
}

/* A replayed record does not decrypt, because TLS numbers its records. */
static void replayed_record_ends_the_connection(void **state)
{
	(void)state;
	unsigned char copied[2048];
	const unsigned char *bytes;
	tls_pair_handshake(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_ours, "farm"), 100000);
	write_bytes(&tls_pair_caller, 1000);
	size_t size = tls_link_output(tls_pair_caller.link, &bytes);
	assert_true(size < sizeof copied);
	memcpy(copied, bytes, size);
	for (int i = 0; i < 2 && !tls_pair_listener.rc; i++) {
		assert_int_equal(tls_link_receive(tls_pair_listener.link, copied, size, &tls_pair_listener.e), 0);
		tls_pair_end_read(&tls_pair_listener);
	}
	assert_int_equal(tls_pair_listener.received_size, 1000);
	assert_int_equal(tls_pair_listener.rc, -EPROTO);
	tls_pair_close();
}

static void random_bytes_open_no_connection(void **state)
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
		tls_pair_end_open(&tls_pair_listener, tls_pair_path(tls_pair_ours, "farm"), true);
		tls_pair_listener.rc =
			tls_link_receive(tls_pair_listener.link, bytes, sizeof bytes, &tls_pair_listener.e);
		tls_pair_end_read(&tls_pair_listener);
		assert_true(tls_pair_listener.rc == -EPROTO || tls_pair_listener.rc == -EACCES ||
			    (!tls_pair_listener.rc && !tls_pair_listener.received_size));
		assert_false(tls_link_is_open(tls_pair_listener.link));
		tls_pair_end_close(&tls_pair_listener);
	}
}

static void memory_of_a_handshake_is_bounded(void **state)
{
	(void)state;
	unsigned char header[5] = {22, 3, 1, 0x40, 0}, zeroes[1024] = {1, 0xff, 0xff, 0xff};
	size_t total = 0;
	tls_pair_end_open(&tls_pair_listener, tls_pair_path(tls_pair_ours, "farm"), true);
	while (!tls_pair_listener.rc && total < 1 << 20) {
		tls_pair_listener.rc = tls_link_receive(tls_pair_listener.link, total % (1 << 14) ? zeroes : header,
							total % (1 << 14) ? 1024 : 5, &tls_pair_listener.e);
		total += 1024;
		tls_pair_end_read(&tls_pair_listener);
	}
	assert_true(tls_pair_listener.rc < 0 && total <= 1 << 17);
	tls_pair_end_close(&tls_pair_listener);
}

static void plaintext_peer_is_recognised(void **state)
{
	(void)state;
	const unsigned char *bytes;
	tls_pair_end_open(&tls_pair_listener, tls_pair_path(tls_pair_ours, "farm"), true);
	assert_int_equal(tls_link_receive(tls_pair_listener.link, "\0\0\0\x10", 4, &tls_pair_listener.e), -EACCES);
	assert_non_null(strstr(tls_pair_listener.e.text, "does not use TLS"));
	assert_int_equal(tls_link_output(tls_pair_listener.link, &bytes), sizeof tls_mismatch_alert);
	assert_true(tls_is_first_byte(*bytes) && !tls_is_first_byte(0));
	tls_pair_end_close(&tls_pair_listener);
	/* The same bytes tell a caller with TLS that the peer has none. */
	tls_pair_end_open(&tls_pair_caller, tls_pair_path(tls_pair_ours, "node"), false);
	tls_pair_end_read(&tls_pair_caller);
	assert_int_equal(tls_link_receive(tls_pair_caller.link, tls_mismatch_alert, sizeof tls_mismatch_alert,
					  &tls_pair_caller.e),
			 0);
	tls_pair_end_read(&tls_pair_caller);
	assert_int_equal(tls_pair_caller.rc, -EACCES);
	assert_non_null(strstr(tls_pair_caller.e.text, "does not speak TLS"));
	tls_pair_end_close(&tls_pair_caller);
}

int main(void)
{
	if (CRYPTO_set_mem_functions(count_malloc, count_realloc, count_free) != 1)
		return 1;
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(written_bytes_arrive_unchanged),
		cmocka_unit_test(burst_leaves_no_memory_allocated),
		cmocka_unit_test(incomplete_record_delivers_nothing),
		cmocka_unit_test(changed_bit_ends_the_connection),
		cmocka_unit_test(replayed_record_ends_the_connection),
		cmocka_unit_test(random_bytes_open_no_connection),
		cmocka_unit_test(memory_of_a_handshake_is_bounded),
		cmocka_unit_test(plaintext_peer_is_recognised),
	};
	return cmocka_run_group_tests(tests, tls_pair_set_up, tls_pair_tear_down);
}
