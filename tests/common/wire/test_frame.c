/* SPDX-License-Identifier: Apache-2.0 */
/* Frames are read back whole however their bytes are cut, and lengths beyond the limits are refused. */
#include "common/wire/frame.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <string.h>

/* The second frame has checksums that were computed independently (bit by bit, in Python). */
static const unsigned char two_frames[] = {0,	 0,    0,    2,	  0,  0, 0, 3, 'h',  'i',  'a',	 'b',  'c', /* */
					   0,	 0,    0,    1,	  0,  0, 0, 1, 0xda, 0x06, 0xef, 0x2c, 0x9e,
					   0x67, 0x09, 0x20, 'x', 'y'};
enum { FIRST_FRAME_SIZE = 13 };

static void any_cut_gives_the_same_frames(void **state)
{
	(void)state;
	for (size_t piece = 1; piece <= sizeof two_frames; piece++) {
		struct frame_reader r;
		struct error e;
		int frames = 0;
		frame_reader_init(&r, (struct frame_limits){16, 16});
		for (size_t offset = 0; offset < sizeof two_frames;) {
			size_t n = piece < sizeof two_frames - offset ? piece : sizeof two_frames - offset, used;
			int rc = frame_reader_feed(&r, two_frames + offset, n, &used, &e);
			assert_true(rc >= 0 && used <= n);
			offset += used;
			if (rc == 0)
				continue;
			assert_false(frame_reader_is_midway(&r));
			if (frames++ == 0) {
				assert_int_equal(r.header.size, 2);
				assert_memory_equal(r.header.bytes, "hi", 2);
				assert_int_equal(r.payload.size, 3);
				assert_memory_equal(r.payload.bytes, "abc", 3);
			} else {
				assert_int_equal(r.header.size, 1);
				assert_memory_equal(r.header.bytes, "x", 1);
				assert_int_equal(r.payload.size, 1);
				assert_memory_equal(r.payload.bytes, "y", 1);
			}
		}
		assert_int_equal(frames, 2);
		frame_reader_fini(&r);
	}
}

static void any_changed_bit_is_detected(void **state)
{
	(void)state;
	for (size_t bit = 0; bit < 8 * (sizeof two_frames - FIRST_FRAME_SIZE); bit++) {
		unsigned char changed[sizeof two_frames];
		struct frame_reader r;
		struct error e;
		size_t used, offset = 0;
		int rc;
		memcpy(changed, two_frames, sizeof changed);
		changed[FIRST_FRAME_SIZE + bit / 8] ^= (unsigned char)(1u << bit % 8);
		frame_reader_init(&r, (struct frame_limits){16, 16});
		assert_int_equal(frame_reader_feed(&r, changed, sizeof changed, &offset, &e), 1);
		while ((rc = frame_reader_feed(&r, changed + offset, sizeof changed - offset, &used, &e)) == 0 && used)
			offset += used;
		assert_int_equal(rc, -EILSEQ); /* the checksum covers the lengths: nobody waits for so many bytes */
		frame_reader_fini(&r);
	}
}

static void written_checksums_are_those_that_are_read(void **state)
{
	(void)state;
	unsigned char prefix[FRAME_PREFIX_SIZE], checked[FRAME_CHECKED_PREFIX_SIZE];
	frame_prefix_write(prefix, 1, 1);
	frame_checked_prefix_write(checked, prefix, (const unsigned char *)"xy", 2);
	assert_memory_equal(checked, two_frames + FIRST_FRAME_SIZE, sizeof checked);
}

static int read_prefix(const unsigned char prefix[8], struct frame_limits limits)
{
	struct frame_reader r;
	struct error e;
	size_t used;
	frame_reader_init(&r, limits);
	int rc = frame_reader_feed(&r, prefix, 8, &used, &e);
	size_t held = r.header.capacity + r.payload.capacity;
	frame_reader_fini(&r);
	assert_true(rc <= 0 && held == 0); /* nothing is allocated for an announced length */
	return rc;
}

static void lengths_beyond_the_limits_are_refused(void **state)
{
	(void)state;
	struct frame_limits l = {16, 32};
	assert_int_equal(read_prefix((const unsigned char[]){0, 0, 0, 16, 0, 0, 0, 32}, l), 0);
	assert_int_equal(read_prefix((const unsigned char[]){0, 0, 0, 17, 0, 0, 0, 0}, l), -EMSGSIZE);
	assert_int_equal(read_prefix((const unsigned char[]){0, 0, 0, 16, 0, 0, 0, 33}, l), -EMSGSIZE);
	assert_int_equal(read_prefix((const unsigned char[]){0, 0, 0, 0, 0, 0, 0, 1}, l), -EBADMSG);
	assert_int_equal(read_prefix((const unsigned char *)"GET / HT", l), -EMSGSIZE);
	assert_int_equal(read_prefix((const unsigned char[]){255, 255, 255, 255, 255, 255, 255, 255}, l), -EMSGSIZE);
	struct frame_limits all = {UINT32_MAX, UINT32_MAX};
	assert_int_equal(read_prefix((const unsigned char[]){255, 255, 255, 255, 255, 255, 255, 255}, all), 0);
}

static void prefix_is_written_in_network_order(void **state)
{
	(void)state;
	unsigned char p[FRAME_PREFIX_SIZE];
	frame_prefix_write(p, 0x01020304, 0xA0B0C0D0);
	assert_memory_equal(p, "\x01\x02\x03\x04\xA0\xB0\xC0\xD0", 8);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(any_cut_gives_the_same_frames),
		cmocka_unit_test(any_changed_bit_is_detected),
		cmocka_unit_test(written_checksums_are_those_that_are_read),
		cmocka_unit_test(lengths_beyond_the_limits_are_refused),
		cmocka_unit_test(prefix_is_written_in_network_order),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
