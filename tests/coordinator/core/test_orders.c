/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Orders to existing jobs, as transcripts: hold and release, change of priority, and extension while the job runs,
 * while it ends and after it has ended. Leases that are out when the order arrives still count, time on hold does not,
 * and failures caused by damaged files count against nobody.
 */
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static struct job_status read_job_status(const struct farm *f, uint64_t job, double now)
{
	struct job_status s;
	assert_true(farm_job_status(f, job, now, &s));
	return s;
}

/* No more leases go out, and those that are out count; the other job gets the workers. */
static void held_job_gets_no_leases_until_it_is_released(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=3 -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=2 -> -",
				   "[0] w1 wants 2 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot",
				   "[1] hold order j1 held by ann -> -",
				   "[1] hold order j1 held by bob -> -", /* the last one to give the order */
				   "[2] w1 batch j1 g0 p0 boot -> merge, merged",
				   NULL,
			   });
	assert_int_equal(read_job_status(f, 1, 2).state, JOB_HELD);
	assert_string_equal(read_job_status(f, 1, 2).waiting, "held by bob");
	transcript_play(
		f,
		(const char *const[]){
			"[2] submit groups=1 priority=-9 -> j2 submitted, j2 is queued, j2 is bootstrap, w1 gets j2 g0 p0 boot",
			"[3] w1 batch j2 g0 p0 boot -> merge, merged, j2 prepare",
			"[3] w1 batch j1 g1 p0 boot -> merge, merged",
			"[4] release order j1 -> w1 gets j1 g2 p0 boot",
			"[4] release order j1 -> -",
			"[5] hold order j9 held by ann -> rejected: no such job",
			"[5] cancel j1 -> j1 cancelled, w1 loses j1 g2 p0 boot, j1 is cancelled (cancelled: cancelled)",
			"[5] hold order j1 held by ann -> rejected: the job is over",
			NULL,
		});
	assert_int_equal(read_job_status(f, 1, 5).state, JOB_CANCELLED);
	farm_free(f);
}

/* Leases that were sent before the files were repaired do not count when they fail, whenever the failure is reported;
 * later ones do. */
static void failures_by_damaged_files_count_against_nobody(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=3 -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=3 -> -",
				   "[0] w1 wants 3 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, "
				   "w1 gets j1 g2 p0 boot",
				   "[1] hold files j1 a file is damaged -> -",
				   "[2] w1 fails j1 g0 p0 boot it has the file no more -> -",
				   "[3] release files j1 -> w1 gets j1 g0 p0 boot",
				   "[4] w1 fails j1 g1 p0 boot it has the file no more -> w1 gets j1 g1 p0 boot",
				   NULL,
			   });
	assert_int_equal(read_job_status(f, 1, 4).counts.failures, 0);
	transcript_play(f, (const char *const[]){
				   "[5] w1 lacks j1 g2 p0 boot no memory -> -",
				   "[6] w1 fails j1 g0 p0 boot it has the file no more -> -",
				   NULL,
			   });
	assert_int_equal(read_job_status(f, 1, 6).counts.failures, 2);
	farm_free(f);
}

static void job_may_be_held_for_two_reasons(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit -> j1 submitted, j1 is queued",
				   "[0] hold order j1 held by ann -> -",
				   "[0] hold j1 no room -> -",
				   "[0] w1 joins A threads=1 -> -",
				   "[0] w1 wants 1 -> -",
				   NULL,
			   });
	assert_string_equal(read_job_status(f, 1, 0).waiting, "held by ann; no room");
	transcript_play(f, (const char *const[]){
				   "[1] release order j1 -> -",
				   NULL,
			   });
	assert_string_equal(read_job_status(f, 1, 1).waiting, "no room");
	transcript_play(f, (const char *const[]){
				   "[1] hold order j1 held by ann -> -",
				   "[2] release j1 -> -",
				   NULL,
			   });
	assert_string_equal(read_job_status(f, 1, 2).waiting, "held by ann");
	assert_int_equal(read_job_status(f, 1, 2).state, JOB_HELD);
	transcript_play(f, (const char *const[]){
				   "[3] release order j1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
				   NULL,
			   });
	farm_free(f);
}

