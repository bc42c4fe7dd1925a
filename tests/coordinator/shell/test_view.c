/* A job as JSON: the counters of its strategies, and what is to be said about it. */
#include "coordinator/shell/view.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static struct job_record record(void)
{
	struct job_record r = {.id = 12, .rel_error = -1, .mixture = "independent=0.1,hslt=0.9", .state = "running"};
	struct plan p = {.kind = PLAN_CHAINS, .chains = 1024, .epoch = 100, .mutations = "independent=0.1,hslt=0.9"};
	struct canvas_counts n = {{0}, {{0}}};
	n.counters[COUNT_SAMPLES] = 1024 * 100 * 2;
	n.counters[COUNT_STUCK] = 3;
	n.counters[COUNT_LONGEST_STUCK] = 5210;
	n.strategy[0][STRATEGY_PROPOSED] = 20000;
	n.strategy[1][STRATEGY_PROPOSED] = 180000;
	n.strategy[1][STRATEGY_ACCEPTED] = 90000;
	n.strategy[1][STRATEGY_FAIL_REVERSE] = 11;
	record_take_counted(&r, &p, &n, false);
	return r;
}

static json_int_t whole(const json_t *o, const char *key)
{
	const json_t *n = json_object_get(o, key);
	assert_true(json_is_integer(n));
	return json_integer_value(n);
}

static void json_shows_the_strategies(void **state)
{
	(void)state;
	struct job_record r = record();
	struct job_view v;
	view_of_record(&v, &r);
	json_t *o = view_to_json(&v, NULL);
	const json_t *list = json_object_get(o, "strategies"), *counts = json_object_get(o, "counts");
	assert_int_equal(json_array_size(list), 2);
	const json_t *hslt = json_array_get(list, 1);
	assert_string_equal(json_string_value(json_object_get(hslt, "name")), "hslt");
	assert_int_equal(whole(hslt, "proposed"), 180000);
	assert_int_equal(whole(hslt, "accepted"), 90000);
	assert_int_equal(whole(json_object_get(hslt, "failures"), "reverse"), 11);
	assert_int_equal(whole(json_array_get(list, 0), "proposed"), 20000);
	assert_int_equal(whole(counts, "stuck"), 3);
	assert_int_equal(whole(counts, "longestStuck"), 5210);
	static const char note[] = "3 of 2,048 times a chain accepted nothing during a whole epoch (1,024 chains); longest run: 5,210 rejections";
	assert_string_equal(json_string_value(json_object_get(o, "note")), note);
	assert_string_equal(json_string_value(json_object_get(o, "mixture")), "independent=0.1,hslt=0.9");
	json_decref(o);
	Farm__JobStatus m;
	view_to_wire(&v, &m);
	assert_string_equal(m.note, note);
}

static void json_of_other_jobs_has_none(void **state)
{
	(void)state;
	struct job_record r = {.id = 1, .state = "done"};
	struct job_view v;
	view_of_record(&v, &r);
	json_t *o = view_to_json(&v, NULL);
	assert_true(json_is_array(json_object_get(o, "strategies")) && json_array_size(json_object_get(o, "strategies")) == 0);
	assert_string_equal(json_string_value(json_object_get(o, "note")), "");
	json_decref(o);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(json_shows_the_strategies),
		cmocka_unit_test(json_of_other_jobs_has_none),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
