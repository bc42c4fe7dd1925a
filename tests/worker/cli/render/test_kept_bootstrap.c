/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A render stopped in its bootstrap, after a number of leases, and one that continues from the kept file: the same
 * bits as a render that was never stopped, with no lease computed twice. Files of other plans, scenes or
 * fingerprints, and damaged files, are not used. Renders are stopped from within, so that nothing depends on time.
 */
#include "common/base/bytes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/golden.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"
#include "worker/cli/render/kept_bootstrap.h"
#include "worker/cli/render/local_run.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { LEASES = 16, STOP_AFTER = 5 };

struct trial {
	struct kept_bootstrap kept;
	struct render_arguments arguments;
	struct plan plan;
	atomic_bool stop;
	uint32_t lease_count, stop_after; /* computed in this run; stop_after 0: never stopped */
	const char *fingerprint;
	char image[128], text[512];
};

static void count_lease(void *user, const struct local_progress *p)
{
	struct trial *t = user;
	(void)p;
	t->lease_count++;
	if (t->lease_count == t->stop_after)
		atomic_store(&t->stop, true);
}

static int resume_trial(void *user, struct bootstrap *b, struct error *e)
{
	struct trial *t = user;
	(void)e;
	kept_bootstrap_begin(&t->kept, t->image, t->fingerprint, &t->plan, &t->arguments);
	kept_bootstrap_resume(&t->kept, b, t->text, sizeof t->text);
	return 0;
}

static void keep_result(void *user, const struct bootstrap *b)
{
	struct trial *t = user;
	kept_bootstrap_write(&t->kept, b);
}

/* Opens the scene through the source that records its bytes. */
static void record_scene(struct kept_bootstrap *k, const char *bytes)
{
	struct memory_file files[] = {{"s.xml", bytes, strlen(bytes)}, {NULL, NULL, 0}};
	struct asset_source inner = memory_assets(files), recording = kept_bootstrap_source(k, &inner);
	struct asset a;
	struct error e;
	assert_int_equal(recording.open(recording.user, "s.xml", &a, &e), 0);
	recording.close(recording.user, &a);
}

static struct world *lit_world(void)
{
	return world_from_text(16, 16, SENSOR("0,0,5", "0,0,0") "<emitter type='constant'/>%s",
			       "<shape type='sphere'/>");
}

static struct trial make_trial(const struct world *w, uint64_t seed, const char *bytes, uint32_t stop_after)
{
	struct plan_request r = {.integrator = "pssmlt",
				 .kind = PLAN_CHAINS,
				 .width = 16,
				 .height = 16,
				 .seed = seed,
				 .chains = 16,
				 .groups = 4,
				 .parts = 4,
				 .bootstrap = 1024,
				 .epoch = 16,
				 .mutations = 512,
				 .max_depth = 8};
	struct trial t = {.stop_after = stop_after, .fingerprint = "build=1 libc=2"};
	struct error e;
	(void)w;
	assert_int_equal(plan_make(&r, &t.plan, &e), 0);
	assert_int_equal(t.plan.groups * t.plan.parts, LEASES);
	snprintf(t.image, sizeof t.image, "%s/image.exr", temporary_folder);
	record_scene(&t.kept, bytes);
	return t;
}

/* Returns the image, or NULL if the render was stopped before a round was complete. */
static float *render_trial(const struct world *w, struct trial *t)
{
	struct local_run r = {.world = w,
			      .plan = &t->plan,
			      .threads = 1,
			      .stop = &t->stop,
			      .on_progress = count_lease,
			      .load_bootstrap = resume_trial,
			      .save_bootstrap = keep_result,
			      .user = t};
	struct error e;
	struct canvas_image i;
	float *rgb = NULL;
	if (local_run(&r, &e))
		fail_msg("%s", e.text);
	if (r.canvas && canvas_complete_rounds(r.canvas) > 0) {
		assert_int_equal(canvas_image_init(r.canvas, false, &i, &e), 0);
		rgb = test_malloc(16 * 16 * 3 * sizeof *rgb);
		memcpy(rgb, i.rgb, 16 * 16 * 3 * sizeof *rgb);
		canvas_image_fini(&i);
	}
	canvas_free(r.canvas);
	return rgb;
}

