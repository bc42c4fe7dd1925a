/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How several jobs share several workers, as transcripts: higher priorities come first, then equal shares by owner and
 * by job; numeric fingerprints pin a job to one kind of worker; jobs, workers and memory are limited; and the status
 * gives the reason why a job waits.
 */
#include "tests/support/failing_memory.h"
#include "tests/support/transcript.h"

#include "common/base/mem.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static const char *read_waiting_reason(const struct farm *f, uint64_t job)
{
	static struct job_status s;
	assert_true(farm_job_status(f, job, 1000, &s));
	return s.waiting;
}

static void higher_priorities_are_served_first(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			"[0] w1 joins A threads=1 -> -",
			"[0] w1 wants 1 -> -",
			"[0] submit priority=101 -> rejected: a priority is from -100 to 100",
			"[0] submit priority=-1 groups=4 -> j1 submitted, j1 is queued, j1 is bootstrap, w1 gets j1 g0 p0 boot",
			"[0] submit groups=4 -> j2 submitted, j2 is queued",
			"[0] submit priority=5 groups=1 -> j3 submitted, j3 is queued",
			NULL,
		});
	assert_string_equal(read_waiting_reason(f, 3), "workers busy with j1 (priority -1)");
	transcript_play(
		f,
		(const char *const[]){
			"[1] w1 batch j1 g0 p0 boot -> merge, merged, j3 is bootstrap, w1 gets j3 g0 p0 boot",
			"[2] w1 batch j3 g0 p0 boot -> merge, merged, j3 prepare, j2 is bootstrap, w1 gets j2 g0 p0 boot",
			NULL,
		});
	assert_string_equal(read_waiting_reason(f, 3), "the bootstrap is being evaluated");
	assert_string_equal(read_waiting_reason(f, 2), "");
	transcript_play(f, (const char *const[]){
				   "[2] prepared j3 -> j3 is running",
				   "[3] w1 batch j2 g0 p0 boot -> merge, merged, w1 gets j3 g0 p0 e0",
				   NULL,
			   });
	farm_free(f);
}

/* Equal shares by owner and by number of leases apply only among jobs of one priority. */
static void priority_comes_before_equal_shares(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] w1 joins A threads=1 -> -",
		"[0] w2 joins A threads=1 -> -",
		"[0] submit priority=5 groups=3 owner=ann -> j1 submitted, j1 is queued",
		"[0] submit priority=0 groups=3 owner=bob -> j2 submitted, j2 is queued",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[0] w2 wants 1 -> w2 gets j1 g1 p0 boot", /* ann holds one lease, bob none */
		NULL,
	});
}

/* If workers of two fingerprints could begin a job, the one that has waited longest begins it, whichever fingerprint
 * connected first. */
static void worker_that_waited_longest_begins_the_job(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] w1 joins A threads=1 -> -",
		"[0] w2 joins B threads=1 -> -",
		"[1] w1 wants 1 -> -",
		"[2] w2 wants 1 -> -",
		"[3] submit groups=1 -> j1 submitted, j1 is queued, j1 is bootstrap, w1 gets j1 g0 p0 boot",
		NULL,
	});
	transcript_check((const char *const[]){
		"[0] w1 joins A threads=1 -> -",
		"[0] w2 joins B threads=1 -> -",
		"[1] w2 wants 1 -> -",
		"[2] w1 wants 1 -> -",
		"[3] submit groups=1 -> j1 submitted, j1 is queued, j1 is bootstrap, w2 gets j1 g0 p0 boot",
		NULL,
	});
}

static void equal_jobs_get_equal_shares(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=9 -> j1 submitted, j1 is queued",
		"[0] submit groups=9 -> j2 submitted, j2 is queued",
		"[0] w1 joins A threads=4 -> -",
		"[0] w1 wants 4 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, j2 is bootstrap, w1 gets j2 g0 p0 boot, "
		"w1 gets j1 g1 p0 boot, w1 gets j2 g1 p0 boot",
		"[1] w1 batch j2 g0 p0 boot -> merge, merged, w1 gets j2 g2 p0 boot",
		"[2] w1 batch j1 g0 p0 boot -> merge, merged, w1 gets j1 g2 p0 boot",
		NULL,
	});
}

