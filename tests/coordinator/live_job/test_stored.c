/* SPDX-License-Identifier: Apache-2.0 */
/* The stored parts of a job are read back unchanged; those of a later version are refused; those of earlier versions
 * are read. */
#include "coordinator/live_job/stored.h"

#include "common/base/bytes.h"
#include "tests/support/failing_memory.h"

#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const unsigned char unknown[] = {0xc0, 0x0c, 1}; /* field 200 of any message: a 1 */
static struct error e;

static struct job_counts make_counts(void)
{
	struct job_counts c;
	uint64_t n = UINT64_MAX;
#define COUNTER(member, key, wire) c.member = n--;
	JOB_COUNTERS(COUNTER)
#undef COUNTER
	return c;
}

static struct forecast_look make_look(double work)
{
	return (struct forecast_look){work, 0.1, 1.0 / 3, 1e-300, INFINITY, NAN, 7};
}

static void assert_look(const struct forecast_look *l, double work)
{
	struct forecast_look want = make_look(work);
	assert_memory_equal(l, &want, sizeof want);
}

static void counts_are_unpacked_as_they_were_packed(void **state)
{
	(void)state;
	unsigned char bytes[STORED_NOTE_MAX];
	struct job_counts c = make_counts(), back = {0};
	size_t size = stored_pack_counts(&c, bytes);
	assert_int_equal(stored_unpack_counts(bytes, size, &back, &e), 0);
	assert_memory_equal(&back, &c, sizeof c);
	memcpy(bytes + size, unknown, sizeof unknown);
	assert_int_equal(stored_unpack_counts(bytes, size + sizeof unknown, &back, &e), -EPROTO);
	assert_int_equal(stored_unpack_counts(bytes, size - 1, &back, &e), -EPROTO);
	mem_fail_after(0);
	assert_int_equal(stored_unpack_counts(bytes, size, &back, &e), -ENOMEM);
	mem_fail_after(-1);
}

static void estimates_are_unpacked_as_they_were_packed(void **state)
{
	(void)state;
	unsigned char bytes[STORED_NOTE_MAX];
	struct forecast_look l = make_look(1e9), back;
	size_t size = stored_pack_look(&l, bytes);
	assert_int_equal(stored_unpack_look(bytes, size, &back, &e), 0);
	assert_look(&back, 1e9);
	memcpy(bytes + size, unknown, sizeof unknown);
	assert_int_equal(stored_unpack_look(bytes, size + sizeof unknown, &back, &e), -EPROTO);
}

/* All numbers differ from each other. */
static struct checkpoint_head make_head(void)
{
	struct checkpoint_head h = {.job = 12,
				    .generation = 1ull << 40,
				    .worker_count = 3,
				    .cpu_seconds = 1.5,
				    .bootstrap_cpu_seconds = 2.5,
				    .look_written = 3.5,
				    .times = {4.5, 5.5, NAN},
				    .bootstrap_result = {.b_pooled = 6.5, .overlong_share = 7.5, .is_black = true},
				    .counts = make_counts()};
	for (int i = 0; i < PLAN_GROUPS_MAX; i++)
		h.bootstrap_result.b[i] = 1.0 / (1 + i);
	for (; h.looks.count < FORECAST_LOOKS_MAX; h.looks.count++)
		h.looks.looks[h.looks.count] = make_look(h.looks.count);
	snprintf(h.fingerprint, sizeof h.fingerprint, "%0255d", 9);
	return h;
}

static void assert_head(const struct checkpoint_head *h)
{
	struct checkpoint_head want = make_head();
	assert_true(h->job == want.job && h->generation == want.generation && h->worker_count == want.worker_count);
	assert_true(h->cpu_seconds == 1.5 && h->bootstrap_cpu_seconds == 2.5 && h->look_written == 3.5);
	assert_true(h->times.elapsed == 4.5 && h->times.first_round_at == 5.5 && isnan(h->times.last_round_end));
	assert_memory_equal(h->bootstrap_result.b, want.bootstrap_result.b, sizeof want.bootstrap_result.b);
	assert_true(h->bootstrap_result.b_pooled == 6.5 && h->bootstrap_result.overlong_share == 7.5 &&
		    h->bootstrap_result.is_black);
	assert_int_equal(h->looks.count, FORECAST_LOOKS_MAX);
	for (uint32_t i = 0; i < h->looks.count; i++)
		assert_look(&h->looks.looks[i], i);
	assert_string_equal(h->fingerprint, want.fingerprint);
}

static unsigned char bytes[STORED_HEAD_MAX + 64];