static bool file_exists(const char *name)
{
	char path[160];
	snprintf(path, sizeof path, "%s/%s", temporary_folder, name);
	return access(path, F_OK) == 0;
}

static void test_stopped_render_continues_to_the_same_bits(void **state)
{
	(void)state;
	struct world *w = lit_world();
	struct trial whole = make_trial(w, 1, "scene", 0);
	float *truth = render_trial(w, &whole);
	uint32_t lease_count = whole.lease_count;
	assert_true(truth && lease_count > LEASES && !*whole.text && !file_exists("image.exr.bootstrap"));
	/* Stopped twice in the bootstrap, and once in the first round. */
	static const uint32_t stops[] = {STOP_AFTER, 3, LEASES - STOP_AFTER - 3 + 2};
	uint32_t done = 0;
	for (size_t i = 0; i < sizeof stops / sizeof *stops; i++) {
		struct trial t = make_trial(w, 1, "scene", stops[i]);
		char wanted[64];
		assert_null(render_trial(w, &t));
		assert_int_equal(t.lease_count, stops[i]);
		snprintf(wanted, sizeof wanted, "continues from %u of %u leases", done, LEASES);
		assert_true(done == 0 ? !*t.text : strstr(t.text, wanted) != NULL);
		done += stops[i];
		done = done < LEASES ? done : LEASES;
		snprintf(wanted, sizeof wanted, "; %u of %u leases of the bootstrap are kept in", done, LEASES);
		assert_non_null(strstr(t.kept.message, wanted));
		assert_true(file_exists("image.exr.bootstrap") && !file_exists("image.exr.bootstrap.new"));
	}
	struct trial last = make_trial(w, 1, "scene", 0);
	float *image = render_trial(w, &last);
	assert_non_null(image);
	assert_int_equal(last.lease_count, lease_count - LEASES);
	assert_memory_equal(image, truth, 16 * 16 * 3 * sizeof *image);
	kept_bootstrap_end(&last.kept);
	assert_false(file_exists("image.exr.bootstrap"));
	test_free(image);
	test_free(truth);
	world_free(w);
}

static void test_file_of_another_command_is_not_used(void **state)
{
	(void)state;
	struct world *w = lit_world();
	struct trial t = make_trial(w, 1, "scene", STOP_AFTER);
	assert_null(render_trial(w, &t));
	struct trial others[] = {make_trial(w, 2, "scene", 1), make_trial(w, 1, "scenf", 1),
				 make_trial(w, 1, "scene", 1), make_trial(w, 1, "scene", 1)};
	others[2].arguments.define_count = 1;
	others[2].arguments.defines[0] = (struct scene_define){"x", "1"};
	others[3].fingerprint = "build=1 libc=3";
	for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
		others[i].kept.path[0] = 0;
		struct bootstrap *b;
		struct error e;
		assert_int_equal(bootstrap_new(&b, &others[i].plan, &e), 0);
		resume_trial(&others[i], b, &e);
		assert_non_null(
			strstr(others[i].text, "is not used: it is of another plan, scene, program or machine"));
		assert_int_equal(bootstrap_added_count(b), 0);
		bootstrap_free(b);
		kept_bootstrap_end(&others[i].kept);
		assert_true(file_exists("image.exr.bootstrap"));
	}
	world_free(w);
}

