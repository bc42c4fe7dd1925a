/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Leases that workers cannot compute, as transcripts: which worker pauses, which one tries next, when the job fails,
 * and what the job says it waits for meanwhile.
 */
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static void lease_that_fails_on_three_workers_fails_the_job(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		TRANSCRIPT_START_TWO,
		"[2] w1 fails j1 g0 p0 e0 out of memory -> -",
		"[3] w2 batch j1 g1 p0 e0 -> merge, merged, w2 gets j1 g0 p0 e0",
		"[4] w1 fails j1 g0 p0 e0 stale -> -",
		"[11.9] tick -> -",
		/* ten seconds of pause */
		"[12] tick -> w1 gets j1 g1 p0 e1",
		"[13] w2 fails j1 g0 p0 e0 out of memory -> -",
		"[14] w3 joins A threads=1 -> -",
		"[14] w3 wants 1 -> w3 gets j1 g0 p0 e0",
		"[15] w3 fails j1 g0 p0 e0 out of memory -> w1 loses j1 g1 p0 e1, j1 is failed (failed: w3: out of memory)",
		NULL,
	});
}

static void job_whose_only_worker_never_succeeds_fails(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[1] w1 fails j1 g0 p0 boot no such file -> -",
		"[1] wake -> 11",
		"[11] tick -> w1 gets j1 g1 p0 boot",
		"[12] w1 fails j1 g1 p0 boot no such file -> -",
		"[31] tick -> -",
		"[32] tick -> w1 gets j1 g0 p0 boot",
		"[33] w1 fails j1 g0 p0 boot no such file -> j1 is failed (failed: w1: no such file)",
		NULL,
	});
}

/* One broken worker, however many leases it holds, fails no job that others could compute. */
static void one_broken_worker_fails_no_job(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=5 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=3 -> -",
		"[0] w2 joins A threads=1 -> -",
		"[0] w1 wants 4 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot, "
		"w1 gets j1 g3 p0 boot",
		"[0] w2 wants 1 -> w2 gets j1 g4 p0 boot",
		"[1] w1 fails j1 g0 p0 boot no disk -> -",
		"[1] w1 fails j1 g1 p0 boot no disk -> -",
		"[1] w1 fails j1 g2 p0 boot no disk -> -",
		"[1] w1 fails j1 g3 p0 boot no disk -> -",
		"[1] wake -> 11",
		"[11] w1 wants 1 -> w1 gets j1 g0 p0 boot",
		"[11] w1 fails j1 g0 p0 boot no disk -> -",
		"[31] w2 heartbeat -> w1 gets j1 g1 p0 boot",
		"[31] w1 fails j1 g1 p0 boot no disk -> -",
		"[32] w2 batch j1 g4 p0 boot -> merge, merged, w2 gets j1 g2 p0 boot",
		NULL,
	});
}

/* Leases fail on two workers, which are all: the job fails once a third worker fails, or when one of the two fails
 * again after the pauses. */
static void job_fails_if_all_workers_fail(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=5 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=2 -> -",
		"[0] w2 joins A threads=1 -> -",
		"[0] w1 wants 2 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot",
		"[0] w2 wants 1 -> w2 gets j1 g2 p0 boot",
		"[1] w1 fails j1 g0 p0 boot no mesh -> -",
		"[1] w1 fails j1 g1 p0 boot no mesh -> -",
		"[1] w2 fails j1 g2 p0 boot no mesh -> -",
		"[1] w3 joins A threads=1 -> -",
		"[1] w3 wants 1 -> w3 gets j1 g3 p0 boot",
		"[1] w3 fails j1 g3 p0 boot no mesh -> j1 is failed (failed: w3: no mesh)",
		"[2] submit groups=5 -> j2 submitted, j2 is queued, j2 is bootstrap, w1 gets j2 g0 p0 boot, w2 gets j2 g1 p0 boot, "
		"w3 gets j2 g2 p0 boot, w1 gets j2 g3 p0 boot",
		"[2] w3 leaves -> -",
		"[2] w1 fails j2 g0 p0 boot no mesh -> -",
		"[2] w1 fails j2 g3 p0 boot no mesh -> -",
		"[2] w2 fails j2 g1 p0 boot no mesh -> -",
		"[12] w1 wants 1 -> w1 gets j2 g4 p0 boot, w2 gets j2 g2 p0 boot",
		"[12] w1 fails j2 g4 p0 boot no mesh -> w2 loses j2 g2 p0 boot, j2 is failed (failed: w1: no mesh)",
		NULL,
	});
}

