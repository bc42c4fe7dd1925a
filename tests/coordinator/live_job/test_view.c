/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job as JSON, as the status and records show it: counters of strategies, the estimated error or the reason why none
 * is stated, the forecast, and the share of the work that is done. While the job is not over, the core's numbers
 * replace those of its record.
 */
#include "coordinator/live_job/view.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static struct job_record make_record(void)
{
	struct job_record r = {.id = 12, .rel_error = -1, .mixture = "independent=0.1,hslt=0.9", .state = "running"};
	struct plan p = {.kind = PLAN_CHAINS, .chains = 1024, .epoch = 100, .mutations = "independent=0.1,hslt=0.9"};
	struct canvas_counts n = {{0}, {{0}}};
	n.counters[COUNT_SAMPLES] = 1024 * 100 * 2;
	n.counters[COUNT_STUCK] = 3;
	n.counters[COUNT_LONGEST_STUCK] = 5210;
	n.strategies[0][STRATEGY_PROPOSED] = 20000;
	n.strategies[1][STRATEGY_PROPOSED] = 180000;
	n.strategies[1][STRATEGY_ACCEPTED] = 90000;
	n.strategies[1][STRATEGY_FAIL_REVERSE] = 11;
	record_set_counters(&r, &p, &n, false, 0.25);
	return r;
}

static json_int_t get_integer(const json_t *o, const char *key)
{
	const json_t *n = json_object_get(o, key);
	assert_true(json_is_integer(n));
	return json_integer_value(n);
}

static void json_shows_the_strategies(void **state)
{
	(void)state;
	struct job_record r = make_record();
	struct job_view v;
	view_from_record(&v, &r);
	json_t *o = view_to_json(&v, true);
	const json_t *list = json_object_get(o, "strategies"), *counts = json_object_get(o, "counts");
	assert_int_equal(json_array_size(list), 2);
	const json_t *hslt = json_array_get(list, 1);
	assert_string_equal(json_string_value(json_object_get(hslt, "name")), "hslt");
	assert_int_equal(get_integer(hslt, "proposed"), 180000);
	assert_int_equal(get_integer(hslt, "accepted"), 90000);
	assert_int_equal(get_integer(json_object_get(hslt, "failures"), "reverse"), 11);
	assert_int_equal(get_integer(json_array_get(list, 0), "proposed"), 20000);
	assert_int_equal(get_integer(counts, "stuck"), 3);
	assert_int_equal(get_integer(counts, "longestStuck"), 5210);
	static const char note[] =
		"3 of 2,048 chain epochs accepted nothing (1,024 chains); longest run: 5,210 rejections; "
		"25 % of the light is missing: it comes by paths of more edges than are simulated (128; pssmlt: 32)";
	assert_string_equal(json_string_value(json_object_get(o, "note")), note);
	assert_string_equal(json_string_value(json_object_get(o, "mixture")), "independent=0.1,hslt=0.9");
	json_decref(o);
	Farm__JobStatus m;
	view_to_wire(&v, &m);
	assert_string_equal(m.note, note);
}

static void json_without_strategies_has_an_empty_list(void **state)
{
	(void)state;
	struct job_record r = {.id = 1, .state = "done"};
	struct job_view v;
	view_from_record(&v, &r);
	json_t *o = view_to_json(&v, true);
	assert_true(json_is_array(json_object_get(o, "strategies")) &&
		    json_array_size(json_object_get(o, "strategies")) == 0);
	assert_string_equal(json_string_value(json_object_get(o, "note")), "");
	json_decref(o);
}