/* Each byte changed in turn, and the file truncated at this byte: no part of the file is used. */
static void test_damaged_file_is_not_used(void **state)
{
	(void)state;
	struct world *w = lit_world();
	struct trial t = make_trial(w, 1, "scene", 2);
	assert_null(render_trial(w, &t));
	static char bytes[1 << 16];
	char path[160];
	snprintf(path, sizeof path, "%s/image.exr.bootstrap", temporary_folder);
	FILE *f = fopen(path, "rb");
	assert_non_null(f);
	size_t size = fread(bytes, 1, sizeof bytes, f);
	fclose(f);
	assert_in_range(size, 100, sizeof bytes - 1);
	for (size_t i = 0; i < size; i += i < 64 ? 1 : 37)
		for (int cut = 0; cut < 2; cut++) {
			f = fopen(path, "wb");
			bytes[i] ^= 4;
			fwrite(bytes, 1, cut ? i : size, f);
			bytes[i] ^= 4;
			fclose(f);
			struct trial damaged = make_trial(w, 1, "scene", 0);
			struct bootstrap *b;
			struct error e;
			assert_int_equal(bootstrap_new(&b, &damaged.plan, &e), 0);
			resume_trial(&damaged, b, &e);
			assert_non_null(strstr(damaged.text, " is not used: "));
			assert_null(strstr(damaged.text, " is not used: /"));
			assert_int_equal(bootstrap_added_count(b), 0);
			bootstrap_free(b);
			/* A file that does not begin like a kept bootstrap may be somebody else's. */
			kept_bootstrap_end(&damaged.kept);
			assert_int_equal(file_exists("image.exr.bootstrap"), i < 8);
		}
	world_free(w);
}

/* ---- the bytes of the file ---- */

/* The file written by an x86-64 build from memory: magic number, text "text", one lease of two, checksum. */
enum { OLD_SIZE = 364, OLD_LEASE = 32, OLD_WEIGHTS = OLD_LEASE + 320 };
static const struct golden_run old_runs[] = {
	{0, "48534c54424f4f31040302010c0b0a09080706050400000074657874010000000000000001"},
	{56, "02"},
	{96, "3412"},
	{175, "400000000000000440000000000000d03f000000000000f43f"},
	{350, "e83f0000c03f0000003f62bf5d74"},
};

static struct plan old_plan(void)
{
	return (struct plan){.integrator = "pssmlt",
			     .kind = PLAN_CHAINS,
			     .width = 1,
			     .height = 1,
			     .crop_width = 1,
			     .crop_height = 1,
			     .groups = 1,
			     .parts = 2,
			     .chains = 2,
			     .bootstrap = 4,
			     .epoch = 1,
			     .rounds = 1};
}

static struct kept_bootstrap old_kept(void)
{
	struct kept_bootstrap k = {.files_crc = 0x01020304, .files_bytes = 0x05060708090a0b0c, .identity_text = "text"};
	snprintf(k.path, sizeof k.path, "%s/image.exr.bootstrap", temporary_folder);
	return k;
}

static struct bootstrap *old_bootstrap(bool filled)
{
	float weights[2] = {1.5f, 0.5f};
	struct plan p = old_plan();
	struct batch b = {.key = {.kind = LEASE_BOOTSTRAP, .part = 1},
			  .independent_sum = 2,
			  .independent_square = 2.5,
			  .overlong_sum = 0.25,
			  .weight_count = 2,
			  .weights = weights};
	struct bootstrap *s;
	struct error e;
	b.counters[COUNT_INDEPENDENT] = 2;
	b.counters[COUNT_RAYS_SHADOW] = 0x1234;
	b.classes[0] = 1.25;
	b.classes[PATH_CLASSES - 1] = 0.75;
	assert_int_equal(bootstrap_new(&s, &p, &e), 0);
	assert_int_equal(batch_check(&b, &p, &e), 0);
	assert_int_equal(filled ? bootstrap_add(s, &b, &e) : 0, 0);
	return s;
}

/* Writes these bytes with a valid checksum, and returns the number of leases read from them; text: the message. */
static uint32_t resume_from(const unsigned char *bytes, size_t size, char text[512])
{
	struct kept_bootstrap k = old_kept();
	struct bootstrap *s = old_bootstrap(false);
	struct checked_file f;
	golden_write_and_open(&f, k.path, bytes, size);
	checked_file_close(&f);
	kept_bootstrap_resume(&k, s, text, 512);
	uint32_t done = bootstrap_added_count(s);
	bootstrap_free(s);
	return done;
}

