/* SPDX-License-Identifier: Apache-2.0 */
/* Runs the farm's simulator for many seeds. FULL=1: for more seeds; HSLT_SIM_SEED=N: for that seed, with all
 * messages. */
#include "tests/sim/sim_world.h"

#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SEEDS = 200, SEEDS_FULL = 10000 };

static void add_result(struct sim_result *sum, const struct sim_result *r)
{
	sum->steps += r->steps;
	sum->merged += r->merged;
	sum->repeats += r->repeats;
	sum->refused += r->refused;
	sum->crashes += r->crashes;
	sum->done += r->done;
	sum->failed += r->failed;
	sum->cancelled += r->cancelled;
	sum->duplicates += r->duplicates;
	sum->timeouts += r->timeouts;
	sum->restarts += r->restarts;
	sum->extended += r->extended;
	sum->verified += r->verified;
	sum->mismatched += r->mismatched;
	sum->lies += r->lies;
	sum->quarantined += r->quarantined;
	sum->hangs += r->hangs;
	sum->hoarded += r->hoarded;
}

static void simulate(void **state)
{
	(void)state;
	const char *single_seed = getenv("HSLT_SIM_SEED"), *full = getenv("FULL");
	uint64_t first = single_seed ? strtoull(single_seed, NULL, 10) : 1;
	uint64_t count = single_seed ? 1 : full && strcmp(full, "1") == 0 ? SEEDS_FULL : SEEDS;
	struct sim_result sum = {0}, r;
	for (uint64_t seed = first; seed < first + count; seed++) {
		const char *violation = sim_run(seed, single_seed != NULL, &r);
		if (violation)
			fail_msg("HSLT_SIM_SEED=%" PRIu64 ": %s", seed, violation);
		add_result(&sum, &r);
	}
	print_message("seeds %" PRIu64 " to %" PRIu64 ": %" PRIu64 " steps, %" PRIu64 " merged, %" PRIu64
		      " repeats, %" PRIu64 " refused, %" PRIu64 " crashes, %" PRIu64 " of them hangs, %" PRIu64
		      " hoarded, "
		      "%" PRIu64 " copies, %" PRIu64 " timeouts, %" PRIu64 " restarts, %" PRIu64 " extended, %" PRIu64
		      " verified, %" PRIu64 " mismatched, %" PRIu64 " lies, %" PRIu64 " quarantined; jobs: %" PRIu64
		      " done, %" PRIu64 " failed, %" PRIu64 " cancelled\n",
		      first, first + count - 1, sum.steps, sum.merged, sum.repeats, sum.refused, sum.crashes, sum.hangs,
		      sum.hoarded, sum.duplicates, sum.timeouts, sum.restarts, sum.extended, sum.verified,
		      sum.mismatched, sum.lies, sum.quarantined, sum.done, sum.failed, sum.cancelled);
	/* The simulated worlds must have enough trouble to be meaningful. */
	if (!single_seed) {
		assert_true(sum.repeats > count && sum.duplicates > count / 4 && sum.timeouts > count / 4);
		assert_true(sum.restarts > count / 2 && sum.extended > count / 2);
		assert_true(sum.verified > 5 * count && sum.lies > count / 4 && sum.quarantined > count / 20);
		assert_true(sum.hangs > count / 2 && sum.hoarded > count);
		assert_true(sum.crashes > count && sum.done > count && sum.cancelled > count / 20);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(simulate)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