/* A delivered result that waits to be checked does not count against the number of leases that its worker may hold, as
 * long as the worker's table has room; the lease stays the worker's. */
static void delivered_result_does_not_count_as_held(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=9 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[1] w1 delivers j1 g1 p0 boot -> -",
		"[1] w1 delivers j1 g0 p0 boot -> w1 gets j1 g1 p0 boot",
		"[1] w1 delivers j1 g0 p0 boot -> -",
		"[2] w2 joins A threads=1 -> -",
		"[2] w2 wants 1 -> w2 gets j1 g2 p0 boot",
		"[3] w1 batch j1 g0 p0 boot -> merge, merged",
		"[4] w1 delivers j1 g1 p0 boot -> w1 gets j1 g3 p0 boot",
		"[4] w1 delivers j1 g3 p0 boot -> w1 gets j1 g4 p0 boot",
		"[4] w1 delivers j1 g4 p0 boot -> w1 gets j1 g5 p0 boot",
		"[4] w1 delivers j1 g5 p0 boot -> -", /* all four entries of the table are taken */
		"[5] w1 batch j1 g3 p0 boot -> merge, merged, w1 gets j1 g6 p0 boot",
		"[6] w1 leaves -> -",
		"[7] w2 batch j1 g2 p0 boot -> merge, merged, w2 gets j1 g7 p0 boot",
		NULL,
	});
}

/* Shares go by owner first: of nine leases bob's one job gets half, and ann's two jobs share the other half. */
static void shares_are_equal_by_owner_first(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			"[0] submit groups=9 owner=ann -> j1 submitted, j1 is queued",
			"[0] submit groups=9 owner=ann -> j2 submitted, j2 is queued",
			"[0] submit groups=9 owner=bob -> j3 submitted, j3 is queued",
			"[0] w1 joins A threads=9 -> -",
			"[0] w1 wants 9 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, j3 is bootstrap, w1 gets j3 g0 p0 boot, "
			"j2 is bootstrap, w1 gets j2 g0 p0 boot, w1 gets j3 g1 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j3 g2 p0 boot, "
			"w1 gets j2 g1 p0 boot, w1 gets j3 g3 p0 boot", /* more leases once the worker has returned a
									 * result */
			/* the lease goes to the job with the fewest leases, not to the one whose result came */
			"[1] w1 batch j3 g0 p0 boot -> merge, merged, w1 gets j3 g4 p0 boot, w1 gets j1 g2 p0 boot",
			"[1] w1 batch j2 g0 p0 boot -> merge, merged, w1 gets j2 g2 p0 boot",
			/* an owner's leases of another priority count too: one lease is bob's j4 */
			"[2] submit groups=1 priority=1 owner=bob -> j4 submitted, j4 is queued",
			"[2] w1 batch j1 g0 p0 boot -> merge, merged, j4 is bootstrap, w1 gets j4 g0 p0 boot",
			"[3] w1 batch j1 g1 p0 boot -> merge, merged, w1 gets j1 g3 p0 boot",
			"[3] w1 batch j3 g1 p0 boot -> merge, merged, w1 gets j1 g4 p0 boot",
			NULL,
		});
	struct job_status s;
	assert_true(farm_job_status(f, 3, 3, &s));
	assert_string_equal(s.owner, "bob");
	farm_free(f);
}

/* Jobs without an owner's name share one owner's part, however many they are; a job restored after a restart keeps its
 * owner. */
