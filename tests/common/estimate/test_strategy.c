/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Counters of mutation strategies: rounds add up exactly, each batch once; a batch with impossible counts is refused;
 * the printed table, the JSON and the image header show the same numbers, and every counter has a name.
 */
#include "common/estimate/strategy.h"

#include "common/base/mem.h"
#include "common/exr/header.h"
#include "common/json/estimate_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

static struct plan make_plan(void)
{
	struct plan_request r = {.integrator = "hslt",
				 .kind = PLAN_CHAINS,
				 .width = 20,
				 .height = 10,
				 .max_depth = 4,
				 .chains = 4,
				 .groups = 2,
				 .bootstrap = 16,
				 .epoch = 1000,
				 .mutations = 8000,
				 .mixture = "independent=0.1,hslt=0.9"};
	struct plan p;
	struct error e;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	assert_true(p.parts == 2 && p.rounds == 2);
	return p;
}

/* The result of a lease of one chain without tiles: nothing lands in the crop. */
static struct batch make_batch(uint64_t epoch, uint32_t group, uint32_t part)
{
	const struct plan p = make_plan();
	struct batch b = {.key = {1, LEASE_RENDER, group, part, epoch}, .strategy_count = 2, .state_count = 1};
	b.states = mem_alloc(1, sizeof *b.states);
	b.states[0] = (struct chain_state){mem_alloc(4, 1), 4};
	b.moment_count = batch_moment_count(&p, LEASE_RENDER);
	b.moments = mem_alloc(b.moment_count, sizeof *b.moments);
	b.counters[COUNT_SAMPLES] = 1000;
	b.counters[COUNT_ACCEPTED] = 480;
	b.counters[COUNT_STUCK] = group == 1;
	b.counters[COUNT_LONGEST_STUCK] = 910 + group;
	b.strategies[0][STRATEGY_PROPOSED] = 100;
	b.strategies[0][STRATEGY_ACCEPTED] = 7;
	b.strategies[0][STRATEGY_FAIL_DARK] = 91;
	b.strategies[1][STRATEGY_PROPOSED] = 900;
	b.strategies[1][STRATEGY_ACCEPTED] = 450 + 10 * group + part;
	b.strategies[1][STRATEGY_RAYS] = UINT64_C(1) << 50;
	b.strategies[1][STRATEGY_WALKS] = 800;
	b.strategies[1][STRATEGY_ITERATIONS] = 2400;
	b.strategies[1][STRATEGY_REVERSE_WALKS] = 500;
	b.strategies[1][STRATEGY_FAIL_OUTSIDE] = 90;
	b.strategies[1][STRATEGY_FAIL_INAPPLICABLE] = 9;
	return b;
}

static void each_batch_is_counted_once(void **state)
{
	(void)state;
	struct plan p = make_plan();
	struct canvas *c;
	struct canvas_counts n;
	struct canvas_image img;
	assert_int_equal(canvas_new(&c, &p, -30, NULL, NULL), 0);
	for (uint64_t epoch = 0; epoch < 2; epoch++)
		for (uint32_t i = 0; i < 4 - epoch; i++) { /* the second round stays open */
			struct batch b = make_batch(epoch, i / 2, i % 2);
			struct error e;
			assert_int_equal(batch_check(&b, &p, &e), 0);
			assert_int_equal(canvas_add(c, &b, NULL), 0);
			assert_int_equal(canvas_add(c, &b, NULL), -EEXIST);
			batch_fini(&b);
		}
	canvas_sum_counts(c, false, &n);
	assert_int_equal(n.strategies[0][STRATEGY_PROPOSED], 400);
	assert_int_equal(n.strategies[1][STRATEGY_ACCEPTED], 4 * 450 + 22);
	assert_true(n.strategies[1][STRATEGY_RAYS] == UINT64_C(1) << 52);
	assert_int_equal(n.strategies[2][STRATEGY_PROPOSED], 0);
	assert_int_equal(n.counters[COUNT_STUCK], 2);
	assert_int_equal(n.counters[COUNT_LONGEST_STUCK], 911);
	assert_int_equal(canvas_image_init(c, false, &img, NULL), 0);
	assert_memory_equal(&img.counts, &n, sizeof n);
	canvas_image_fini(&img);
	canvas_sum_counts(c, true, &n);
	assert_int_equal(n.strategies[0][STRATEGY_FAIL_DARK], 7 * 91);
	assert_int_equal(n.strategies[1][STRATEGY_ACCEPTED], 7 * 450 + 22 + 11);
	assert_int_equal(n.counters[COUNT_LONGEST_STUCK], 911);
	canvas_free(c);
}