/* A time limit does not run down while the job is on hold: 3 s of 8 before the hold, 90 s on hold, then five more. */
static void time_limit_does_not_run_down_while_a_job_is_held(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f, (const char *const[]){
			   "[100] restore j1 render 2,3 elapsed=3 completed=2 rounds=inf seconds=8 -> j1 is running",
			   "[100] w1 joins A threads=1 -> -",
			   "[100] hold order j1 held by ann -> -",
			   "[150] w1 batch j1 g0 p0 e2 -> merge, merged, j1 round 3",
			   "[150] w1 batch j1 g0 p0 e3 -> merge, merged",
			   NULL,
		   });
	assert_true(farm_job_elapsed(f, 1, 180) == 3);
	transcript_play(f, (const char *const[]){
				   "[190] release order j1 -> -",
				   NULL,
			   });
	assert_true(farm_job_elapsed(f, 1, 194) == 7);
	transcript_play(
		f, (const char *const[]){
			   "[194] w1 batch j1 g1 p0 e3 -> merge, merged, j1 round 4",
			   "[194] w1 batch j1 g0 p0 e4 -> merge, merged",
			   "[195] w1 batch j1 g1 p0 e4 -> merge, merged, j1 round 5, j1 publish 5, j1 is done (time)",
			   NULL,
		   });
	farm_free(f);
}

static void changed_priority_reorders_jobs(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			"[0] submit groups=4 -> j1 submitted, j1 is queued",
			"[0] submit groups=4 -> j2 submitted, j2 is queued",
			"[0] submit groups=4 -> j3 submitted, j3 is queued",
			"[0] w1 joins A threads=1 -> -",
			"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
			"[1] priority j3 1 -> -", /* the lease that is out stays with its worker */
			"[1] w1 batch j1 g0 p0 boot -> merge, merged, j3 is bootstrap, w1 gets j3 g0 p0 boot",
			"[2] priority j2 1 -> -",
			/* The older job comes first. */
			"[2] w1 batch j3 g0 p0 boot -> merge, merged, j2 is bootstrap, w1 gets j2 g0 p0 boot",
			"[3] priority j2 -100 -> -",
			"[3] priority j3 0 -> -",
			/* The order of leases is as if the priority had never changed. */
			"[3] w1 batch j2 g0 p0 boot -> merge, merged, w1 gets j1 g1 p0 boot",
			"[4] priority j3 100 -> -",
			"[4] w1 batch j1 g1 p0 boot -> merge, merged, w1 gets j3 g1 p0 boot",
			"[5] priority j3 101 -> rejected: a priority is from -100 to 100",
			"[5] priority j4 1 -> rejected: no such job",
			"[5] cancel j1 -> j1 cancelled, j1 is cancelled (cancelled: cancelled)",
			"[5] priority j1 1 -> rejected: the job is over",
			"[6] cancel j3 -> j3 cancelled, w1 loses j3 g1 p0 boot, j3 is cancelled (cancelled: cancelled), "
			"w1 gets j2 g1 p0 boot",
			NULL,
		});
	assert_int_equal(read_job_status(f, 3, 5).priority, 100);
	farm_free(f);
}

/* While the job runs: its last rounds are no longer the last, and workers that waited for them get leases. */
static void running_job_is_extended(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			"[0] restore j1 render 1,2 rounds=2 -> j1 is running",
			"[0] w1 joins A threads=2 -> -",
			"[0] w1 wants 2 -> w1 gets j1 g0 p0 e1",
			"[1] extend j1 rounds=4 -> w1 gets j1 g1 p0 e2",
			"[1] extend j9 rounds=4 -> rejected: no such job",
			"[2] w1 batch j1 g1 p0 e2 -> merge, merged",
			"[3] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w1 gets j1 g0 p0 e2, w1 gets j1 g1 p0 e3",
			"[4] w1 batch j1 g0 p0 e2 -> merge, merged, j1 round 3, w1 gets j1 g0 p0 e3",
			"[5] w1 batch j1 g0 p0 e3 -> merge, merged",
			"[6] w1 batch j1 g1 p0 e3 -> merge, merged, j1 round 4, j1 publish 4, j1 is done (mutations)",
			"[6] extend j1 rounds=5 -> rejected: the job is over",
			NULL,
		});
	farm_free(f);
	/* during the bootstrap */
	transcript_check((const char *const[]){
		"[0] restore j1 boot 1,0 rounds=1 -> -",
		"[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g1 p0 boot",
		"[1] extend j1 rounds=2 -> -",
		"[1] w1 batch j1 g1 p0 boot -> merge, merged, j1 prepare",
		"[1] extend j1 rounds=3 -> -",
		"[1] w1 batch j1 g1 p0 e2 -> refused: the bootstrap is not complete",
		"[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
		NULL,
	});
}