static void jobs_without_an_owner_share_one_part(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] restore j5 boot 0,0,0,0 groups=4 owner=bob -> -",
		"[0] submit groups=4 -> j6 submitted, j6 is queued",
		"[0] submit groups=4 -> j7 submitted, j7 is queued",
		"[0] submit groups=4 owner=bob -> j8 submitted, j8 is queued",
		"[0] w1 joins A threads=6 -> -",
		"[0] w1 wants 6 -> j5 is bootstrap, w1 gets j5 g0 p0 boot, j6 is bootstrap, w1 gets j6 g0 p0 boot, "
		"j8 is bootstrap, w1 gets j8 g0 p0 boot, j7 is bootstrap, w1 gets j7 g0 p0 boot, "
		"w1 gets j5 g1 p0 boot, w1 gets j6 g1 p0 boot",
		NULL,
	});
}

static void workers_take_turns(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] w1 joins A threads=2 -> -",
		"[0] w2 joins A threads=2 -> -",
		"[0] w1 wants 2 -> -",
		"[0] w2 wants 2 -> -",
		"[0] submit groups=4 -> j1 submitted, j1 is queued, j1 is bootstrap, w1 gets j1 g0 p0 boot, "
		"w2 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot, w2 gets j1 g3 p0 boot",
		NULL,
	});
}

static void a_job_is_pinned_to_a_fingerprint(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=3 -> j1 submitted, j1 is queued",
				   NULL,
			   });
	assert_string_equal(read_waiting_reason(f, 1), "no worker is connected");
	transcript_play(f, (const char *const[]){
				   "[0] w1 joins A threads=1 -> -",
				   "[0] w2 joins B threads=1 -> -",
				   NULL,
			   });
	assert_string_equal(read_waiting_reason(f, 1), "no worker asks for work");
	transcript_play(
		f, (const char *const[]){
			   "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
			   "[0] w2 wants 1 -> -",
			   "[1] w2 batch j1 g0 p0 boot -> refused: the job belongs to workers with another fingerprint",
			   "[1] w1 batch j1 g0 p0 boot -> merge, merged, w1 gets j1 g1 p0 boot",
			   "[1] w1 leaves -> -",
			   NULL,
		   });
	assert_string_equal(read_waiting_reason(f, 1), "no connected worker has fingerprint A (1 have others)");
	transcript_play(
		f,
		(const char *const[]){
			"[2] submit mixed groups=1 rounds=1 -> j2 submitted, j2 is queued, j2 is bootstrap, w2 gets j2 g0 p0 boot",
			"[3] w3 joins A threads=1 -> -",
			"[3] w3 wants 1 -> w3 gets j1 g2 p0 boot",
			"[3] w2 batch j2 g0 p0 boot -> merge, merged, j2 prepare",
			"[3] w3 batch j1 g2 p0 boot -> merge, merged, w3 gets j1 g1 p0 boot",
			"[4] prepared j2 -> j2 is running, w2 gets j2 g0 p0 e0",
			"[4] w3 batch j2 g0 p0 e0 -> merge, merged, w2 loses j2 g0 p0 e0, j2 round 1, j2 publish 1, j2 is done (mutations)",
			NULL,
		});
	farm_free(f);
}

static void job_without_results_is_not_pinned(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 -> -",
		"[0] w2 joins B threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[0] w2 wants 1 -> -",
		"[1] w1 leaves -> w2 gets j1 g1 p0 boot",
		NULL,
	});
}

static void waiting_reason_names_silent_or_failed_workers(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=1 -> -",
				   "[30] tick -> -",
				   NULL,
			   });
	assert_string_equal(read_waiting_reason(f, 1), "no worker responds and is not quarantined (1 connected)");
	transcript_play(f, (const char *const[]){
				   "[30] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
				   "[31] w1 fails j1 g0 p0 boot no such file -> -",
				   NULL,
			   });
	assert_string_equal(read_waiting_reason(f, 1), "no worker can compute it; worker w1 failed last: no such file");
	farm_free(f);
}

