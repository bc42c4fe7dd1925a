/* SPDX-License-Identifier: Apache-2.0 */
/* A canvas that was saved and loaded continues with the same bits, between whichever batches it was saved; so does one
 * whose batches were taken back and replaced. */
#include "common/film/canvas_save.h"

#include "common/estimate/canvas_image.h"

#include "common/base/mem.h"
#include "tests/support/canvas_batches.h"
#include "tests/support/temporary_folder.h"

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { WIDTH = 150, HEIGHT = 70, GROUPS = 4, PARTS = 3, ROUNDS = 5, EXPONENT = -20 };

static struct plan make_plan(enum plan_kind kind)
{
	return canvas_test_plan(kind, WIDTH, HEIGHT, GROUPS, PARTS);
}

static float random_float(void)
{
	return (float)(canvas_random_uniform() * pow(10, -6 * canvas_random_uniform()));
}

/* Every field that a canvas reads, with some of the tiles of the film. */
static struct batch make_batch(const struct plan *p, enum lease_kind kind, uint64_t epoch, uint32_t group,
			       uint32_t part)
{
	struct batch b = {.key = {1, kind, group, part, epoch}};
	uint32_t across = (WIDTH + TILE_SIZE - 1) / TILE_SIZE, down = (HEIGHT + TILE_SIZE - 1) / TILE_SIZE;
	canvas_random_state =
		1000003u * (uint64_t)(1 + part + PARTS * (group + GROUPS * (epoch + 100 * (uint64_t)kind)));
	b.tiles = mem_alloc((size_t)across * down, sizeof *b.tiles);
	for (uint32_t i = 0; kind == LEASE_RENDER && i < across * down; i++) {
		if (canvas_random_next() % 3 == 0 || i == 4) /* the fifth tile is never touched */
			continue;
		b.tiles[b.tile_count++] = canvas_test_tile(p, i, random_float);
	}
	b.counters[COUNT_SAMPLES] = 2 * p->epoch;
	b.counters[COUNT_INDEPENDENT] = p->epoch + canvas_random_next() % 4;
	b.counters[COUNT_LONGEST_STUCK] = canvas_random_next() % 100;
	b.independent_sum = canvas_random_uniform() * (double)p->epoch;
	b.overlong_sum = canvas_random_uniform();
	for (int k = 0; k < PATH_CLASSES; k++)
		b.classes[k] = canvas_random_uniform();
	b.moment_count = batch_moment_count(p, kind);
	b.moments = mem_alloc(b.moment_count, sizeof *b.moments);
	for (uint64_t k = 0; k < b.moment_count; k++)
		b.moments[k] = (float)canvas_random_uniform();
	return b;
}

static void add_batch(struct canvas *c, const struct plan *p, enum lease_kind kind, uint64_t epoch, uint32_t group,
		      uint32_t part)
{
	struct batch b = make_batch(p, kind, epoch, group, part);
	struct error e;
	if (canvas_add(c, &b, &e))
		fail_msg("%s", e.text);
	batch_fini(&b);
}

/* Adds the n-th batch of a run in which the next round begins before the previous one is complete. */
static void add_nth_batch(struct canvas *c, const struct plan *p, unsigned n)
{
	enum { LEASES = GROUPS * PARTS };
	if (n < LEASES) {
		add_batch(c, p, LEASE_BOOTSTRAP, 0, n / PARTS, n % PARTS);
		return;
	}
	n -= LEASES;
	unsigned pair = n / (2 * LEASES), lease = n % (2 * LEASES) / 2;
	add_batch(c, p, LEASE_RENDER, 2 * pair + n % 2, lease / PARTS, lease % PARTS);
}

static struct canvas *make_canvas(const struct plan *p, const char *films)
{
	struct canvas *c;
	assert_int_equal(canvas_new(&c, p, EXPONENT, films, NULL), 0);
	return c;
}

static void canvas_path(char path[128])
{
	snprintf(path, 128, "%s/canvas", temporary_folder);
}

/* Saves the canvas, frees it, and returns the loaded one. */
static struct canvas *save_and_load(struct canvas *c, const struct plan *p, const char *films)
{
	char path[128];
	struct checked_file s;
	struct error e;
	canvas_path(path);
	assert_int_equal(checked_file_create(&s, path, &e), 0);
	assert_int_equal(canvas_save(c, &s, &e), 0);
	assert_int_equal(checked_file_finish(&s, &e), 0);
	canvas_free(c);
	c = make_canvas(p, films);
	assert_int_equal(checked_file_open(&s, path, &e), 0);
	if (canvas_load(c, &s, &e))
		fail_msg("%s", e.text);
	assert_int_equal(s.remaining_bytes, 0);
	checked_file_close(&s);
	return c;
}