static void test_bytes_of_the_file_never_change(void **state)
{
	(void)state;
	unsigned char bytes[OLD_SIZE];
	char text[512];
	struct kept_bootstrap k = old_kept();
	struct bootstrap *s = old_bootstrap(true), *again = old_bootstrap(false);
	golden_fill(old_runs, sizeof old_runs / sizeof *old_runs, bytes, sizeof bytes);
	kept_bootstrap_write(&k, s);
	golden_compare_file(k.path, bytes, sizeof bytes);
	kept_bootstrap_resume(&k, again, text, sizeof text);
	assert_non_null(strstr(text, "continues from 1 of 2 leases"));
	assert_true(unlink(k.path) == 0);
	kept_bootstrap_write(&k, again); /* every lease was read back */
	golden_compare_file(k.path, bytes, sizeof bytes);
	bootstrap_free(s);
	bootstrap_free(again);
}

/* Truncated at each byte, one byte too long, each bit of the magic number and of the lease's position flipped, and
 * invalid weights. */
static void test_contradictory_bytes_are_not_used(void **state)
{
	(void)state;
	enum { END = OLD_SIZE - 4, PART = 8 * (OLD_LEASE + 4) /* turns the lease into the other part of its group */ };
	unsigned char bytes[OLD_SIZE];
	char text[512];
	golden_fill(old_runs, sizeof old_runs / sizeof *old_runs, bytes, sizeof bytes);
	for (size_t size = 0; size < END; size++) {
		assert_int_equal(resume_from(bytes, size, text), 0);
		assert_non_null(strstr(text, "ends too early"));
	}
	resume_from(bytes, END + 1, text);
	assert_non_null(strstr(text, "is not used: "));
	for (size_t bit = 0; bit < 8 * (OLD_LEASE + 8); bit++) {
		bytes[bit / 8] ^= (unsigned char)(1 << bit % 8);
		assert_int_equal(resume_from(bytes, END, text), bit == PART);
		assert_int_equal(strstr(text, "is not used: ") != NULL, bit != PART);
		bytes[bit / 8] ^= (unsigned char)(1 << bit % 8);
	}
	for (int large = 0; large < 2; large++) { /* a negative weight, and one that is no number */
		put_float(bytes + OLD_WEIGHTS, large ? NAN : -1);
		assert_int_equal(resume_from(bytes, END, text), 0);
		assert_non_null(strstr(text, "a bootstrap weight is negative or not finite"));
	}
}

/* If no file can be written beside the image, or no lease has finished, nothing is kept, and a message says so. */
static void test_message_says_why_nothing_is_kept(void **state)
{
	(void)state;
	struct world *w = lit_world();
	struct trial t = make_trial(w, 1, "scene", STOP_AFTER);
	snprintf(t.image, sizeof t.image, "/dev/stdout");
	assert_null(render_trial(w, &t));
	assert_non_null(
		strstr(t.kept.message, "; nothing is kept: the bootstrap can be only beside an image in a file"));
	struct trial early = make_trial(w, 1, "scene", 0);
	atomic_store(&early.stop, true);
	assert_null(render_trial(w, &early));
	assert_non_null(
		strstr(early.kept.message, "; nothing is kept: of the 16 leases of the bootstrap none was finished"));
	assert_false(file_exists("image.exr.bootstrap"));
	struct trial gone = make_trial(w, 1, "scene", STOP_AFTER);
	snprintf(gone.image, sizeof gone.image, "%s/nowhere/image.exr", temporary_folder);
	assert_null(render_trial(w, &gone));
	assert_non_null(strstr(gone.kept.message, "; the bootstrap could not be kept: "));
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(test_stopped_render_continues_to_the_same_bits, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(test_file_of_another_command_is_not_used, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(test_damaged_file_is_not_used, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(test_message_says_why_nothing_is_kept, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(test_bytes_of_the_file_never_change, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(test_contradictory_bytes_are_not_used, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
