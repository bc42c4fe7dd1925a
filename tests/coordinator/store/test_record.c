/* SPDX-License-Identifier: Apache-2.0 */
/* A job's record is read back from its JSON without loss. */
#include "coordinator/store/record.h"

#include "common/base/mem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct error e;

static void record_is_read_back_from_its_json(void **state)
{
	(void)state;
	struct job_record r = {.id = 7,
			       .priority = -3,
			       .exit_code = 4,
			       .has_result = true,
			       .submitted = 1.5e9,
			       .ended = 1.5e9 + 1,
			       .progress = 0.1,
			       .rel_error = 1.0 / 3,
			       .rounds = 12,
			       .mutations = 1u << 31};
	struct job_record back;
	strcpy(r.name, "gr\xc3\xbcn \"quoted\"");
	strcpy(r.state, "done");
	strcpy(r.reason, "time");
	strcpy(r.output, "a b.exr");
	strcpy(r.mixture, "independent=0.1,hslt=0.9");
	strcpy(r.note, "3 of 8 \"times\"");
	strcpy(r.scene_notes, "s.xml:3: \"one\"\ns.xml:4: two");
	strcpy(r.rel_error_doubt, "the chains are too short to be judged");
	r.rel_error_about = 0.218;
	record_set_effects(
		&r, json_pack("[{s:s s:b s:s}]", "name", "dispersion", "on", 0, "why", "`glass` has constant eta"));
	r.stuck = 3;
	r.longest_stuck = 5210;
	for (uint64_t i = 0; i < 2 * STRATEGY_COUNTERS; i++)
		r.strategies[i / STRATEGY_COUNTERS][i % STRATEGY_COUNTERS] = i * i;
	r.convergence = (struct convergence){
		CHAINS_DISAGREE,      12, 3, 0.125, 1.01, 2.5, 64, 128, 1U << 7 | 1, 1U << 19 | 2, 0.25,
		"chains \"disagree\""};
	r.b = 1.0 / 7;
	r.classes[7] = (struct path_class_energy){0.1, 0.01, 0.2, 0.02, -12.5};
	r.classes[0] = (struct path_class_energy){0.3, NAN, 0.4, NAN, NAN};
	r.target_error = 0.02;
	r.cpu_seconds = 100.0 / 3;
	r.bootstrap_cpu_seconds = 1.0 / 3;
	r.bootstrap_seconds = 0.25;
	for (int i = 1; i < 200; i++)
		forecast_add_look(&r.looks,
				  &(struct forecast_look){1e5 * i, 0.1 * i, 0.05 * i, 0.3 / i, 0.4 / i, 20, 0});
	char *text;
	assert_int_equal(record_to_json(&r, &text, &e), 0);
	assert_int_equal(record_from_json(text, strlen(text), &back, &e), 0);
	mem_free(text);
	assert_string_equal(back.name, r.name);
	assert_string_equal(back.output, r.output);
	assert_true(back.rel_error == r.rel_error && back.progress == r.progress && back.ended == r.ended);
	assert_true(back.target_error == r.target_error && back.cpu_seconds == r.cpu_seconds);
	assert_true(back.bootstrap_cpu_seconds == r.bootstrap_cpu_seconds &&
		    back.bootstrap_seconds == r.bootstrap_seconds);
	assert_memory_equal(&back.looks, &r.looks, sizeof r.looks);
	assert_true(back.rounds == 12 && back.mutations == 1u << 31 && back.priority == -3 && back.exit_code == 4);
	assert_true(back.has_result && record_is_ended(&back));
	assert_string_equal(back.mixture, r.mixture);
	assert_string_equal(back.note, r.note);
	assert_string_equal(back.scene_notes, r.scene_notes);
	assert_string_equal(back.rel_error_doubt, r.rel_error_doubt);
	assert_true(back.rel_error_about == r.rel_error_about);
	record_add_doubt(&back);
	assert_non_null(strstr(back.note, "the error is about 21.8 %, its interval is not known: the chains are too"));
	back.note[0] = 0;
	back.rel_error_about = -1; /* as written by an earlier version */
	record_add_doubt(&back);
	assert_string_equal(back.note, "the error's interval is not known: the chains are too short to be judged");
	assert_true(*r.effects != 0);
	assert_string_equal(back.effects, r.effects);
	assert_true(back.stuck == 3 && back.longest_stuck == 5210);
	assert_memory_equal(back.strategies, r.strategies, sizeof r.strategies);
	const struct convergence *a = &back.convergence;
	assert_true(a->verdict == CHAINS_DISAGREE && a->tiles == 12 && a->flagged_tiles == 3 &&
		    a->flagged_energy_share == 0.125);
	assert_true(a->median_r_hat == 1.01 && a->max_r_hat == 2.5 && a->worst_x == 64 && a->worst_y == 128);
	assert_true(a->flagged_classes == r.convergence.flagged_classes &&
		    a->inconsistent_classes == r.convergence.inconsistent_classes && a->stuck_share == 0.25 &&
		    back.b == r.b);
	assert_string_equal(a->text, r.convergence.text);
	assert_memory_equal(&back.classes[7], &r.classes[7], sizeof *r.classes);
	assert_true(back.classes[0].chains == 0.4 && isnan(back.classes[0].difference_t) &&
		    isnan(back.classes[0].chains_error));
	assert_true(back.classes[1].chains == 0 && isnan(back.classes[1].difference_t));
	strcpy(r.output, "caf\xe9"); /* this is no lack of memory */
	assert_int_equal(record_to_json(&r, &text, &e), -EINVAL);
	assert_non_null(strstr(e.text, "the record of job j7 cannot be written: Invalid UTF-8"));
}