static void assert_same_canvas(const struct canvas *a, const struct canvas *b, const struct plan *p)
{
	for (int open = 0; open < 2; open++) {
		struct canvas_image x, y;
		assert_int_equal(canvas_complete_rounds(a), canvas_complete_rounds(b));
		assert_int_equal(canvas_merged_leases(a), canvas_merged_leases(b));
		assert_int_equal(canvas_image_init(a, open, &x, NULL), 0);
		assert_int_equal(canvas_image_init(b, open, &y, NULL), 0);
		assert_memory_equal(x.rgb, y.rgb, WIDTH * HEIGHT * 3 * sizeof(float));
		assert_int_equal(x.error != NULL, y.error != NULL);
		if (x.error)
			assert_memory_equal(x.error, y.error, WIDTH * HEIGHT * 3 * sizeof(float));
		assert_memory_equal(&x.rel_mse, &y.rel_mse, sizeof x.rel_mse);
		assert_memory_equal(&x.b, &y.b, 2 * sizeof x.b);
		assert_memory_equal(x.classes, y.classes, sizeof x.classes);
		assert_memory_equal(&x.counts, &y.counts, sizeof x.counts);
		assert_int_equal(x.samples, y.samples);
		assert_int_equal(x.r_hat != NULL, y.r_hat != NULL);
		if (x.r_hat) {
			size_t tiles = (size_t)x.tiles_across * x.tiles_down * sizeof *x.r_hat;
			assert_memory_equal(x.r_hat, y.r_hat, tiles);
			assert_memory_equal(x.tile_error, y.tile_error, tiles);
		}
		canvas_image_fini(&x);
		canvas_image_fini(&y);
	}
	for (uint32_t i = 0; i < GROUPS * PARTS * 3; i++) {
		struct lease_key k = {1, i % 3 ? LEASE_RENDER : LEASE_BOOTSTRAP, i / 3 / PARTS, i / 3 % PARTS, 0};
		k.epoch = i % 3 ? canvas_complete_rounds(a) + i % 3 - 1 : 0;
		assert_int_equal(canvas_has_lease(a, &k), canvas_has_lease(b, &k));
	}
	(void)p;
}

static void loaded_canvas_continues_with_the_same_bits(void **unused)
{
	(void)unused;
	for (int kind = 0; kind < 2; kind++) {
		enum { BATCHES = GROUPS * PARTS * (1 + 4) };
		struct plan p = make_plan(kind ? PLAN_CHAINS : PLAN_SAMPLES);
		for (unsigned stop = 0; stop <= BATCHES; stop += 7) {
			struct canvas *plain = make_canvas(&p, NULL),
				      *reloaded = make_canvas(&p, stop % 2 ? temporary_folder : NULL);
			for (unsigned n = 0; n < BATCHES; n++) {
				if (n == stop)
					reloaded = save_and_load(reloaded, &p, stop % 2 ? NULL : temporary_folder);
				add_nth_batch(plain, &p, n);
				add_nth_batch(reloaded, &p, n);
			}
			assert_int_equal(canvas_complete_rounds(plain), 4);
			assert_same_canvas(plain, reloaded, &p);
			canvas_free(plain);
			canvas_free(reloaded);
		}
	}
}

static void loaded_canvas_equals_the_saved_one(void **unused)
{
	(void)unused;
	struct plan p = make_plan(PLAN_CHAINS);
	struct canvas *plain = make_canvas(&p, NULL), *reloaded = make_canvas(&p, NULL);
	for (unsigned n = 0; n < 50; n++) {
		add_nth_batch(plain, &p, n);
		add_nth_batch(reloaded, &p, n);
	}
	reloaded = save_and_load(reloaded, &p, NULL);
	assert_same_canvas(plain, reloaded, &p);
	reloaded = save_and_load(reloaded, &p, NULL);
	assert_same_canvas(plain, reloaded, &p);
	canvas_free(plain);
	canvas_free(reloaded);
}

/* A fabricated result: another batch's content under this key. */
static struct batch make_wrong_batch(const struct plan *p, const struct lease_key *k, uint64_t salt)
{
	struct batch b = make_batch(p, LEASE_RENDER, 1000 + salt, k->group, k->part);
	b.key.epoch = k->epoch;
	b.counters[COUNT_LONGEST_STUCK] = 0; /* a maximum cannot be taken back */
	return b;
}

static void add_wrong_batch(struct canvas *c, const struct plan *p, const struct lease_key *k, uint64_t salt)
{
	struct batch b = make_wrong_batch(p, k, salt);
	struct error e;
	if (canvas_add(c, &b, &e))
		fail_msg("%s", e.text);
	batch_fini(&b);
}

static bool all_leases_are_right(const struct canvas *c, const uint64_t *done, const uint64_t *wrong)
{
	for (unsigned i = 0; i < GROUPS * PARTS; i++)
		if (done[i] < ROUNDS || wrong[i])
			return false;
	return canvas_complete_rounds(c) == ROUNDS && canvas_missing_count(c) == 0;
}

/* Two of three batches are wrong at first; up to two wrong ones arrive for a lease, one after the other, and are
 * detected later, when their rounds may be complete. */