static void numbers_of_jobs_and_workers_are_limited(void **state)
{
	(void)state;
	struct farm_config c;
	struct farm *f;
	farm_config_init(&c);
	c.max_jobs = 2;
	c.max_ended_jobs = 1;
	c.max_peers = 1;
	c.max_job_slots = 4;
	c.first_job_id = 7;
	assert_int_equal(farm_new(&f, &c, NULL), 0);
	transcript_play(
		f,
		(const char *const[]){
			"[0] w1 joins A threads=1 -> -",
			"[0] w2 joins A threads=1 -> rejected: the farm has as many workers as it accepts",
			"[0] submit groups=5 -> rejected: the plan has more leases in a round than the coordinator takes",
			"[0] submit -> j7 submitted, j7 is queued",
			"[0] submit -> j8 submitted, j8 is queued",
			"[0] submit -> rejected: the coordinator has as many live jobs as it accepts",
			"[0] cancel j7 -> j7 cancelled, j7 is cancelled (cancelled: cancelled)",
			"[1] submit -> j9 submitted, j9 is queued",
			"[1] cancel j9 -> j9 cancelled, j9 is cancelled (cancelled: cancelled), j7 forgotten",
			"[1] cancel j7 -> rejected: no such job",
			NULL,
		});
	struct job_counts counts;
	assert_true(!farm_job_counts(f, 7, &counts) && farm_job_counts(f, 8, &counts) &&
		    farm_job_counts(f, 9, &counts));
	/* both jobs ended at the same moment: the one that ends now is kept */
	transcript_play(f,
			(const char *const[]){
				"[1] cancel j8 -> j8 cancelled, j8 is cancelled (cancelled: cancelled), j9 forgotten",
				NULL,
			});
	assert_int_equal(farm_next_peer(f, 0), 1);
	assert_int_equal(farm_next_peer(f, 1), 0);
	farm_free(f);
	c.max_peers = 0;
	assert_int_equal(farm_new(&f, &c, NULL), -EINVAL);
}

static void lack_of_memory_rejects_a_job_or_worker(void **state)
{
	(void)state;
	struct farm_config c;
	struct farm *f;
	farm_config_init(&c);
	for (long n = 0; n < 5; n++) {
		mem_fail_after(n);
		assert_int_equal(farm_new(&f, &c, NULL), -ENOMEM);
	}
	mem_fail_after(-1);
	f = transcript_farm_new();
	mem_fail_after(1);
	transcript_play(f, (const char *const[]){
				   "[0] submit -> rejected: the coordinator has no memory for another job",
				   NULL,
			   });
	mem_fail_after(1);
	transcript_play(
		f, (const char *const[]){
			   "[0] w1 joins A threads=1 -> rejected: the coordinator has no memory for another worker",
			   NULL,
		   });
	mem_fail_after(-1);
	transcript_play(f, (const char *const[]){
				   "[0] submit -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=1 -> -",
				   "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
				   NULL,
			   });
	struct lease_status l;
	assert_true(farm_lease_status(f, 1, 0, &l));
	assert_int_equal(l.key.job, 1);
	assert_false(farm_lease_status(f, 1, 1, &l));
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(higher_priorities_are_served_first),
		cmocka_unit_test(priority_comes_before_equal_shares),
		cmocka_unit_test(worker_that_waited_longest_begins_the_job),
		cmocka_unit_test(delivered_result_does_not_count_as_held),
		cmocka_unit_test(equal_jobs_get_equal_shares),
		cmocka_unit_test(shares_are_equal_by_owner_first),
		cmocka_unit_test(jobs_without_an_owner_share_one_part),
		cmocka_unit_test(workers_take_turns),
		cmocka_unit_test(a_job_is_pinned_to_a_fingerprint),
		cmocka_unit_test(job_without_results_is_not_pinned),
		cmocka_unit_test(waiting_reason_names_silent_or_failed_workers),
		cmocka_unit_test(numbers_of_jobs_and_workers_are_limited),
		cmocka_unit_test(lack_of_memory_rejects_a_job_or_worker),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
