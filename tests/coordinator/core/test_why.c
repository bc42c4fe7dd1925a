/* SPDX-License-Identifier: Apache-2.0 */
/* A waiting job gives its reason in each state in which a job can wait, and no reason while a worker computes for it.
 * Also from which workers results may still arrive. */
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { LINES_MAX = 24 };

static const struct {
	const char *lines[LINES_MAX]; /* the events that lead to the state */
	const char *reason;	      /* the reason that job 1 gives then; "": it does not wait */
} cases[] = {
	{{"[0] submit -> j1 submitted, j1 is queued"}, "no worker is connected"},
	{{"[0] submit -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 -> -"}, "no worker asks for work"},
	{{"[0] w1 joins A threads=1 -> -", "[0] w1 wants 1 -> -",
	  "[0] submit groups=2 -> j1 submitted, j1 is queued, j1 is bootstrap, w1 gets j1 g0 p0 boot"},
	 ""},
	{{"[0] w1 joins A threads=1 -> -", "[0] w1 wants 1 -> -",
	  "[0] submit groups=2 -> j1 submitted, j1 is queued, j1 is bootstrap, w1 gets j1 g0 p0 boot",
	  "[1] w1 batch j1 g0 p0 boot -> merge, merged, w1 gets j1 g1 p0 boot", "[1] w1 leaves -> -",
	  "[2] w2 joins B threads=1 -> -", "[2] w2 wants 1 -> -"},
	 "no connected worker has fingerprint A (1 have others)"},
	{{"[0] submit -> j1 submitted, j1 is queued", "[0] hold order j1 held by ann -> -"}, "held by ann"},
	{{"[0] submit -> j1 submitted, j1 is queued", "[0] hold j1 no room -> -"}, "no room"},
	{{"[0] submit groups=1 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 -> -",
	  "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
	  "[1] w1 batch j1 g0 p0 boot -> merge, merged, j1 prepare"},
	 "the bootstrap is being evaluated"},
	/* all leases are held by a worker that returns nothing: the reason is not given at once, but before others get
	 * copies */
	{{"[0] submit groups=2 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=64 -> -",
	  "[0] w1 wants 65 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot", "[20] w1 heartbeat -> -"},
	 ""},
	{{"[0] submit groups=2 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=64 -> -",
	  "[0] w1 wants 65 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot", "[20] w1 heartbeat -> -",
	  "[40] w1 heartbeat -> -"},
	 "no answer to its leases (2 are out): w1 has had the oldest one for 40 s"},
	{{"[0] submit groups=3 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=64 -> -",
	  "[0] w1 wants 65 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot",
	  "[10] w1 batch j1 g0 p0 boot -> merge, merged", "[14] w1 heartbeat -> -"},
	 ""},
	{{"[0] submit groups=3 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=64 -> -",
	  "[0] w1 wants 65 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot",
	  "[10] w1 batch j1 g0 p0 boot -> merge, merged", "[16] w1 heartbeat -> -"},
	 "no answer to its leases (2 are out): w1 has had the oldest one for 16 s"},
	{{"[0] w1 joins A threads=1 -> -", "[0] w1 wants 1 -> -",
	  "[0] submit groups=1 -> j1 submitted, j1 is queued, j1 is bootstrap, w1 gets j1 g0 p0 boot",
	  "[1] w1 fails j1 g0 p0 boot sorry -> -"},
	 "no worker can compute it; worker w1 failed last: sorry"},
	/* a third worker fails for another reason: the job does not fail while a worker may have room again */
	{{"[0] submit groups=5 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 -> -",
	  "[0] w2 joins A threads=1 -> -", "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
	  "[1] w1 fails j1 g0 p0 boot sorry -> -", "[11] tick -> w1 gets j1 g1 p0 boot",
	  "[12] w1 fails j1 g1 p0 boot sorry -> -", "[20] w2 heartbeat -> -",
	  "[31] w2 wants 1 -> w2 gets j1 g2 p0 boot", "[32] w1 wants 1 -> w1 gets j1 g3 p0 boot",
	  "[33] w2 postpones j1 g2 p0 boot full -> -", "[33] w1 fails j1 g3 p0 boot sorry -> -"},
	 "worker w2 has no room for its scene now: full"},
	{{"[0] submit -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 -> -", "[30] tick -> -"},
	 "no worker responds and is not quarantined (1 connected)"},
	{{"[0] submit groups=2 verify=1 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 name=a -> -",
	  "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
	  "[1] w1 batch j1 g0 p0 boot says x -> noted, w1 gets j1 g1 p0 boot",
	  "[1] w1 batch j1 g1 p0 boot says x -> noted"},
	 "verification waits for a second worker (2 leases have one answer)"},
	{{"[0] submit groups=1 priority=-1 -> j1 submitted, j1 is queued",
	  "[0] submit groups=1 priority=5 -> j2 submitted, j2 is queued", "[0] w1 joins A threads=1 -> -",
	  "[0] w1 wants 1 -> j2 is bootstrap, w1 gets j2 g0 p0 boot"},
	 "waits for j2 of higher priority (5)"},
	{{"[0] submit groups=1 -> j1 submitted, j1 is queued",
	  "[0] submit groups=1 priority=5 -> j2 submitted, j2 is queued", "[0] w1 joins A threads=1 -> -",
	  "[0] w1 wants 1 -> j2 is bootstrap, w1 gets j2 g0 p0 boot", "[0] priority j2 -1 -> -"},
	 "workers busy with j2 (priority -1)"},
	{{"[0] submit -> j1 submitted, j1 is queued", "[0] hold order j1 held by ann -> -", "[0] hold j1 no room -> -"},
	 "held by ann; no room"},
	{{"[0] submit groups=1 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 -> -",
	  "[0] w2 joins A threads=1 -> -", "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
	  "[1] w1 fails j1 g0 p0 boot sorry -> -"},
	 "its workers failed and pause before they try again; the last one: w1: sorry"},
	{{"[0] submit groups=1 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 -> -",
	  "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot", "[1] w1 lacks j1 g0 p0 boot no room -> -"},
	 "no worker can compute it, because of a problem on the machines of w1; the last one: w1: no room"},
	{{"[0] submit groups=1 rounds=1 target=0.5 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 -> -",
	  "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
	  "[1] w1 batch j1 g0 p0 boot -> merge, merged, j1 prepare",
	  "[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
	  "[2] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, j1 evaluate 1"},
	 "its error is being estimated"},
	{{"[0] submit groups=1 rounds=4 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 name=a -> -",
	  "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
	  "[1] w1 batch j1 g0 p0 boot -> merge, merged, j1 prepare",
	  "[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0", "[2] w1 wants 0 -> -",
	  "[2] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1", "[3] w2 joins A threads=1 name=b -> -",
	  "[3] w3 joins A threads=1 name=c -> -", "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
	  "[4] w2 denies j1 g0 p0 e1 no -> -"},
	 "a third worker will decide whether the chain states of group 0 part 0 epoch 1 are wrong: a made them, b refused them"},
};

