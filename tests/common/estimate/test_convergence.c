/* SPDX-License-Identifier: Apache-2.0 */
/*
 * When chains are said to disagree (common/estimate/convergence.h), from synthetic images. Each criterion alone, just
 * below and just above its limit: tiles that have not mixed, classes that differ from the bootstrap, groups that differ
 * from each other, chains that stand still. Then the sentences, which must fit however many criteria fail, and the
 * header of the image file.
 */
#include "common/estimate/convergence.h"

#include "common/base/mem.h"
#include "common/exr/image_file.h"
#include "common/exr/exr_read.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { ACROSS = 4, DOWN = 5, TILES = ACROSS * DOWN };

struct fixture {
	struct plan plan;
	struct canvas_image img;
	float r_hat[TILES], tile_error[TILES], tile_share[TILES];
};

/* 64 chains in 16 groups, 20 rounds of 1,000 mutations, without any disagreement. */
static void fixture_init(struct fixture *f)
{
	memset(f, 0, sizeof *f);
	f->plan = (struct plan){.kind = PLAN_CHAINS,
				.width = 400,
				.height = 400,
				.crop_x = 7,
				.crop_y = 11,
				.crop_width = 256,
				.crop_height = 320,
				.groups = 16,
				.parts = 1,
				.chains = 64,
				.epoch = 1000};
	f->img = (struct canvas_image){.width = 256,
				       .height = 320,
				       .rounds = 20,
				       .samples = 64 * 20 * 1000,
				       .b = 2,
				       .tiles_across = ACROSS,
				       .tiles_down = DOWN,
				       .r_hat = f->r_hat,
				       .tile_error = f->tile_error,
				       .tile_energy_share = f->tile_share};
	for (int i = 0; i < TILES; i++) {
		f->r_hat[i] = 1 + 0.002F * (float)i;
		f->tile_error[i] = 0.02F;
		f->tile_share[i] = 1.0F / TILES;
	}
	for (int k = 0; k < PATH_CLASSES; k++)
		f->img.classes[k] = (struct path_class_energy){.difference_t = NAN};
	f->img.classes[path_class(4, PATH_ROUGH)] = (struct path_class_energy){1.5, 0.01, 1.49, 0.01, -1};
	f->img.classes[path_class(4, PATH_REFLECTED_CAUSTIC)] = (struct path_class_energy){0.5, 0.02, 0.51, 0.01, 0.5};
}

static enum convergence_verdict judge_fixture(const struct fixture *f, struct convergence *a)
{
	convergence_judge(&f->plan, &f->img, a);
	assert_true(strlen(a->text) < sizeof a->text);
	assert_int_equal(a->verdict == CHAINS_AGREE, *a->text == 0);
	return a->verdict;
}

static void expect_close(double a, double b, double tolerance)
{
	if (!(fabs(a - b) <= tolerance))
		fail_msg("%.17g is not %.17g", a, b);
}

static void expect_words(const struct convergence *a, const char *words)
{
	if (!strstr(a->text, words))
		fail_msg("'%s' is not in '%s'", words, a->text);
}

static void student_tail_matches_closed_forms(void **state)
{
	(void)state;
	/* Student's t with 1 degree of freedom (Cauchy) has a closed form; so has 2: 1 - t / sqrt(t^2 + 2). Quantiles
	 * of 15 degrees are from tables. */
	for (double t = 0; t < 30; t += 0.7) {
		expect_close(convergence_student_tail(t, 1), 1 - 2 / M_PI * atan(t), 1e-14);
		expect_close(convergence_student_tail(-t, 2), 1 - t / sqrt(t * t + 2), 1e-14);
	}
	expect_close(convergence_student_tail(2.131450, 15), 0.05, 1e-6);
	expect_close(convergence_student_tail(4.072765, 15), 0.001, 1e-8);
	expect_close(convergence_student_tail(2.228139, 10), 0.05, 1e-6);
	expect_close(convergence_student_tail(1.959964, 1000001), 0.05, 1e-6);
	assert_true(convergence_student_tail(1e300, 15) <= 1e-15);
}