/* The error is estimated once more because a bound is met; after the extension the bound is no longer met. */
static void ending_job_is_extended(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] restore j1 render 2,2 elapsed=1 completed=1 rounds=2 target=0.1 -> j1 is running, j1 evaluate 2",
		"[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1 -> -",
		"[1] extend j1 rounds=3 target=0.05 -> w1 gets j1 g0 p0 e2",
		"[2] error j1 2 0.07 -> -",
		"[3] w1 batch j1 g0 p0 e2 -> merge, merged, w1 gets j1 g1 p0 e2",
		"[4] w1 batch j1 g1 p0 e2 -> merge, merged, j1 round 3, j1 evaluate 3",
		/* another target alone: the rounds are done all the same */
		"[5] extend j1 rounds=3 target=0.01 -> -",
		"[6] error j1 3 0.05 -> j1 publish 3, j1 is done (mutations)",
		NULL,
	});
	/* a single long job would not have estimated its error after nine rounds */
	transcript_check((const char *const[]){
		"[0] restore j1 render 9,9 elapsed=1 completed=1 rounds=9 target=0.1 -> j1 is running, j1 evaluate 9",
		"[1] extend j1 rounds=12 target=0.1 -> -",
		"[2] error j1 9 0.05 -> -",
		"[3] w1 joins A threads=1 -> -",
		"[3] w1 wants 1 -> w1 gets j1 g0 p0 e9",
		NULL,
	});
	transcript_check((const char *const[]){
		"[10] restore j1 render 2,2 elapsed=9 completed=9 rounds=inf seconds=8 target=0.1 -> j1 is running, j1 evaluate 2",
		"[10] extend j1 rounds=inf seconds=20 target=0.1 -> -",
		"[11] w1 joins A threads=1 -> -",
		"[11] w1 wants 1 -> w1 gets j1 g0 p0 e2",
		NULL,
	});
}

/* A job that has ended is continued under its id; the caller that stored its counters passes them in. */
static void ended_job_is_extended(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			"[0] submit rounds=1 -> j1 submitted, j1 is queued",
			"[0] submit rounds=1 priority=1 -> j2 submitted, j2 is queued",
			"[0] cancel j2 -> j2 cancelled, j2 is cancelled (cancelled: cancelled)",
			"[0] w1 joins A threads=1 -> -",
			"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
			"[1] w1 batch j1 g0 p0 boot -> merge, merged, w1 gets j1 g1 p0 boot",
			"[2] w1 batch j1 g1 p0 boot -> merge, merged, j1 prepare",
			"[2] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",
			"[3] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g1 p0 e0",
			"[4] w1 batch j1 g1 p0 e0 -> merge, merged, j1 round 1, j1 publish 1, j1 is done (mutations)",
			"[9] restore j1 render 1,1 fingerprint=A elapsed=4 completed=4 rounds=2 -> j1 is running, w1 gets j1 g0 p0 e1",
			"[9] submit -> j3 submitted, j3 is queued", /* ids continue */
			"[9] w1 batch j1 g1 p0 e0 -> repeat: merged already",
			NULL,
		});
	assert_true(farm_job_elapsed(f, 1, 10) == 5);
	struct job_counts counts;
	assert_true(farm_job_counts(f, 1, &counts) && farm_job_counts(f, 2, &counts));
	transcript_play(
		f,
		(const char *const[]){
			"[10] w1 batch j1 g0 p0 e1 -> merge, merged, w1 gets j1 g1 p0 e1", /* the older job comes first
											    */
			"[11] w1 batch j1 g1 p0 e1 -> merge, merged, j1 round 2, j1 publish 2, j1 is done (mutations), "
			"j3 is bootstrap, w1 gets j3 g0 p0 boot",
			NULL,
		});
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(failures_by_damaged_files_count_against_nobody),
		cmocka_unit_test(held_job_gets_no_leases_until_it_is_released),
		cmocka_unit_test(job_may_be_held_for_two_reasons),
		cmocka_unit_test(time_limit_does_not_run_down_while_a_job_is_held),
		cmocka_unit_test(changed_priority_reorders_jobs),
		cmocka_unit_test(running_job_is_extended),
		cmocka_unit_test(ending_job_is_extended),
		cmocka_unit_test(ended_job_is_extended),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
