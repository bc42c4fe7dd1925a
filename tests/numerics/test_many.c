/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Many mutations of the whole mixture over all hard scenes and those of the forced tests: no NaN, infinity or negative
 * value may reach a film. Prints how many were caught, and where: in a contribution (by kind), or as a proposal that
 * failed (by name). Invalid operations stop the program. 3 10^5 mutations; FULL=1: 10^8 by make test-numerics, 10^7 in
 * make test.
 */
#include "worker/render/render.h"
#include "tests/numerics/rows.h"
#include "tests/support/chains.h"
#include "tests/support/hard_scenes.h"
#include "tests/support/stats.h"
#include "tests/worker/render/mutation/scenes.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static struct {
	uint64_t mutations, invalid_film_values, counters[BATCH_COUNTERS], strategy[STRATEGY_COUNTERS];
} totals;

static void run_chains(struct world *w, const char *name, unsigned depth, uint64_t mutations)
{
	enum { CHAINS = 16, PIECE = 1 << 20 };
	struct chains_result r;
	for (uint64_t done = 0; done < mutations; done += PIECE) {
		uint64_t piece = mutations - done < PIECE ? mutations - done : PIECE;
		struct chains_options options = {.min_depth = 1,
						 .max_depth = depth,
						 .chains = CHAINS,
						 .bootstrap = 2048,
						 .steps = piece / CHAINS + 1,
						 .seed = stats_seed(name) + done};
		chains_run(w, &options, &r);
		totals.invalid_film_values += r.invalid_film_values;
		totals.mutations += r.counters[COUNT_SAMPLES];
		for (int i = 0; i < BATCH_COUNTERS; i++)
			totals.counters[i] += r.counters[i];
		for (int i = 0; i < STRATEGY_COUNTERS; i++)
			totals.strategy[i] += r.strategy[i];
		free(r.xyz);
	}
	world_free(w);
}

static void test_many(void **state)
{
	(void)state;
	static const char *const reasons[] = {"outside",  "missed",   "blocked",    "mode",
					      "singular", "diverged", "iterations", "reverse",
					      "specular", "emitter",  "dark",	    "inapplicable"};
	uint64_t scenes = TEST_SCENES,
		 total = test_is_full() ? getenv("HSLT_TEST_ROWS") ? 100000000 : 10000000 : 300000 / test_scale();
	for (const struct hard_case *h = hard_cases; h->topic; h++)
		scenes++;
	for (int i = 0; i < TEST_SCENES; i++)
		run_chains(make_test_world(test_scenes[i].name), test_scenes[i].name, 12, total / scenes + 1);
	for (const struct hard_case *h = hard_cases; h->topic; h++)
		run_chains(h->build(h->parameter), h->name, h->max_edges < 12 ? 12 : h->max_edges, total / scenes + 1);
	struct rows rows = {0, 0};
	char measured[600];
	int n = snprintf(
		measured, sizeof measured,
		"%llu invalid values in films; caught %llu NaN, %llu infinite, %llu negative; proposals that failed:",
		(unsigned long long)totals.invalid_film_values, (unsigned long long)totals.counters[COUNT_NAN],
		(unsigned long long)totals.counters[COUNT_INFINITE],
		(unsigned long long)totals.counters[COUNT_NEGATIVE]);
	for (int i = STRATEGY_FAIL_FIRST; i < STRATEGY_COUNTERS && n < (int)sizeof measured; i++)
		n += snprintf(measured + n, sizeof measured - (size_t)n, " %s %.2g %%",
			      reasons[i - STRATEGY_FAIL_FIRST],
			      100 * (double)totals.strategy[i] / (double)totals.mutations);
	char name[64];
	snprintf(name, sizeof name, "%.3g in %llu scenes", (double)totals.mutations, (unsigned long long)scenes);
	rows_add(&rows, "many mutations", name, measured, "0 in films", totals.invalid_film_values == 0);
	printf("%s: %s\n", name, measured);
	assert_int_equal(rows.failed, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_many)};
	return cmocka_run_group_tests_name("many mutations", tests, NULL, NULL);
}
