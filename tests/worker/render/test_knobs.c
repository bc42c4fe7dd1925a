/* Settings that trade accuracy for time: the spelling that a plan holds comes back as it is, everything else is refused, and each
 * reaches what works by it. */
#include "tests/support/worlds.h"
#include "worker/halfvec/walk.h"
#include "worker/render/knobs.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

static const char *canonical(const char *text)
{
	static char out[PLAN_KNOBS_MAX];
	struct error e = {""};
	if (render_knobs_canonical(text, out, &e))
		fail_msg("'%s': %s", text ? text : "NULL", e.text);
	return out;
}

static void test_canonical(void **state)
{
	(void)state;
	static const char *const cases[][2] = {
		{NULL, ""}, {"", ""}, {"tolerance=1e-3", ""}, {"tolerance=0.00001", "tolerance=1e-05"},
		{"iterations=30,tolerance=1e-4", "tolerance=0.0001,iterations=30"}, /* in the order of the list */
		{"tolerance=1e-5,tolerance=1e-4", "tolerance=0.0001"}, {"tolerance=1e-5,tolerance=.001", ""},
		{"step-scale=0.33333333", "step-scale=0.333333"}, {"iterations=3e1", "iterations=30"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		assert_string_equal(canonical(cases[i][0]), cases[i][1]);
}

/* A text and its canonical form are worth the same, and the longest fits into a plan. */
static void test_all_at_once(void **state)
{
	(void)state;
	char all[2 * PLAN_KNOBS_MAX] = "", once[PLAN_KNOBS_MAX], twice[PLAN_KNOBS_MAX];
	const struct render_knob *k;
	struct knobs a, b;
	size_t used = 0;
	for (size_t i = 0; (k = render_knob_at(i)) != NULL; i++) {
		double value = k->least + (k->greatest - k->least) * 1.23456789e-5;
		if (k->kind == KNOB_REAL)
			used += (size_t)snprintf(all + used, sizeof all - used, "%s%s=%.17g", i ? "," : "", k->name, value);
		else
			used += (size_t)snprintf(all + used, sizeof all - used, "%s%s=%s", i ? "," : "", k->name, k->sweep[1]);
	}
	assert_int_equal(knobs_read(all, &a, NULL), 0);
	assert_int_equal(render_knobs_canonical(all, once, NULL), 0);
	assert_int_equal(knobs_read(once, &b, NULL), 0);
	assert_memory_equal(&a, &b, sizeof a);
	assert_int_equal(render_knobs_canonical(once, twice, NULL), 0);
	assert_memory_equal(once, twice, sizeof once); /* zeros behind the text too */
	assert_true(strlen(once) + 8 < sizeof once);
	assert_true(plan_text_ok(once, sizeof once));
	size_t entries = 1;
	for (const char *at = once; *at; at++)
		entries += *at == ',';
	for (size_t i = 0; (k = render_knob_at(i)) != NULL; i++)
		entries--;
	assert_int_equal(entries, 0);
}

static void test_list(void **state)
{
	(void)state;
	const struct render_knob *k;
	for (size_t i = 0; (k = render_knob_at(i)) != NULL; i++) {
		char value[40], entry[80];
		assert_true(k->standard >= k->least && k->standard <= k->greatest);
		assert_true(strlen(k->summary) > 20);
		knobs_value(&knobs_default, i, value, sizeof value);
		snprintf(entry, sizeof entry, "%s=%s", k->name, value);
		assert_string_equal(canonical(entry), "");
		bool has_default = false;
		for (size_t s = 0; k->sweep[s]; s++) {
			snprintf(entry, sizeof entry, "%s=%s", k->name, k->sweep[s]);
			const char *got = canonical(entry);
			has_default |= !*got;
			assert_true(!*got || strcmp(got, entry) == 0);
		}
		assert_true(has_default && k->sweep[0] && k->sweep[1]);
	}
}

static void refused(const char *text, const char *reason)
{
	char out[PLAN_KNOBS_MAX];
	struct error e = {""};
	assert_int_equal(render_knobs_canonical(text, out, &e), -EINVAL);
	if (!strstr(e.text, reason))
		fail_msg("'%s': \"%s\" does not say \"%s\"", text, e.text, reason);
}

static void test_refusals(void **state)
{
	(void)state;
	static const char *const texts[] = {",", "tolerance", "tolerance=", "=1", "tolerance=1e-3,", ",tolerance=1e-3", "tolerance=nan",
					    "tolerance=inf", "tolerance=-1", "tolerance=1x", "tolerance= 1", "tolerance=1=1", "Tolerance=1",
					    "iterations=1.5", "iterations=0", "iterations=1e300"};
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
		refused(texts[i], "");
	refused("tolerence=1e-3", "did you mean `tolerance`?");
	refused("tolerance=2", "tolerance is 1e-09 to 1, not '2'");
	refused("iterations=0", "a whole number from 1 to 1000");
	refused("xyzzy=1", "there are tolerance, iterations");
	char longest[3000];
	memset(longest, 'a', sizeof longest - 1);
	longest[sizeof longest - 1] = 0;
	refused(longest, "NAME=VALUE");
}

static void test_walk_limits(void **state)
{
	(void)state;
	struct knobs k;
	assert_int_equal(knobs_read("tolerance=1e-5,iterations=7,least-step=.5,reverse-tolerance=.25", &k, NULL), 0);
	struct walk_limits l = walk_limits_of(&k);
	assert_int_equal(l.iterations, 7);
	assert_true(l.tolerance == 1e-5 && l.least_step == 0.5 && l.back == 0.25 && l.scale == 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_canonical), cmocka_unit_test(test_all_at_once), cmocka_unit_test(test_list),
		cmocka_unit_test(test_refusals),  cmocka_unit_test(test_walk_limits),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