static void heads_are_unpacked_as_they_were_packed(void **state)
{
	(void)state;
	struct checkpoint_head h = make_head(), back;
	size_t size = stored_pack_head(&h, bytes);
	assert_int_equal(stored_unpack_head(bytes, size, &back, &e), 0);
	assert_head(&back);
	assert_memory_equal(&back.counts, &h.counts, sizeof h.counts);
	assert_int_equal(stored_unpack_head(bytes, size - 1, &back, &e), -EPROTO);
	assert_int_equal(stored_unpack_head(bytes, 0, &back, &e), -EPROTO);
	/* Too many entries: a 65th group, a 65th estimate. Unknown fields: in the head, in its last estimate. */
	static const unsigned char more[][12] = {{0x52, 8}, {0x72, 0}, {0xc0, 0x0c, 1}, {0x72, 3, 0xc0, 0x0c, 1}};
	static const size_t sizes[] = {10, 2, 3, 5};
	h.looks.count--;
	for (int i = 0; i < 4; i++) {
		h.looks.count = i == 1 ? FORECAST_LOOKS_MAX : 1;
		size = stored_pack_head(&h, bytes);
		memcpy(bytes + size, more[i], sizes[i]);
		assert_int_equal(stored_unpack_head(bytes, size + sizes[i], &back, &e), -EPROTO);
	}
}

/* ---- as earlier versions wrote it: little endian, numbers without padding ---- */

static size_t put_doubles(size_t offset, const double *v, size_t count)
{
	copy_numbers(bytes + offset, v, sizeof *v, count);
	return offset + count * sizeof *v;
}

static size_t put_look(size_t offset, double work)
{
	struct forecast_look l = make_look(work);
	offset = put_doubles(offset,
			     (double[6]){l.work, l.cpu_seconds, l.seconds, l.rel_mse, l.rel_mse_upper, l.degrees}, 6);
	put64(bytes + offset, l.is_doubtful);
	return offset + 8;
}

static size_t put_counts(size_t offset)
{
	for (uint64_t n = 1; n <= 8; n++, offset += 8)
		put64(bytes + offset, n);
	return offset;
}

static void assert_old_counts(const struct job_counts *c)
{
	assert_true(c->repeats == 1 && c->refused == 2 && c->faults == 3 && c->failures == 4 && c->timeouts == 5 &&
		    c->duplicates == 6 && c->verified == 7 && c->mismatched == 8);
}

static void old_notes_are_read(void **state)
{
	(void)state;
	struct job_counts back = {0};
	struct forecast_look read;
	size_t size = put_counts(0);
	assert_int_equal(stored_unpack_old_counts(bytes, size, &back, &e), 0);
	assert_old_counts(&back);
	assert_int_equal(stored_unpack_old_counts(bytes, size + 8, &back, &e), -EPROTO);
	assert_int_equal(stored_unpack_old_counts(bytes, size - 1, &back, &e), -EPROTO);
	size = put_look(0, 5);
	assert_int_equal(stored_unpack_old_look(bytes, size, &read, &e), 0);
	assert_look(&read, 5);
	assert_int_equal(stored_unpack_old_look(bytes, size - 8, &read, &e), -EPROTO);
	assert_int_equal(stored_unpack_old_look(bytes, size + 1, &read, &e), -EPROTO);
}

static void old_heads_are_read(void **state)
{
	(void)state;
	struct checkpoint_head h = make_head(), back;
	put64(bytes, h.job);
	put64(bytes + 8, h.generation);
	size_t offset = put_doubles(16, (double[6]){1.5, 2.5, 3.5, 4.5, 5.5, NAN}, 6);
	offset = put_doubles(offset, h.bootstrap_result.b, 64);
	offset = put_doubles(offset, (double[2]){6.5, 7.5}, 2);
	put64(bytes + offset, 1); /* black */
	put64(bytes + offset + 8, 64);
	offset += 16;
	for (int i = 0; i < 64; i++)
		offset = put_look(offset, i);
	offset = put_counts(offset);
	memcpy(bytes + offset, h.fingerprint, 256);
	assert_int_equal(offset + 256, STORED_OLD_HEAD_SIZE);
	stored_unpack_old_head(bytes, 3, &back);
	assert_head(&back);
	assert_old_counts(&back.counts);
	memset(bytes + 600, 0xff, 4); /* more estimates than there can be */
	memset(bytes + offset, 'a', 256);
	stored_unpack_old_head(bytes, 3, &back);
	assert_int_equal(back.looks.count, 64);
	assert_int_equal(strlen(back.fingerprint), 255);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(counts_are_unpacked_as_they_were_packed),
		cmocka_unit_test(estimates_are_unpacked_as_they_were_packed),
		cmocka_unit_test(heads_are_unpacked_as_they_were_packed),
		cmocka_unit_test(old_notes_are_read),
		cmocka_unit_test(old_heads_are_read),
	};
	return cmocka_run_group_tests_name("coordinator/live_job/test_stored", tests, NULL, NULL);
}
