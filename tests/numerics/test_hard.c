/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numerically hard scenes (tests/support/hard_scenes.h), one row each. Each strategy alone must leave the distribution
 * of bdpt's paths unchanged (tests/support/stationary.h: level 1e-6; every 16th of its last paths passes path_check),
 * and chains of the whole mixture must bring no NaN, infinity or negative value to their film. FULL=1: ten times the
 * mutations.
 */
#include "worker/render/render.h"
#include "tests/numerics/rows.h"
#include "tests/support/chains.h"
#include "tests/support/hard_scenes.h"
#include "tests/support/stationary.h"
#include "tests/support/stats.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static struct rows rows;
static uint64_t mutations, caught_counts[3], invalid_film_values;

static uint64_t count_invalid(const uint64_t *counters)
{
	return counters[COUNT_NAN] + counters[COUNT_INFINITE] + counters[COUNT_NEGATIVE];
}

static void run_case(const struct hard_case *h)
{
	static struct stationary_result s;
	static struct chains_result c;
	char test[128], measured[800];
	struct world *w = h->build(h->parameter);
	stationary_disable_roulette(w);
	snprintf(test, sizeof test, "%s %s", h->topic, h->name);
	unsigned factor = test_is_full() ? 10 : 1;
	struct stationary_options mutation_options = {h->mutation, h->min_edges, h->max_edges,
						      24 * factor, 400 * factor, STATIONARY_NO_FAULT};
	stationary_run(w, test, &mutation_options, &s);
	struct chains_options mixture_options = {.min_depth = 1,
						 .max_depth = h->max_edges < 8 ? 8 : h->max_edges,
						 .chains = 16,
						 .bootstrap = 2048,
						 .steps = 1000 * factor / test_scale(),
						 .seed = stats_seed(test)};
	chains_run(w, &mixture_options, &c);
	double proposals = (double)s.proposals,
	       walks = (double)(s.strategy[STRATEGY_WALKS] - s.strategy[STRATEGY_REVERSE_WALKS]);
	double failed = (double)(s.strategy[STRATEGY_FAIL_SINGULAR] + s.strategy[STRATEGY_FAIL_DIVERGED] +
				 s.strategy[STRATEGY_FAIL_ITERATIONS]);
	snprintf(
		measured, sizeof measured,
		"%s: accepts %.1f %%, %.1f %% of walks do not converge, reverse fails %.2f %%, p %.2g by %s (%+.2g %% +- "
		"%.2g %%), finds %.1f %%; mixture: accepts %.1f %%, b %.3g, caught %llu, longest stuck %llu%s%s",
		h->mutation, 100 * (double)s.accepted / proposals, walks > 0 ? 100 * failed / walks : 0,
		100 * (double)s.strategy[STRATEGY_FAIL_REVERSE] / proposals, s.p,
		s.worst_function >= 0 ? stationary_function_name(s.worst_function) : "nothing",
		s.worst_function >= 0 ? 100 * s.bias[s.worst_function] : 0,
		s.worst_function >= 0 ? 100 * s.error[s.worst_function] : 0, 100 * s.detectable_block_bias,
		100 * (double)c.counters[COUNT_ACCEPTED] / (double)c.counters[COUNT_SAMPLES], c.normalization,
		(unsigned long long)count_invalid(c.counters), (unsigned long long)c.counters[COUNT_LONGEST_STUCK],
		s.failure[0] ? "; " : "", s.failure);
	rows_add(&rows, h->topic, h->name, measured, "p > 1e-6; 0 caught; 0 in the film",
		 stationary_passes(&s) && !c.invalid_film_values && !count_invalid(c.counters));
	mutations += s.proposals + c.counters[COUNT_SAMPLES];
	for (int i = 0; i < 3; i++)
		caught_counts[i] += s.counters[COUNT_NAN + i] + c.counters[COUNT_NAN + i];
	invalid_film_values += c.invalid_film_values;
	free(c.xyz);
	world_free(w);
}

static void test_hard(void **state)
{
	(void)state;
	const char *only = getenv("CASE");
	for (const struct hard_case *h = hard_cases; h->topic; h++)
		if (!only || strstr(h->topic, only))
			run_case(h);
	printf("hard scenes: %u cases, %u failed; %llu mutations, caught %llu NaN, %llu infinite, %llu negative; %llu in films\n",
	       rows.cases, rows.failed, (unsigned long long)mutations, (unsigned long long)caught_counts[0],
	       (unsigned long long)caught_counts[1], (unsigned long long)caught_counts[2],
	       (unsigned long long)invalid_film_values);
	assert_int_equal(rows.failed, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_hard)};
	return cmocka_run_group_tests_name("hard scenes", tests, NULL, NULL);
}
