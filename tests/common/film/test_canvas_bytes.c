/* SPDX-License-Identifier: Apache-2.0 */
/* A saved canvas has the same bytes in every build and on every machine; other bytes are refused even if their checksum
 * fits. */
#include "common/film/canvas_save.h"

#include "common/base/bytes.h"
#include "tests/support/canvas_batches.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/golden.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <string.h>

/* A file as an x86-64 build wrote it from memory: head, lists, tallies, moments, two tiles of three sums, the end. */
enum { SIZE = 355312, MOMENTS_OFFSET = 156766, FIRST_TILE_OFFSET = 158680 };
static const struct golden_run golden_runs[] = {
	{0, "020000000099000001000000020000000100000001000000010000000030"},
	{38, "b03e01"},
	{52, "01000000000100000100000040"},
	{80, "20000000000006"},
	{102, "0a"},
	{158, "07"},
	{214, "40"},
	{350, "60"},
	{1366, "06000000000000000a"},
	{1516, "0c"},
	{1804, "02"},
	{78422, "03"},
	{78438, "05"},
	{78494, "07"},
	{78550, "20"},
	{78686, "30"},
	{79702, "030000000000000005"},
	{79852, "06"},
	{80140, "01"},
	{117590, "03"},
	{117606, "05"},
	{117662, "07"},
	{117718, "20"},
	{117854, "30"},
	{118870, "030000000000000005"},
	{119020, "06"},
	{119308, "01"},
	{156764, "04400200000002000000010000001400000001000008000000000001000010000000000001000008000000000001000010"},
	{156822,
	 "010000080000000000010000100000000000000001000004000000000001000004000000000000000100000400000000000001"},
	{157007, "10"},
	{157179, "01"},
	{157314, "04"},
	{157488, "01"},
	{157623, "08"},
	{157795, "01"},
	{157930, "02"},
	{158084, "01"},
	{158219, "08"},
	{158391, "01"},
	{158526, "02"},
	{158690, "2000000000000000c0ffffffffff02"},
	{256992, "02"},
	{257002, "1000000000000000e0ffffffffff01"},
	{355304, "ffffffffffffffff8a1f4e7d"},
};
static unsigned char golden_bytes[SIZE + 4]; /* with its checksum */
static char path[128];
static struct error e;

static struct plan small_plan(void)
{
	return canvas_test_plan(PLAN_CHAINS, 1, 1, 1, 2);
}

static void add_batch(struct canvas *c, const struct plan *p, enum lease_kind kind, uint64_t epoch, uint32_t part)
{
	float xyz[3] = {1, -2, 0x1p-20f}, moments[3] = {0.5f, 1, 0.25f};
	struct tile tile = {p->crop_x, p->crop_y, 1, 1, xyz};
	struct batch b = {.key = {1, kind, 0, part, epoch},
			  .strategy_count = 1,
			  .independent_sum = 1.5,
			  .overlong_sum = 0.25,
			  .tile_count = kind == LEASE_RENDER,
			  .tiles = &tile,
			  .moment_count = batch_moment_count(p, kind),
			  .moments = moments};
	b.counters[COUNT_SAMPLES] = 3;
	b.counters[COUNT_INDEPENDENT] = 5;
	b.counters[COUNT_LONGEST_STUCK] = 7;
	b.strategies[0][0] = 32;
	b.strategies[0][STRATEGY_COUNTERS - 1] = 48;
	b.classes[0] = 2;
	b.classes[PATH_CLASSES - 1] = 0.5;
	if (canvas_add(c, &b, &e))
		fail_msg("%s", e.text);
}

static struct canvas *make_canvas(const struct plan *p)
{
	struct canvas *c;
	assert_int_equal(canvas_new(&c, p, -20, NULL, NULL), 0);
	return c;
}

/* Makes a canvas with part of the bootstrap, a complete round, and part of the next one. */
static struct canvas *small_canvas(const struct plan *p)
{
	struct canvas *c = make_canvas(p);
	add_batch(c, p, LEASE_BOOTSTRAP, 0, 1);
	add_batch(c, p, LEASE_RENDER, 0, 0);
	add_batch(c, p, LEASE_RENDER, 0, 1);
	add_batch(c, p, LEASE_RENDER, 1, 0);
	canvas_set_tail_index(c, 2.5);
	return c;
}

static int set_up(void **state)
{
	int rc = temporary_folder_set_up(state);
	snprintf(path, sizeof path, "%s/canvas", temporary_folder);
	golden_fill(golden_runs, sizeof golden_runs / sizeof *golden_runs, golden_bytes, sizeof golden_bytes);
	return rc;
}

static void assert_saves_golden_bytes(const struct canvas *c)
{
	struct checked_file f;
	assert_int_equal(checked_file_create(&f, path, &e), 0);
	assert_int_equal(canvas_save(c, &f, &e), 0);
	assert_int_equal(checked_file_finish(&f, &e), 0);
	golden_compare_file(path, golden_bytes, sizeof golden_bytes);
}