/* An error that is not stated is null, with the reason beside it, until an image has an error that is stated. */
static void json_says_why_no_error_is_stated(void **state)
{
	(void)state;
	struct job_record r = make_record();
	struct canvas_image img = {.rel_mse = 0.04, .rel_mse_upper = 0.09, .rel_mse_doubt = ERROR_DOUBT_SHORT_CHAINS};
	for (int known = 0; known < 2; known++) {
		struct job_view v;
		img.rel_mse_doubt = known ? ERROR_DOUBT_NONE : ERROR_DOUBT_SHORT_CHAINS;
		record_set_error(&r, &img);
		view_from_record(&v, &r);
		json_t *o = view_to_json(&v, true);
		const char *why = json_string_value(json_object_get(o, "errorDoubt"));
		assert_string_equal(why, known ? "" : "the chains are too short to be judged");
		assert_true(known ? fabs(json_number_value(json_object_get(o, "error")) - 0.3) < 1e-12
				  : json_is_null(json_object_get(o, "error")));
		json_decref(o);
	}
}

static void json_shows_the_forecast(void **state)
{
	(void)state;
	struct job_record r = make_record();
	struct job_view v;
	r.target_error = 0.02;
	for (int i = 1; i < 9; i++)
		forecast_add_look(&r.looks,
				  &(struct forecast_look){1e5 * i, 0.1 * i, 0.05 * i, 0.04 / i, 0.05 / i, 200, 1});
	view_from_record(&v, &r);
	v.eta = 30;
	v.eta_low = 20;
	v.eta_high = -1;
	v.halving_cpu = (struct forecast_range){1, 2, INFINITY};
	v.halving_seconds = (struct forecast_range){1, 2, 3};
	json_t *o = view_to_json(&v, true);
	assert_non_null(o);
	const json_t *half = json_object_get(o, "nextHalving"), *error = json_object_get(o, "errorNow");
	assert_true(json_number_value(json_object_get(error, "high")) == sqrt(0.05 / 8));
	assert_true(json_number_value(json_object_get(json_object_get(half, "cpuSeconds"), "expected")) == 2);
	assert_true(json_is_null(json_object_get(json_object_get(half, "cpuSeconds"), "high")));
	assert_true(json_number_value(json_object_get(json_object_get(o, "etaRange"), "low")) == 20);
	assert_int_equal(json_array_size(json_object_get(o, "looks")), 8);
	json_decref(o);
	strcpy(v.record.state, "done"); /* an ended job has no forecast */
	o = view_to_json(&v, true);
	assert_true(json_is_null(json_object_get(o, "nextHalving")) && json_is_null(json_object_get(o, "etaRange")));
	assert_int_equal(json_array_size(json_object_get(o, "looks")), 8);
	assert_true(json_is_object(json_object_get(o, "errorNow")));
	json_decref(o);
	o = view_to_json(&v, false);
	assert_null(json_object_get(o, "looks"));
	assert_true(json_is_object(json_object_get(o, "agreement")));
	json_decref(o);
}

static void json_shows_the_share_of_machines(void **state)
{
	(void)state;
	struct job_record r = {.id = 1, .state = "running", .owner = "ann"};
	struct job_status s = {.workers = 3,
			       .machines = 8,
			       .share = 2.5,
			       .place = "3 of 8 machines; j4 comes first",
			       .owners_place = "3 of 8 machines; 1 job of another owner comes first",
			       .waiting = "waits for j4",
			       .owners_waiting = "waits for a job of another owner",
			       .looks = &r.looks,
			       .state = JOB_RUNNING};
	struct job_view v;
	Farm__JobStatus wire;
	view_from_record(&v, &r);
	view_add_status(&v, &s);
	json_t *o = view_to_json(&v, true);
	assert_true(get_integer(o, "workers") == 3 && get_integer(o, "machines") == 8);
	assert_true(json_number_value(json_object_get(o, "share")) == 2.5);
	assert_string_equal(json_string_value(json_object_get(o, "owner")), "ann");
	assert_string_equal(json_string_value(json_object_get(o, "place")), s.place);
	json_decref(o);
	view_to_wire(&v, &wire);
	assert_true(wire.workers == 3 && wire.share == 2.5);
	assert_string_equal(wire.owner, "ann");
	assert_string_equal(wire.place, s.place);
	view_hide_other_owners(&v);
	view_to_wire(&v, &wire);
	assert_string_equal(wire.place, "3 of 8 machines; 1 job of another owner comes first");
	assert_string_equal(wire.why, "waits for a job of another owner");
	view_from_record(&v, &r);
	o = view_to_json(&v, true);
	assert_true(json_is_null(json_object_get(o, "share")));
	json_decref(o);
}