static void well_mixed_chains_agree(void **state)
{
	(void)state;
	struct fixture f;
	struct convergence a;
	fixture_init(&f);
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	assert_int_equal(a.tiles, TILES);
	assert_int_equal(a.flagged_tiles, 0);
	expect_close(a.median_r_hat, 1.02, 1e-6);
	expect_close(a.max_r_hat, 1.038, 1e-6);
	assert_int_equal(a.worst_x, 7 + 3 * TILE_SIZE);
	assert_int_equal(a.worst_y, 11 + 4 * TILE_SIZE);
	/* Nothing is known of tiles, or there is no light in them. */
	f.img.r_hat = f.img.tile_error = f.img.tile_energy_share = NULL;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	assert_true(isnan(a.median_r_hat) && isnan(a.max_r_hat));
	fixture_init(&f);
	for (int i = 0; i < TILES; i++)
		f.r_hat[i] = NAN;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	assert_true(isnan(a.median_r_hat) && isnan(a.max_r_hat));
}

static void median_r_hat_skips_tiles_without_light(void **state)
{
	(void)state;
	struct fixture f;
	struct convergence a;
	fixture_init(&f);
	static const float values[] = {3, 1, 1, 2, 1, 9, 2};
	for (int i = 0; i < TILES; i++)
		f.r_hat[i] = i < 7 ? values[i] : NAN;
	judge_fixture(&f, &a);
	expect_close(a.median_r_hat, 2, 0);
	expect_close(a.max_r_hat, 9, 0);
}

static void unmixed_tiles_are_a_disagreement(void **state)
{
	(void)state;
	struct fixture f;
	struct convergence a;
	fixture_init(&f);
	f.r_hat[6] = 1.3F;
	f.tile_error[6] = 0.2F;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_DISAGREE);
	assert_int_equal(a.flagged_tiles, 1);
	expect_close(a.flagged_energy_share, 0.05, 1e-6);
	expect_words(
		&a,
		"chains disagree: they have not mixed in 1 of 20 tiles, with 5 % of the energy (R-hat 1.3 at 135,75)");
	f.tile_error[6] = 0.09F;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	f.tile_error[6] = 0.2F;
	f.r_hat[6] = 1.09F;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	f.r_hat[6] = 1.3F;
	f.tile_share[6] = 0.009F; /* flagged, but too little to matter */
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	assert_int_equal(a.flagged_tiles, 1);
	f.tile_share[6] = 0.011F;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_DISAGREE);
	f.img.rounds = 9;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_TOO_SHORT);
	expect_words(&a,
		     "chains are too short to be judged, 9000 mutations each: they have not mixed in 1 of 20 tiles");
}

static void classes_unlike_the_bootstrap_are_a_disagreement(void **state)
{
	(void)state;
	struct fixture f;
	struct convergence a;
	fixture_init(&f);
	struct path_class_energy *rough = &f.img.classes[path_class(4, PATH_ROUGH)],
				 *both = &f.img.classes[path_class(4, PATH_REFLECTED_CAUSTIC)];
	/* b is too small by 5 %; the two-sided quantile of t with 15 degrees at 5e-6 is 6.91. */
	*rough = (struct path_class_energy){1.5, 0.01, 1.4, 0.01, -6.8};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	rough->difference_t = -7;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_DISAGREE);
	assert_int_equal(a.flagged_classes, 1U << path_class(4, PATH_ROUGH));
	expect_words(&a, "to paths (rough, 3-4 edges) they give 70 % of the light, the bootstrap 75 %");
	/* As significant, but a small part of the light. */
	*rough = (struct path_class_energy){1.5, 0.001, 1.47, 0.001, -20};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	/* A large difference for a small class. */
	fixture_init(&f);
	*both = (struct path_class_energy){0.02, 0.001, 0.015, 0.001, -7};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_DISAGREE);
	*both = (struct path_class_energy){0.009, 0.0001, 0.006, 0.0001, -7};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	/* A class has more energy than in the bootstrap: this counts only if the bootstrap found the class. */
	*both = (struct path_class_energy){0.5, 0.01, 0.6, 0.01, 7};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_DISAGREE);
	*both = (struct path_class_energy){0.1, 0.02, 0.6, 0.01, 30};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	*both = (struct path_class_energy){0, 0, 0.6, 0.01, 60};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	f.plan.groups = 1;
	*both = (struct path_class_energy){0.5, NAN, 0.6, NAN, NAN};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
}

