/* SPDX-License-Identifier: Apache-2.0 */
/* Texts about a plan: changes to the request in the units that were asked for, plurals, options for a shell. */
#include "common/plan/plan_text.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static struct plan_request make_request(enum plan_kind kind)
{
	return (struct plan_request){
		.integrator = "hslt", .kind = kind, .width = 64, .height = 32, .max_depth = 8, .spp = 16};
}

static void changes_to_the_request_are_described(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_CHAINS);
	struct plan p;
	struct error e;
	char text[PLAN_TEXT_MAX];
	r.chains = 64;
	r.bootstrap = 4096;
	r.epoch = 100;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	plan_describe_changes(&r, &p, text, sizeof text);
	assert_string_equal(text, "samples per pixel 16 -> 18.75: whole rounds");
	r.chains = 60;
	r.bootstrap = 4000;
	r.spp = 0;
	r.mutations = 1000;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	plan_describe_changes(&r, &p, text, sizeof text);
	assert_string_equal(text, "chains 60 -> 64: a multiple of the 64 leases of a round; bootstrap 4000 -> 4032: a "
				  "multiple of the 64 leases; mutations 1000 -> 6400: whole rounds");
	r = make_request(PLAN_SAMPLES);
	r.groups = 1;
	r.spp = 1;
	r.max_depth = 3;
	assert_int_equal(plan_make(&r, &p, &e), 0);
	plan_describe_changes(&r, &p, text, sizeof text);
	assert_string_equal(text, "");
	plan_describe(&p, text, sizeof text);
	assert_non_null(strstr(text, ": 1 group, rounds of 1 sample per pixel in 4 leases, "));
	assert_non_null(strstr(text, "; 1 round (1 sample per pixel); "));
	r.min_depth = 9;
	assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	assert_string_equal(e.text, "--min-depth 9 is above --max-depth 3");
	r.groups = 65;
	assert_int_equal(plan_make(&r, &p, &e), -EINVAL);
	assert_string_equal(e.text, "--groups 65 is above 64");
}

static void scene_options_are_quoted(void **state)
{
	(void)state;
	struct plan_request r = make_request(PLAN_SAMPLES);
	struct plan p;
	struct error e;
	char text[PLAN_OPTIONS_TEXT_MAX];
	struct plan_scene s = {.define_count = 3,
			       .defines = {{"light", "3"}, {"name", "it's a sun; $x"}, {"none", ""}},
			       .path_count = 2,
			       .paths = {"../lib", "my textures"}};
	assert_int_equal(plan_make(&r, &p, &e), 0);
	plan_print_options_with_scene(&p, 1, &s, text, sizeof text);
	assert_non_null(
		strstr(text, " -D light=3 -D 'name=it'\\''s a sun; $x' -D none= --path ../lib --path 'my textures'"));
	plan_print_options_with_scene(&p, 1, &(struct plan_scene){.define_count = 0}, text, sizeof text);
	assert_null(strstr(text, " -D"));
	char few[40];
	plan_print_options_with_scene(&p, 1, &s, few, sizeof few);
	assert_int_equal(strlen(few), sizeof few - 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(changes_to_the_request_are_described),
		cmocka_unit_test(scene_options_are_quoted),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