/* While a job is not over, the core's numbers replace those of its record; all other fields of the record stay. */
static void numbers_of_the_core_replace_those_of_the_record(void **state)
{
	(void)state;
	struct job_record r = {.id = 1, .state = "queued", .name = "a", .priority = 1, .b = 7, .cpu_seconds = 9};
	struct job_status s = {.priority = -3,
			       .progress = 0.25,
			       .rounds = 4,
			       .mutations = 5,
			       .leases_merged = 6,
			       .verify = 0.5,
			       .bootstrap_seconds = 8,
			       .rate = 10,
			       .eta = 11,
			       .eta_low = 12,
			       .eta_high = 13,
			       .leases = 14,
			       .counts = {.repeats = 15},
			       .why = "a lease failed",
			       .looks = &r.looks,
			       .state = JOB_RUNNING};
	struct job_view v;
	view_from_record(&v, &r);
	view_add_status(&v, &s);
	assert_string_equal(v.record.state, "running");
	assert_string_equal(v.record.why, "a lease failed");
	assert_string_equal(v.record.name, "a");
	assert_true(v.record.priority == -3 && v.record.progress == 0.25 && v.record.rounds == 4 &&
		    v.record.mutations == 5 && v.record.leases_merged == 6 && v.record.verify == 0.5 &&
		    v.record.bootstrap_seconds == 8 && v.record.counts.repeats == 15);
	assert_true(v.rate == 10 && v.eta == 11 && v.eta_low == 12 && v.eta_high == 13 && v.leases == 14);
	assert_true(v.record.b == 7 && v.record.cpu_seconds == 9 && v.reading == -1);
	s.rate = s.bootstrap_seconds = s.eta = s.eta_low = NAN;
	s.eta_high = INFINITY;
	view_add_status(&v, &s);
	assert_true(v.rate == 0 && v.record.bootstrap_seconds == 0);
	assert_true(v.eta == -1 && v.eta_low == -1 && v.eta_high == -1);
}

/* The estimates as hslt-submit --estimate receives them. */
static void estimates_are_sent_on_request(void **state)
{
	(void)state;
	struct job_record r = make_record();
	struct job_view v;
	static struct view_looks looks;
	Farm__JobStatus wire;
	for (int i = 1; i < 9; i++)
		forecast_add_look(&r.looks,
				  &(struct forecast_look){1e5 * i, 0.1 * i, 0.05 * i, 0.04 / i, 0.05 / i, 200, 1});
	view_from_record(&v, &r);
	view_to_wire(&v, &wire);
	assert_int_equal(wire.n_looks, 0);
	view_looks_to_wire(&v, &looks, &wire);
	assert_int_equal(wire.n_looks, 8);
	const Farm__Look *l = wire.looks[7];
	assert_true(l->work == 1e5 * 8 && l->cpu_seconds == 0.1 * 8 && l->seconds == 0.05 * 8 &&
		    l->rel_mse == 0.04 / 8 && l->rel_mse_upper == 0.05 / 8 && l->degrees == 200 && l->doubtful);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(json_shows_the_strategies),
		cmocka_unit_test(json_without_strategies_has_an_empty_list),
		cmocka_unit_test(json_says_why_no_error_is_stated),
		cmocka_unit_test(json_shows_the_forecast),
		cmocka_unit_test(json_shows_the_share_of_machines),
		cmocka_unit_test(numbers_of_the_core_replace_those_of_the_record),
		cmocka_unit_test(estimates_are_sent_on_request),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
