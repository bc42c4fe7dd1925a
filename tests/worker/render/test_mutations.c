/* SPDX-License-Identifier: Apache-2.0 */
/* The syntax of mixtures of mutations: the spelling in a plan is read back unchanged, every other one is refused. */
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static void canonical_spelling_is_unchanged(void **state)
{
	(void)state;
	static const char *const texts[] = {NULL, "", "hslt", "hslt=0.9,independent=0.1", "independent,hslt=2e-1"};
	struct render_summary summary = {.brightness_bound = 1};
	struct error e;
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
		char once[PLAN_MUTATIONS_MAX], twice[PLAN_MUTATIONS_MAX];
		assert_int_equal(render_canonical_mutations(texts[i], &summary, once, &e), 0);
		assert_true(plan_strategy_count(once) >= 0);
		assert_int_equal(render_canonical_mutations(once, &summary, twice, &e), 0);
		assert_memory_equal(once, twice, sizeof once); /* the bytes after the text are zero as well */
	}
}

static void other_texts_are_refused(void **state)
{
	(void)state;
	static const char *const texts[] = {",",
					    "hslt,",
					    ",hslt",
					    "hslt,,independent",
					    "hslt=",
					    "hslt=0",
					    "hslt=-1",
					    "hslt=nan",
					    "hslt=inf",
					    "hslt=1x",
					    "hslt=1=1",
					    "hslt@",
					    "hslt@=1",
					    "=1",
					    "1",
					    "hslt =1",
					    "Hslt",
					    "hslt\n",
					    "hslt=1,hslt=1,hslt=1,hslt=1,hslt=1,hslt=1,hslt=1,hslt=1,hslt=1"};
	struct render_summary summary = {.brightness_bound = 1};
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
		char canonical[PLAN_MUTATIONS_MAX];
		struct error e = {""};
		assert_int_equal(render_canonical_mutations(texts[i], &summary, canonical, &e), -EINVAL);
		assert_true(strlen(e.text) > 10);
	}
	char longest[PLAN_MUTATIONS_MAX + 1] = "", canonical[PLAN_MUTATIONS_MAX];
	memset(longest, 'a', PLAN_MUTATIONS_MAX);
	assert_int_equal(render_canonical_mutations(longest, &summary, canonical, NULL), -EINVAL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(canonical_spelling_is_unchanged),
		cmocka_unit_test(other_texts_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