static long remaining_allocations; /* allocations of the JSON library before one fails; < 0: none fails */

static void *limited_malloc(size_t size)
{
	return remaining_allocations-- == 0 ? NULL : malloc(size);
}

/* Each allocation fails in turn: a record is written completely, or not at all. */
static void record_is_written_completely_or_not_at_all(void **state)
{
	(void)state;
	struct job_record r;
	char *whole, *text;
	record_init(&r, 7, "box", "ann");
	strcpy(r.mixture, "independent=0.1,hslt=0.9");
	r.convergence.inconsistent_classes = 3;
	r.classes[0] = (struct path_class_energy){0.3, NAN, 0.4, NAN, NAN};
	record_set_effects(&r, json_pack("[{s:s}]", "name", "dispersion"));
	forecast_add_look(&r.looks, &(struct forecast_look){1e5, 0.1, 0.05, 0.3, 0.4, 20, 0});
	assert_int_equal(record_to_json(&r, &whole, &e), 0);
	json_set_alloc_funcs(limited_malloc, free);
	unsigned refused = 0;
	for (long n = 0;; n++) {
		remaining_allocations = n;
		int rc = record_to_json(&r, &text, &e);
		bool over = remaining_allocations >= 0;
		refused += rc != 0;
		if (rc == 0) {
			assert_string_equal(text, whole);
			mem_free(text);
		}
		if (over)
			break;
	}
	json_set_alloc_funcs(malloc, free);
	assert_true(refused > 100);
	mem_free(whole);
}

static int parse_record(const char *text, struct job_record *r)
{
	return record_from_json(text, strlen(text), r, &e);
}

/* A record of an earlier version, one that somebody extended by hand, and texts that are no records. */
static void earlier_records_are_read_and_malformed_ones_refused(void **state)
{
	(void)state;
	struct job_record r;
	char *text;
	assert_int_equal(parse_record("{\"schema\":1,\"id\":7,\"name\":\"a\"}", &r), 0);
	assert_true(*r.mixture == 0 && *r.note == 0 && r.stuck == 0);
	assert_true(r.convergence.verdict == CHAINS_AGREE && isnan(r.convergence.max_r_hat) && r.b == 0);
	assert_int_equal(parse_record("{\"schema\":1,\"id\":7,\"mixture\":\"a,,b\",\"strategies\":7}", &r), 0);
	assert_true(*r.mixture == 0);
	assert_int_equal(parse_record("{}", &r), -EBADMSG);
	assert_int_equal(parse_record("{\"schema\":2}", &r), -EPROTO);
	assert_non_null(strstr(e.text, "version 2"));
	assert_int_equal(parse_record("[", &r), -EBADMSG);
	record_init(&r, 7, "box", "ann");
	assert_true(r.id == 7 && r.rel_error == -1 && r.ended_seen == -1 && !record_is_ended(&r));
	assert_int_equal(record_to_json(&r, &text, &e), 0);
	*strstr(text, "box") = 'f';
	assert_int_equal(parse_record(text, &r), -EBADMSG); /* the checksum is wrong */
	mem_free(text);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(record_is_read_back_from_its_json),
		cmocka_unit_test(earlier_records_are_read_and_malformed_ones_refused),
		cmocka_unit_test(record_is_written_completely_or_not_at_all),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