static void batches_taken_back_leave_no_trace(void **unused)
{
	(void)unused;
	enum { LEASES = GROUPS * PARTS };
	for (uint64_t trial = 0; trial < 8; trial++) {
		struct plan p = make_plan(trial % 2 ? PLAN_CHAINS : PLAN_SAMPLES);
		struct canvas *plain = make_canvas(&p, NULL),
			      *mended = make_canvas(&p, trial & 2 ? temporary_folder : NULL);
		uint64_t done[LEASES] = {0}, wrong[LEASES] = {0}, dice = 4711 + trial, closed = 0;
		for (unsigned n = 0; n < LEASES; n++) {
			add_nth_batch(plain, &p, n);
			add_nth_batch(mended, &p, n);
		}
		while (!all_leases_are_right(mended, done, wrong)) {
			canvas_random_state = dice = dice * 6364136223846793005u + 1442695040888963407u;
			unsigned i = (unsigned)(canvas_random_next() >> 20) % LEASES;
			struct lease_key k = {1, LEASE_RENDER, i / PARTS, i % PARTS, done[i]};
			bool is_wrong = canvas_random_next() % 3 && wrong[i] < 2,
			     is_detected = canvas_random_next() % 4 == 0;
			if (wrong[i] &&
			    (is_detected || done[i] >= canvas_complete_rounds(mended) + 2 || done[i] >= ROUNDS)) {
				k.epoch--;
				closed += k.epoch < canvas_complete_rounds(mended);
				struct batch b = make_wrong_batch(&p, &k, k.epoch + trial);
				canvas_subtract(mended, &b);
				batch_fini(&b);
				wrong[i]--;
				done[i]--;
				assert_false(canvas_has_lease(mended, &k));
				continue;
			}
			if (done[i] >= ROUNDS || done[i] >= canvas_complete_rounds(mended) + 2)
				continue;
			if (is_wrong) {
				add_wrong_batch(mended, &p, &k, k.epoch + trial);
				wrong[i]++;
			} else if (wrong[i] == 0) {
				add_batch(mended, &p, LEASE_RENDER, k.epoch, k.group, k.part);
			} else {
				continue;
			}
			done[i]++;
			assert_true(canvas_has_lease(mended, &k));
		}
		for (uint64_t epoch = 0; epoch < ROUNDS; epoch++)
			for (unsigned i = 0; i < LEASES; i++)
				add_batch(plain, &p, LEASE_RENDER, epoch, i / PARTS, i % PARTS);
		assert_true(closed > 0);
		assert_same_canvas(plain, mended, &p);
		canvas_free(plain);
		canvas_free(mended);
	}
}

/* Films of another plan or grid, truncated ones and ones with a wrong bit are refused, and no part of them is used. */
static void other_or_damaged_films_are_refused(void **unused)
{
	(void)unused;
	char path[128];
	struct checked_file s;
	struct error e;
	struct stat st;
	struct plan p = make_plan(PLAN_CHAINS), q = p;
	canvas_path(path);
	struct canvas *c = make_canvas(&p, NULL);
	for (unsigned n = 0; n < 30; n++)
		add_nth_batch(c, &p, n);
	c = save_and_load(c, &p, NULL);
	canvas_free(c);
	q.groups = 2;
	q.chains /= 2;
	assert_int_equal(canvas_new(&c, &q, EXPONENT, NULL, NULL), 0);
	assert_int_equal(checked_file_open(&s, path, &e), 0);
	assert_int_equal(canvas_load(c, &s, &e), -EBADMSG);
	checked_file_close(&s);
	canvas_free(c);
	assert_int_equal(canvas_new(&c, &p, EXPONENT + 1, NULL, NULL), 0);
	assert_int_equal(checked_file_open(&s, path, &e), 0);
	assert_int_equal(canvas_load(c, &s, &e), -EBADMSG);
	checked_file_close(&s);
	canvas_free(c);
	assert_int_equal(stat(path, &st), 0);
	for (int i = 0; i < 40; i++) {
		off_t offset = st.st_size * i / 40;
		unsigned char byte;
		int fd = open(path, O_RDWR);
		assert_int_equal(pread(fd, &byte, 1, offset), 1);
		byte ^= 16;
		assert_int_equal(pwrite(fd, &byte, 1, offset), 1);
		assert_int_equal(checked_file_open(&s, path, &e), -EBADMSG);
		byte ^= 16;
		assert_int_equal(pwrite(fd, &byte, 1, offset), 1);
		close(fd);
	}
	assert_int_equal(checked_file_open(&s, path, &e), 0);
	checked_file_close(&s);
	for (off_t cut = 1; cut < st.st_size; cut *= 3) {
		assert_int_equal(truncate(path, st.st_size - cut), 0);
		assert_int_equal(checked_file_open(&s, path, &e), -EBADMSG);
	}
	unlink(path);
	assert_int_equal(checked_file_open(&s, path, &e), -ENOENT);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(loaded_canvas_continues_with_the_same_bits, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(loaded_canvas_equals_the_saved_one, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(batches_taken_back_leave_no_trace, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(other_or_damaged_films_are_refused, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