static void saved_bytes_never_change(void **state)
{
	(void)state;
	struct plan p = small_plan();
	struct canvas *c = small_canvas(&p);
	assert_saves_golden_bytes(c);
	canvas_free(c);
}

/* Loads these bytes, with a checksum that fits, into a new canvas. */
static int load_golden_bytes(struct canvas **c, const struct plan *p, size_t size)
{
	struct checked_file f;
	*c = make_canvas(p);
	golden_write_and_open(&f, path, golden_bytes, size);
	int rc = canvas_load(*c, &f, &e);
	assert_true(rc || f.remaining_bytes == 0);
	checked_file_close(&f);
	return rc;
}

/* The loaded canvas can be continued: the last part of the second round completes the round. */
static void earlier_file_is_loaded_and_continued(void **state)
{
	(void)state;
	struct plan p = small_plan();
	struct canvas *c, *same = small_canvas(&p);
	struct canvas_counts a, b;
	assert_int_equal(load_golden_bytes(&c, &p, SIZE), 0);
	assert_saves_golden_bytes(c);
	assert_int_equal(canvas_merged_leases(c), 3);
	add_batch(c, &p, LEASE_RENDER, 1, 1);
	add_batch(same, &p, LEASE_RENDER, 1, 1);
	assert_int_equal(canvas_complete_rounds(c), 2);
	canvas_sum_counts(c, false, &a);
	canvas_sum_counts(same, false, &b);
	assert_memory_equal(&a, &b, sizeof a);
	canvas_free(c);
	canvas_free(same);
}

static void assert_refused(const struct plan *p, size_t size, int code)
{
	struct canvas *c;
	assert_int_equal(load_golden_bytes(&c, p, size), code);
	canvas_free(c);
}

static void truncated_files_are_refused(void **state)
{
	(void)state;
	struct plan p = small_plan();
	for (size_t i = 0; i < sizeof golden_runs / sizeof *golden_runs; i++)
		for (size_t cut = golden_runs[i].offset; cut <= golden_runs[i].offset + 9 && cut < SIZE; cut += 3)
			assert_refused(&p, cut, -EBADMSG);
	assert_refused(&p, SIZE - 1, -EBADMSG);
}

/* Refused: any flipped bit of the head and of the shape of the moments, counts that contradict each other, and
 * positions of tiles outside the films. */
static void contradictory_files_are_refused(void **state)
{
	(void)state;
	struct plan p = small_plan();
	for (int bit = 0; bit < 8 * 40; bit++) {
		int offset = bit / 8;
		bool build = offset < 8 ||
			     (offset >= 28 && offset < 32); /* fields for version, tally and tile: another build */
		golden_bytes[offset] ^= (unsigned char)(1 << bit % 8);
		assert_refused(&p, SIZE, build ? -EPROTO : -EBADMSG);
		golden_bytes[offset] ^= (unsigned char)(1 << bit % 8);
	}
	for (int bit = 0; bit < 8 * 16; bit++) {
		golden_bytes[MOMENTS_OFFSET + bit / 8] ^= (unsigned char)(1 << bit % 8);
		assert_refused(&p, SIZE, -EBADMSG);
		golden_bytes[MOMENTS_OFFSET + bit / 8] ^= (unsigned char)(1 << bit % 8);
	}
	/* More or fewer leases than are marked, an invalid mark, a round that is both complete and open. */
	static const struct golden_run counts[] = {{48, "01000000"},   {52, "00000000"}, {52, "02000000"},
						   {52, "0200000001"}, {56, "02"},	 {58, "01"},
						   {61, "01"},	       {60, "ff"},	 {52, "02000000000100000101"}};
	for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
		unsigned char original[16], replacement[16];
		size_t n = strlen(counts[i].hex) / 2;
		golden_fill(&(struct golden_run){0, counts[i].hex}, 1, replacement, sizeof replacement);
		memcpy(original, golden_bytes + counts[i].offset, sizeof original);
		memcpy(golden_bytes + counts[i].offset, replacement, n);
		assert_refused(&p, SIZE, -EBADMSG);
		memcpy(golden_bytes + counts[i].offset, original, sizeof original);
	}
	static const uint32_t places[][2] = {{3, 0},	      {0, 1},	       {UINT32_MAX - 1, 0},
					     {0, UINT32_MAX}, {0x80000000, 0}, {2, 0x10000}};
	for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
		put32(golden_bytes + FIRST_TILE_OFFSET, places[i][0]);
		put32(golden_bytes + FIRST_TILE_OFFSET + 4, places[i][1]);
		assert_refused(&p, SIZE, -EBADMSG);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(saved_bytes_never_change, set_up, temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(earlier_file_is_loaded_and_continued, set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(truncated_files_are_refused, set_up, temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(contradictory_files_are_refused, set_up, temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