static void expect_batch_check(const struct plan *p, struct batch *b, int rc)
{
	struct error e = {""};
	assert_int_equal(batch_check(b, p, &e), rc);
	batch_fini(b);
}

static void batch_with_impossible_counts_is_refused(void **state)
{
	(void)state;
	struct plan p = make_plan(), without = p;
	struct batch b = make_batch(0, 0, 0);
	memset(without.mutations, 0, sizeof without.mutations);
	expect_batch_check(&without, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.strategy_count = 0;
	expect_batch_check(&p, &b, 0);
	b = make_batch(0, 0, 0);
	b.strategy_count = 1;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.strategy_count = UINT32_MAX;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.strategies[1][STRATEGY_PROPOSED]++;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.strategies[0][STRATEGY_ACCEPTED] = 101;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.strategies[0][STRATEGY_FAIL_INAPPLICABLE] = 101;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.strategies[1][STRATEGY_RAYS] = UINT64_C(1) << 56;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.strategies[0][STRATEGY_FAIL_OUTSIDE] = 3; /* one too many, together with the proposals that were accepted or
						     * failed otherwise */
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.counters[COUNT_ACCEPTED] = 456;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.counters[COUNT_LONGEST_STUCK] = 1001;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(1, 0, 0);
	b.counters[COUNT_LONGEST_STUCK] = 1001;
	expect_batch_check(&p, &b, 0);
	b = make_batch(0, 0, 0);
	b.counters[COUNT_STATES_LOST] = 2;
	expect_batch_check(&p, &b, -EBADMSG);
	b = make_batch(0, 0, 0);
	b.counters[COUNT_RAYS_SHADOW] = UINT64_C(1) << 40;
	expect_batch_check(&p, &b, -EBADMSG);
}

/* Checks n samples with this sum and this sum of squares. */
static void expect_sums(uint64_t n, double sum, double square, int rc)
{
	struct plan p = make_plan();
	struct batch b = make_batch(0, 0, 0);
	b.counters[COUNT_INDEPENDENT] = n;
	b.independent_sum = sum;
	b.independent_square = square;
	expect_batch_check(&p, &b, rc);
}

static void impossible_sums_of_samples_are_refused(void **state)
{
	(void)state;
	expect_sums(0, 0, 0, 0);
	expect_sums(0, 1, 1, -EBADMSG);
	expect_sums(4, 8, 16, 0);	   /* all samples are equal */
	expect_sums(4, 8, 64, 0);	   /* one sample has all of it */
	expect_sums(4, 8, 15.9, -EBADMSG); /* violates the Cauchy-Schwarz inequality */
	expect_sums(4, 8, 64.1, -EBADMSG);
	expect_sums(4, 8, 0, -EBADMSG);
	expect_sums(4, 1e-200, 0, 0); /* the squares underflow */
	expect_sums(1, 1.7e308, 1.7e308, -EBADMSG);
	expect_sums(1, 1e100, 1e200, -EBADMSG); /* no float is that large */
	expect_sums(4, -8, 64, -EBADMSG);
	expect_sums(4, (double)INFINITY, (double)INFINITY, -EBADMSG);
	expect_sums(4, (double)NAN, 1, -EBADMSG);
}

static void tables_are_readable(void **state)
{
	(void)state;
	struct plan p = make_plan();
	struct canvas_counts n = {{0}, {{0}}};
	char text[STRATEGY_TABLE_MAX], small[40];
	struct batch b = make_batch(0, 1, 0);
	strategy_print_table(p.mutations, &n, text, sizeof text);
	assert_string_equal(text, "");
	strategy_print_note(&p, &n, false, text, sizeof text);
	assert_string_equal(text, "");
	strategy_print_note(&p, &n, true, text, sizeof text);
	assert_string_equal(text, "the image is black: none of the 16 bootstrap samples found light");
	memcpy(n.strategies, b.strategies, sizeof n.strategies);
	memcpy(n.counters, b.counters, sizeof n.counters);
	n.strategies[1][STRATEGY_RAYS] = 1800;
	n.strategies[0][STRATEGY_PROPOSED] = 1234567;
	strategy_print_table(p.mutations, &n, text, sizeof text);
	static const char expected[] =
		"strategy                      proposals accepted% rays/prop          walks iter/walk  reverse walks  failed%"
		"  failures in % of proposals\n"
		"independent                   1,234,567      0.00      0.00              0         -              0     0.01"
		"  dark 0.00737\n"
		"hslt                                900     51.11      2.00            800      3.00            500    11.00"
		"  outside 10 inapplicable 1\n";
	assert_string_equal(text, expected);
	n.counters[COUNT_NAN] = n.counters[COUNT_NEGATIVE] = 1000;
	n.counters[COUNT_SAMPLES] = 8000;
	strategy_print_note(&p, &n, true, text, sizeof text);
	assert_string_equal(
		text,
		"the image is black: no sample found light; 2,000 contributions were NaN, infinite or negative, and "
		"were left out; 1 of 8 chain epochs accepted nothing (4 chains); longest run: "
		"911 rejections");
	strategy_append_overlong(0.0009, text, sizeof text); /* too little to mention */
	assert_null(strstr(text, "missing"));
	strategy_append_overlong(0.25, text, sizeof text);
	assert_non_null(strstr(
		text,
		"911 rejections; 25 % of the light is missing: it comes by paths of more edges than are simulated "
		"(128; pssmlt: 32)"));
	strategy_print_table(p.mutations, &n, small, sizeof small); /* cut, and terminated */
	assert_int_equal(strlen(small), sizeof small - 1);
	strategy_print_lines(p.mutations, &n, text, sizeof text);
	assert_non_null(strstr(text, "independent: proposed 1234567 accepted 7 "));
	assert_non_null(strstr(
		text,
		"\nhslt: proposed 900 accepted 460 rays 1800 walks 800 iterations 2400 reverseWalks 500 outside 90 "));
	/* The widest possible numbers. */
	memset(n.strategies, 0xff, sizeof n.strategies);
	memset(n.counters, 0xff, sizeof n.counters);
	p.chains = UINT32_MAX;
	p.epoch = 1;
	strategy_print_note(&p, &n, true, text, sizeof text);
	strategy_append_overlong(0.00123456, text, sizeof text);
	assert_true(strlen(text) < STRATEGY_NOTE_MAX);
	char lines[5120]; /* the size of the header's buffer for them */
	strategy_print_lines("aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa,b,c,d,e,f,g,h", &n, lines, sizeof lines);
	assert_true(strlen(lines) < sizeof lines - 1);
	strategy_print_table("aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa,b,c,d,e,f,g,h", &n, text, sizeof text);
	assert_true(strlen(text) < sizeof text - 1 && text[strlen(text) - 1] == '\n');
	batch_fini(&b);
}

static void counters_survive_json(void **state)
{
	(void)state;
	struct plan p = make_plan();
	struct canvas_counts n = {{0}, {{0}}}, back = {{0}, {{0}}};
	struct batch b = make_batch(0, 1, 0);
	memcpy(n.strategies, b.strategies, sizeof n.strategies);
	json_t *list = strategy_to_json(p.mutations, &n);
	assert_int_equal(json_array_size(list), 2);
	assert_string_equal(json_string_value(json_object_get(json_array_get(list, 1), "name")), "hslt");
	strategy_from_json(list, &back);
	assert_memory_equal(back.strategies, n.strategies, sizeof n.strategies);
	json_object_set_new(json_array_get(list, 0), "proposed", json_integer(-1));
	json_object_set_new(json_array_get(list, 0), "accepted", json_string("7"));
	json_object_del(json_array_get(list, 1), "failures");
	strategy_from_json(list, &back);
	assert_true(back.strategies[0][STRATEGY_PROPOSED] == 0 && back.strategies[0][STRATEGY_ACCEPTED] == 0);
	assert_true(back.strategies[1][STRATEGY_FAIL_OUTSIDE] == 0 && back.strategies[1][STRATEGY_PROPOSED] == 900);
	json_decref(list);
	strategy_from_json(NULL, &back);
	assert_true(back.strategies[1][STRATEGY_PROPOSED] == 0);
	batch_fini(&b);
}

static const char *find_attribute(const struct header *h, const char *name)
{
	for (size_t i = 0; i < h->count; i++)
		if (strcmp(h->attributes[i].name, name) == 0)
			return h->attributes[i].string;
	return NULL;
}

static void image_header_states_the_strategies(void **state)
{
	(void)state;
	static struct header h;
	struct plan p = make_plan();
	struct canvas_image img = {.width = 20, .height = 10, .rounds = 2};
	struct header_extra x = {.date = ""};
	struct batch b = make_batch(0, 1, 0);
	memcpy(img.counts.strategies, b.strategies, sizeof b.strategies);
	memcpy(img.counts.counters, b.counters, sizeof b.counters);
	header_fill(&h, &img, &p, &x);
	assert_string_equal(find_attribute(&h, "hslt:mixture"), "independent=0.1,hslt=0.9");
	assert_non_null(strstr(find_attribute(&h, "hslt:options"), "--mutations independent=0.1,hslt=0.9 "));
	assert_non_null(strstr(find_attribute(&h, "hslt:strategies"), "hslt: proposed 900 accepted 460 "));
	assert_string_equal(find_attribute(&h, "hslt:stuck"), "1");
	assert_string_equal(find_attribute(&h, "hslt:longestStuck"), "911");
	assert_non_null(strstr(find_attribute(&h, "hslt:note"), "1 of 1 chain epochs accepted nothing"));
	img.counts.counters[COUNT_STATES_LOST] = 3;
	header_fill(&h, &img, &p, &x);
	assert_non_null(strstr(find_attribute(&h, "hslt:note"),
			       "3 of 1 chain epochs ended in a state that could not be read back"));
	img.counts.counters[COUNT_STUCK] = img.counts.counters[COUNT_STATES_LOST] = 0;
	memset(p.mutations, 0, sizeof p.mutations);
	header_fill(&h, &img, &p, &x);
	assert_null(find_attribute(&h, "hslt:mixture"));
	assert_null(find_attribute(&h, "hslt:strategies"));
	assert_null(find_attribute(&h, "hslt:note"));
	batch_fini(&b);
}

static void counters_have_distinct_names(void **state)
{
	(void)state;
	for (int i = 0; i < STRATEGY_COUNTERS; i++) {
		assert_true(*strategy_counter_name((enum strategy_counter)i) != 0);
		for (int k = 0; k < i; k++)
			assert_string_not_equal(strategy_counter_name((enum strategy_counter)i),
						strategy_counter_name((enum strategy_counter)k));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_batch_is_counted_once),
		cmocka_unit_test(batch_with_impossible_counts_is_refused),
		cmocka_unit_test(impossible_sums_of_samples_are_refused),
		cmocka_unit_test(tables_are_readable),
		cmocka_unit_test(counters_survive_json),
		cmocka_unit_test(image_header_states_the_strategies),
		cmocka_unit_test(counters_have_distinct_names),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