static void groups_that_differ_are_a_disagreement(void **state)
{
	(void)state;
	struct fixture f;
	struct convergence a;
	fixture_init(&f);
	struct path_class_energy *both = &f.img.classes[path_class(4, PATH_REFLECTED_CAUSTIC)];
	*both = (struct path_class_energy){0.1, 0.1, 0.4, 0.099, 1};
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	both->chains_error = 0.102;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_DISAGREE);
	assert_int_equal(a.inconsistent_classes, 1U << path_class(4, PATH_REFLECTED_CAUSTIC));
	assert_int_equal(a.flagged_classes, 0);
	expect_words(
		&a,
		"chains disagree: groups of them differ in paths (reflected caustic, 3-4 edges): 20 +- 5.1 % of the light");
	f.plan.groups = 7;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	f.plan.groups = 16;
	*both = (struct path_class_energy){0.1, 0.1, 0.059, 0.059, 1}; /* too little energy to matter */
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
}

static void stuck_chains_are_a_disagreement(void **state)
{
	(void)state;
	struct fixture f;
	struct convergence a;
	fixture_init(&f);
	f.img.counts.counters[COUNT_STUCK] = 12; /* of 1,280 */
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
	f.img.counts.counters[COUNT_STUCK] = 14;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_DISAGREE);
	expect_words(&a, "in 1.09 % of their epochs of 1000 mutations they accepted nothing");
	f.plan.epoch = 999; /* the epoch is too short to tell much */
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
}

static void independent_samples_always_agree(void **state)
{
	(void)state;
	struct fixture f;
	struct convergence a;
	fixture_init(&f);
	f.r_hat[6] = f.tile_error[6] = 9;
	f.img.counts.counters[COUNT_STUCK] = 1000;
	f.plan.kind = PLAN_SAMPLES;
	f.plan.chains = 0;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_AGREE);
}

/* The sentences of all criteria together must fit; the table has a row for each class with energy. */
static void longest_sentences_fit_their_buffers(void **state)
{
	(void)state;
	struct fixture f;
	struct convergence a;
	char table[CONVERGENCE_TABLE_MAX];
	const struct convergence none = {.verdict = CHAINS_AGREE};
	fixture_init(&f);
	for (int i = 0; i < TILES; i++)
		f.r_hat[i] = f.tile_error[i] = 123.456F;
	for (int k = 0; k < PATH_CLASSES; k++)
		f.img.classes[k] =
			(struct path_class_energy){1.23456789, 0.000123, 0.987654321e-1, 0.123456, -1234.5678};
	f.img.counts.counters[COUNT_STUCK] = 1234;
	assert_int_equal(judge_fixture(&f, &a), CHAINS_DISAGREE);
	expect_words(&a, "in 20 of 20 tiles");
	expect_words(
		&a,
		"and 18 classes more; groups of them differ in paths (rough, 1-2 edges): 4.94 +- 6.2 % of the light");
	expect_words(&a, "they accepted nothing");
	convergence_print_table(f.img.classes, f.img.b, &a, table, sizeof table);
	int lines = 0;
	for (const char *c = table; *c; c++)
		lines += *c == '\n';
	assert_int_equal(lines, PATH_CLASSES + 1);
	fixture_init(&f);
	convergence_print_table(f.img.classes, f.img.b, &none, table, sizeof table);
	assert_non_null(strstr(table, "reflected caustic, 3-4 edges"));
	assert_null(strstr(table, "differs"));
	char note[CONVERGENCE_TEXT_MAX] = "";
	snprintf(a.text, sizeof a.text, "chains disagree");
	convergence_append_note(&a, note, sizeof note);
	convergence_append_note(&a, note, sizeof note);
	assert_string_equal(note, "chains disagree; chains disagree");
	convergence_append_note(&a, note, 36);
	assert_string_equal(note, "chains disagree; chains disagree; c");
	char small[10];
	convergence_print_table(f.img.classes, f.img.b, &none, small, sizeof small);
	assert_true(strlen(small) < sizeof small);
}