/* The wait is over once the other scene has gone, and then the job shows its last real failure. */
static void a_lack_of_room_is_no_failure(void **state)
{
	(void)state;
	struct job_status s;
	struct farm *f = transcript_farm_new();
	const char *lines[LINES_MAX] = {
		"[0] submit groups=5 -> j1 submitted, j1 is queued", "[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot", "[1] w1 postpones j1 g0 p0 boot full -> -"};
	transcript_play(f, lines);
	assert_true(farm_job_status(f, 1, 2, &s));
	assert_string_equal(s.waiting, "worker w1 has no room for its scene now: full");
	assert_string_equal(s.why, "");
	farm_free(f);
}

static void every_waiting_state_gives_its_reason(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct job_status s;
		struct farm *f = transcript_farm_new();
		transcript_play(f, cases[i].lines);
		assert_true(farm_job_status(f, 1, 100, &s));
		if (strcmp(s.waiting, cases[i].reason) != 0)
			fail_msg("state %zu: '%s', not '%s'", i, s.waiting, cases[i].reason);
		assert_true(!*s.waiting == !*s.owners_waiting);
		farm_free(f);
	}
}

/* Room on the disk is reserved for jobs that have leases at workers, or that lack nothing else. */
static void results_are_expected_only_of_jobs_that_can_get_them(void **state)
{
	(void)state;
	static const struct {
		const char *line;
		bool expected;
	} steps[] = {
		{"[0] submit groups=2 priority=7 -> j1 submitted, j1 is queued", false},
		{"[0] w1 joins A threads=1 -> -", false},
		{"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot", true},
		{"[1] hold j1 no room -> -", true},
		{"[2] w1 leaves -> -", true},
		{"[2] hold order j1 held by ann -> -", false},
		{"[3] release order j1 -> -", true},
		{"[4] release j1 -> -", false},
		{"[5] cancel j1 -> j1 cancelled, j1 is cancelled (cancelled: cancelled)", false},
	};
	struct farm *f = transcript_farm_new();
	for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) {
		int priority;
		transcript_play(f, (const char *const[]){steps[i].line, NULL});
		if (farm_job_expects_results(f, 1, &priority) != steps[i].expected)
			fail_msg("step %zu", i);
		assert_int_equal(priority, 7);
	}
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(every_waiting_state_gives_its_reason),
					   cmocka_unit_test(a_lack_of_room_is_no_failure),
					   cmocka_unit_test(results_are_expected_only_of_jobs_that_can_get_them)};
	return cmocka_run_group_tests_name("coordinator/core/test_why", tests, NULL, NULL);
}
