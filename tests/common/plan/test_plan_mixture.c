/* SPDX-License-Identifier: Apache-2.0 */
/* The mixture of mutations in a plan: which texts are valid mixtures, and in which texts of the plan they appear. */
#include "common/plan/plan.h"
#include "common/plan/plan_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static struct plan_request make_request(enum plan_kind kind, const char *mixture)
{
	struct plan_request r = {
		.integrator = "hslt", .kind = kind, .width = 64, .height = 32, .max_depth = 8, .spp = 16};
	strncpy(r.mixture, mixture, sizeof r.mixture - 1);
	return r;
}

static void mixture_appears_in_texts_of_the_plan(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS, "independent=0.05,hslt@b2c0=0.95");
	struct plan p;
	struct error e;
	char text[1024];
	assert_int_equal(plan_make(&r, &p, &e), 0);
	assert_string_equal(p.mutations, r.mixture);
	plan_describe(&p, text, sizeof text);
	assert_non_null(strstr(text, "mutations independent=0.05,hslt@b2c0=0.95;"));
	plan_print_options(&p, 1, text, sizeof text);
	assert_non_null(strstr(text, " --mutations independent=0.05,hslt@b2c0=0.95 --chains"));
	*r.mixture = 0;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	plan_print_options(&p, p.rounds, text, sizeof text);
	assert_true(strstr(text, "--mutations") == strstr(text, "--mutations 32768"));
	plan_print_options(&p, 0, text, sizeof text);
	assert_null(strstr(text, "--mutations 0"));
}

static void settings_and_effects_appear_in_options(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS, "hslt=1");
	struct plan p;
	struct error e;
	char text[PLAN_TEXT_MAX];
	strcpy(r.accuracy, "tolerance=1e-05");
	strcpy(r.effects, "-dispersion,+aperture");
	assert_int_equal(plan_make(&r, &p, &e), 0);
	plan_print_options(&p, 1, text, sizeof text);
	assert_non_null(strstr(text, " --set tolerance=1e-05 --effects=-dispersion,+aperture --chains"));
	p.accuracy[40] = 'x'; /* bytes after the end of the text */
	assert_int_equal(plan_check(&p, &e), -EINVAL);
	p.accuracy[40] = 0;
	strcpy(p.effects, "a;b");
	assert_int_equal(plan_check(&p, &e), -EINVAL);
	memset(p.effects, 'a', sizeof p.effects);
	assert_int_equal(plan_check(&p, &e), -EINVAL);
}

static void malformed_mixtures_are_refused(void **state)
{
	(void)state;
	static const char *const bad[] = {",",
					  "a,",
					  ",a",
					  "a,,b",
					  "a b",
					  "a\n",
					  "a\t=1",
					  "a\x7f",
					  "\xc3\xa4",
					  "=1",
					  "a;b",
					  "$a",
					  "a'",
					  "1a",
					  "@b",
					  "a,@b",
					  "a,b,c,d,e,f,g,h,i"};
	struct plan p;
	struct error e;
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		struct plan_request r = make_request(PLAN_CHAINS, bad[i]);
		assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
		assert_non_null(strstr(e.text, "mixture"));
	}
	struct plan_request r = make_request(PLAN_CHAINS, "");
	memset(r.mixture, 'a', sizeof r.mixture); /* no terminating zero */
	assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	r.mixture[sizeof r.mixture - 1] = 0;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	memcpy(p.mutations, "a\0b", 4); /* bytes after the end of the text */
	assert_int_equal(plan_check(&p, &e), -EINVAL);
	r = make_request(PLAN_SAMPLES, "a");
	assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	r = make_request(PLAN_SAMPLES, "");
	assert_int_equal(plan_make(&r, &p, &e), 0);
}

static void entries_are_counted_and_named(void **state)
{
	(void)state;
	char name[8];
	assert_int_equal(plan_strategy_count(""), 0);
	assert_int_equal(plan_strategy_count("hslt"), 1);
	assert_int_equal(plan_strategy_count("a,b,c,d,e,f,g,h"), 8);
	assert_int_equal(plan_strategy_count("independent=0.1,hslt=1e-3"), 2);
	plan_strategy_name("a=1,long@b2c0=0.5,z", 0, name, sizeof name);
	assert_string_equal(name, "a");
	plan_strategy_name("a=1,long@b2c0=0.5,z", 1, name, sizeof name);
	assert_string_equal(name, "long@b2");
	plan_strategy_name("a=1,long@b2c0=0.5,z", 2, name, sizeof name);
	assert_string_equal(name, "z");
	plan_strategy_name("a=1,long@b2c0=0.5,z", 3, name, sizeof name);
	assert_string_equal(name, "");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(mixture_appears_in_texts_of_the_plan),
		cmocka_unit_test(settings_and_effects_appear_in_options),
		cmocka_unit_test(malformed_mixtures_are_refused),
		cmocka_unit_test(entries_are_counted_and_named),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