/* The image file holds the sentence, and in each pixel the R-hat of its tile, 0 where no chain came. */
static void image_file_records_the_disagreement(void **state)
{
	(void)state;
	struct fixture f;
	struct exr_image x;
	struct error e = {""};
	unsigned char *bytes;
	size_t size, plane = 0;
	fixture_init(&f);
	f.r_hat[6] = 1.3F;
	f.tile_error[6] = 0.2F;
	f.r_hat[5] = NAN;
	f.img.rgb = mem_alloc((size_t)f.img.width * f.img.height * 3, sizeof *f.img.rgb);
	assert_non_null(f.img.rgb);
	assert_int_equal(
		image_file_encode(&f.img, &f.plan, &(struct header_extra){.scene = "a.xml"}, &bytes, &size, &e), 0);
	assert_int_equal(exr_read(bytes, size, &x, &e), 0);
	assert_int_equal(x.channel_count, 4);
	while (strcmp(x.channel_names[plane], "rhat.Y") != 0)
		assert_true(++plane < x.channel_count);
	for (uint32_t y = 0; y < x.height; y++)
		for (uint32_t c = 0; c < x.width; c++) {
			uint32_t tile = y / 64 * ACROSS + c / 64;
			expect_close((double)x.planes[plane][y * x.width + c], tile == 5 ? 0 : (double)f.r_hat[tile],
				     0);
		}
	assert_string_equal(exr_find_attribute(&x, "hslt:agreement")->string, "disagree");
	assert_non_null(strstr(exr_find_attribute(&x, "hslt:disagreement")->string, "in 1 of 20 tiles"));
	assert_non_null(strstr(exr_find_attribute(&x, "hslt:note")->string, "chains disagree"));
	assert_non_null(strstr(exr_find_attribute(&x, "hslt:classes")->string, "reflected caustic, 3-4 edges"));
	expect_close(exr_find_attribute(&x, "hslt:rHatWorst")->number, 1.3, 1e-6);
	exr_image_fini(&x);
	mem_free(bytes);
	f.plan.kind = PLAN_SAMPLES;
	f.img.r_hat = NULL;
	assert_int_equal(
		image_file_encode(&f.img, &f.plan, &(struct header_extra){.scene = "a.xml"}, &bytes, &size, &e), 0);
	assert_int_equal(exr_read(bytes, size, &x, &e), 0);
	assert_int_equal(x.channel_count, 3);
	assert_null(exr_find_attribute(&x, "hslt:agreement"));
	exr_image_fini(&x);
	mem_free(bytes);
	mem_free(f.img.rgb);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(student_tail_matches_closed_forms),
		cmocka_unit_test(well_mixed_chains_agree),
		cmocka_unit_test(median_r_hat_skips_tiles_without_light),
		cmocka_unit_test(unmixed_tiles_are_a_disagreement),
		cmocka_unit_test(classes_unlike_the_bootstrap_are_a_disagreement),
		cmocka_unit_test(groups_that_differ_are_a_disagreement),
		cmocka_unit_test(stuck_chains_are_a_disagreement),
		cmocka_unit_test(independent_samples_always_agree),
		cmocka_unit_test(longest_sentences_fit_their_buffers),
		cmocka_unit_test(image_file_records_the_disagreement),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