/* Finished work is not lost to one worker, however often it fails and reconnects: the job waits, and says what for. */
static void one_worker_cannot_fail_a_job_with_results(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   TRANSCRIPT_START_TWO,
				   "[2] w2 batch j1 g1 p0 e0 -> merge, merged, w2 gets j1 g1 p0 e1",
				   "[2] w2 leaves -> -",
				   "[2] w1 fails j1 g0 p0 e0 sorry -> -",
				   "[3] w1 wants 1 -> -",
				   "[3] w1 leaves -> -",
				   /* the pause belongs to the worker, not to its connection */
				   "[3] w3 joins A threads=1 name=a home=a start=1 -> -",
				   "[3] w3 wants 1 -> w3 gets j1 g0 p0 e0",
				   "[4] w3 fails j1 g0 p0 e0 sorry -> -",
				   "[4] w4 joins A threads=1 name=b home=a start=2 -> close w3",
				   "[4] w4 wants 1 -> -",
				   "[13] tick -> -",
				   "[14] tick -> w4 gets j1 g0 p0 e0",
				   "[14] w4 fails j1 g0 p0 e0 sorry -> -",
				   "[34] w4 heartbeat -> w4 gets j1 g0 p0 e0",
				   "[34] w4 fails j1 g0 p0 e0 sorry -> -",
				   "[60] w4 heartbeat -> -",
				   "[74] w4 heartbeat -> w4 gets j1 g0 p0 e0",
				   "[74] w4 fails j1 g0 p0 e0 sorry -> -",
				   "[100] w4 heartbeat -> -",
				   "[125] w4 heartbeat -> -",
				   "[150] w4 heartbeat -> -",
				   "[154] w4 heartbeat -> w4 gets j1 g0 p0 e0",
				   "[154] w4 fails j1 g0 p0 e0 sorry -> -",
				   NULL,
			   });
	struct job_status s;
	assert_true(farm_job_status(f, 1, 160, &s));
	assert_int_equal(s.state, JOB_RUNNING);
	assert_string_equal(s.waiting, "no worker can compute it; worker b failed last: sorry");
	transcript_play(f, (const char *const[]){
				   "[160] w5 joins A threads=1 name=c -> -",
				   "[160] w5 wants 1 -> w5 gets j1 g0 p0 e0",
				   "[161] w5 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w5 gets j1 g1 p0 e1",
				   NULL,
			   });
	farm_free(f);
}

/* Three machines with full disks do not fail a job that a fourth can compute, in whatever order they come. */
static void full_disks_fail_no_job(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=5 -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=1 -> -",
				   "[0] w2 joins A threads=1 -> -",
				   "[0] w3 joins A threads=1 -> -",
				   "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
				   "[0] w2 wants 1 -> w2 gets j1 g1 p0 boot",
				   "[0] w3 wants 1 -> w3 gets j1 g2 p0 boot",
				   "[1] w1 lacks j1 g0 p0 boot disk full -> -",
				   "[1] w2 lacks j1 g1 p0 boot disk full -> -",
				   "[1] w3 lacks j1 g2 p0 boot disk full -> -",
				   /* they pause like other failed workers, and this repeats for as long as no other
				    * worker comes */
				   "[1] wake -> 11",
				   "[11] tick -> w1 gets j1 g3 p0 boot, w2 gets j1 g4 p0 boot, w3 gets j1 g0 p0 boot",
				   "[12] w1 lacks j1 g3 p0 boot disk full -> -",
				   "[12] w2 lacks j1 g4 p0 boot disk full -> -",
				   "[12] w3 lacks j1 g0 p0 boot disk full -> -",
				   NULL,
			   });
	struct job_status s;
	assert_true(farm_job_status(f, 1, 12, &s));
	assert_int_equal(s.state, JOB_BOOTSTRAP);
	assert_int_equal(s.counts.failures, 6);
	assert_string_equal(
		s.waiting,
		"no worker can compute it, because of a problem on the machines of w1, w2, w3; the last one: w3: disk full");
	transcript_play(f, (const char *const[]){
				   "[13] w4 joins A threads=1 -> -",
				   "[13] w4 wants 1 -> w4 gets j1 g1 p0 boot",
				   "[14] w4 batch j1 g1 p0 boot -> merge, merged, w4 gets j1 g2 p0 boot",
				   NULL,
			   });
	assert_true(farm_job_status(f, 1, 14, &s));
	assert_string_equal(s.waiting, "");
	farm_free(f);
}

/* A full disk does not cancel what others report about the job: for its failure, a worker that lacks something counts
 * as absent. */
static void full_disk_does_not_hide_a_bad_scene(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=5 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=2 -> -",
		"[0] w2 joins A threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[0] w2 wants 1 -> w2 gets j1 g1 p0 boot",
		"[1] w1 lacks j1 g0 p0 boot disk full -> -",
		"[1] w2 fails j1 g1 p0 boot no mesh -> -",
		"[11] w1 wants 2 -> w1 gets j1 g2 p0 boot, w2 gets j1 g3 p0 boot, w1 gets j1 g4 p0 boot",
		"[11] w1 lacks j1 g2 p0 boot disk full -> -",
		"[11] w1 fails j1 g4 p0 boot no mesh -> -", /* a second reason: a second try */
		"[12] w2 fails j1 g3 p0 boot no mesh -> j1 is failed (failed: w2: no mesh)",
		"[13] submit groups=5 -> j2 submitted, j2 is queued, j2 is bootstrap, w1 gets j2 g0 p0 boot, "
		"w2 gets j2 g1 p0 boot, w1 gets j2 g2 p0 boot",
		"[13] w1 wants 0 -> -",
		"[13] w1 lacks j2 g0 p0 boot disk full -> -",
		"[13] w1 lacks j2 g2 p0 boot disk full -> -",
		"[13] w2 fails j2 g1 p0 boot no mesh -> -",
		"[23] w2 heartbeat -> w2 gets j2 g3 p0 boot",
		"[23] w2 fails j2 g3 p0 boot no mesh -> -",
		"[33] w1 heartbeat -> -",
		"[43] w2 heartbeat -> w2 gets j2 g4 p0 boot",
		"[43] w2 fails j2 g4 p0 boot no mesh -> j2 is failed (failed: w2: no mesh)",
		NULL,
	});
}

/* Names are free, certificates are not: where the farm knows three certificates, three names with one certificate do
 * not count as three workers. */
static void names_with_one_certificate_count_as_one_worker(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=1 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 certificate=a name=a -> -",
		"[0] w2 joins A threads=1 certificate=b name=a -> -",
		"[0] w3 joins A threads=1 certificate=c name=a -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[1] w1 batch j1 g0 p0 boot -> merge, merged, j1 prepare",
		"[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
		"[1] w1 leaves -> -",
		"[1] w2 leaves -> -",
		"[2] w3 wants 1 -> w3 gets j1 g0 p0 e0",
		"[2] w3 fails j1 g0 p0 e0 sorry -> -",
		"[2] w4 joins A threads=1 certificate=c name=b -> -",
		"[2] w4 wants 1 -> w4 gets j1 g0 p0 e0",
		"[2] w4 fails j1 g0 p0 e0 sorry -> -",
		"[2] w5 joins A threads=1 certificate=c name=c -> -",
		"[2] w5 wants 1 -> w5 gets j1 g0 p0 e0",
		"[2] w5 fails j1 g0 p0 e0 sorry -> -",
		"[2] w6 joins A threads=1 certificate=c name=d -> -",
		"[2] w6 wants 1 -> w6 gets j1 g0 p0 e0",
		"[2] w6 fails j1 g0 p0 e0 sorry -> -",
		"[3] w7 joins A threads=1 certificate=a name=b -> -",
		"[3] w7 wants 1 -> w7 gets j1 g0 p0 e0",
		"[3] w7 fails j1 g0 p0 e0 sorry -> -",
		"[4] w8 joins A threads=1 certificate=b name=b -> -",
		"[4] w8 wants 1 -> w8 gets j1 g0 p0 e0",
		"[4] w8 fails j1 g0 p0 e0 sorry -> j1 is failed (failed: b: sorry)",
		NULL,
	});
}

/* A worker whose memory is taken by another scene postpones the lease: this never counts as a failure, and its pause
 * does not grow. Meanwhile the worker gets leases of the jobs that it already has leases of, and no third job is tried;
 * once it has none of those, there is room. */
static void postponed_lease_is_no_failure(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f,
			(const char *const[]){
				"[0] submit groups=5 -> j1 submitted, j1 is queued",
				"[0] w1 joins A threads=3 -> -",
				"[0] w1 wants 2 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot",
				"[1] submit -> j2 submitted, j2 is queued",
				"[1] submit -> j3 submitted, j3 is queued",
				"[2] w1 batch j1 g0 p0 boot -> merge, merged, j2 is bootstrap, w1 gets j2 g0 p0 boot",
				"[2] w1 postpones j2 g0 p0 boot full -> w1 gets j1 g2 p0 boot",
				"[11] w1 batch j1 g1 p0 boot -> merge, merged, w1 gets j1 g3 p0 boot",
				"[12] w1 batch j1 g2 p0 boot -> merge, merged, w1 gets j2 g1 p0 boot",
				"[12] w1 postpones j2 g1 p0 boot full -> w1 gets j1 g4 p0 boot",
				"[13] w1 batch j1 g3 p0 boot -> merge, merged",
				/* its last lease: there is room at once */
				"[14] w1 batch j1 g4 p0 boot -> merge, merged, j1 prepare, w1 gets j2 g0 p0 boot, "
				"w1 gets j2 g1 p0 boot",
				"[16] w1 batch j2 g0 p0 boot -> merge, merged",
				/* the job that it postpones is one it already holds, or a lease that is not known here
				 */
				"[17] w1 postpones j2 g1 p0 boot full -> -",
				"[26.9] tick -> -",
				"[27] tick -> w1 gets j2 g1 p0 boot, j3 is bootstrap, w1 gets j3 g0 p0 boot",
				NULL,
			});
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(lease_that_fails_on_three_workers_fails_the_job),
		cmocka_unit_test(job_whose_only_worker_never_succeeds_fails),
		cmocka_unit_test(one_broken_worker_fails_no_job),
		cmocka_unit_test(job_fails_if_all_workers_fail),
		cmocka_unit_test(one_worker_cannot_fail_a_job_with_results),
		cmocka_unit_test(full_disks_fail_no_job),
		cmocka_unit_test(full_disk_does_not_hide_a_bad_scene),
		cmocka_unit_test(names_with_one_certificate_count_as_one_worker),
		cmocka_unit_test(postponed_lease_is_no_failure),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
