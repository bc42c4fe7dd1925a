/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The rules for one lease, as transcripts: which results are merged, count as repeats or are refused, and when a lease
 * is handed out again because its worker left, fell silent, returned it, or is much slower than others. Also limits on
 * names and on what a worker may ask for.
 */
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static void job_runs_from_bootstrap_to_end(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		TRANSCRIPT_START_TWO,
		"[2] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		"[2] w2 batch j1 g1 p0 e0 -> merge, merged, j1 round 1, w2 gets j1 g1 p0 e1",
		"[3] w2 batch j1 g1 p0 e1 -> merge, merged",
		"[3] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, j1 publish 2, j1 is done (mutations)",
		"[4] w1 batch j1 g0 p0 e1 -> refused: the job is over",
		NULL,
	});
}

static void two_rounds_are_open_at_once(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit rounds=9 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=2 -> -",
		"[0] w1 wants 2 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot",
		"[1] w1 batch j1 g0 p0 boot -> merge, merged",
		"[1] w1 batch j1 g1 p0 boot -> merge, merged, j1 prepare",
		"[1] w1 batch j1 g0 p0 e0 -> refused: the bootstrap is not complete",
		"[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w1 gets j1 g1 p0 e0",
		"[1] w1 batch j1 g0 p0 e1 -> refused: the epoch is not open",
		"[1] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		"[1] w1 batch j1 g0 p0 e1 -> merge, merged",
		"[1] w1 batch j1 g0 p0 e2 -> refused: the epoch is not open",
		"[1] w1 batch j1 g1 p0 e0 -> merge, merged, j1 round 1, w1 gets j1 g1 p0 e1, w1 gets j1 g0 p0 e2",
		"[2] w1 batch j1 g0 p0 e2 -> merge, merged",
		"[2] w1 batch j1 g1 p0 e1 -> merge, merged, j1 round 2, w1 gets j1 g1 p0 e2, w1 gets j1 g0 p0 e3",
		NULL,
	});
}

static void a_lease_counts_once(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		TRANSCRIPT_START_TWO,
		"[2] w1 batch j1 g0 p0 boot -> repeat: merged already",
		"[2] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		"[2] w1 batch j1 g0 p0 e0 -> repeat: merged already",
		"[2] w2 batch j1 g0 p0 e0 -> repeat: merged already",
		/* the first valid result counts, whichever worker holds the lease */
		"[2] w2 batch j1 g0 p0 e1 -> merge, merged, w1 loses j1 g0 p0 e1",
		"[2] w1 batch j1 g0 p0 e1 -> repeat: merged already",
		NULL,
	});
}

static void unknown_workers_and_ended_jobs_are_refused(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		TRANSCRIPT_START_TWO,
		"[2] w9 batch j1 g0 p0 e0 -> refused: unknown worker",
		"[2] w1 batch j2 g0 p0 e0 -> refused: no such job",
		"[2] cancel j2 -> rejected: no such job",
		"[2] cancel j1 -> j1 cancelled, w1 loses j1 g0 p0 e0, w2 loses j1 g1 p0 e0, j1 is cancelled (cancelled: cancelled)",
		"[3] w1 batch j1 g0 p0 e0 -> refused: the job is over",
		"[3] cancel j1 -> rejected: the job is over",
		NULL,
	});
}

static void worker_is_quarantined_after_three_faults(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			TRANSCRIPT_START_TWO,
			"[2] w1 batch j1 g0 p0 e0 bad tile 3 holds a NaN -> refused: tile 3 holds a NaN, w1 gets j1 g0 p0 e0",
			"[3] w1 batch j1 g7 p0 e0 -> refused: not a lease of this job",
			"[4] w1 batch j1 g0 p0 e0 bad torn -> refused: torn, #1 quarantined",
			"[5] w1 wants 1 -> -",
			/* its last lease now belongs to another worker */
			"[5] w2 batch j1 g1 p0 e0 -> merge, merged, w2 gets j1 g0 p0 e0",
			"[6] w2 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w2 gets j1 g1 p0 e1",
			/* silence followed by one heartbeat does not clear the worker's record */
			"[33] w2 heartbeat -> -",
			"[36] tick -> -",
			"[40] w1 wants 1 -> -",
			NULL,
		});
	struct peer_status p;
	assert_true(farm_peer_status(f, 1, &p));
	assert_int_equal(p.state, PEER_QUARANTINED);
	assert_int_equal(p.faults, 3);
	assert_string_equal(p.last_fault, "torn");
	struct job_status j;
	assert_true(farm_job_status(f, 1, 40, &j));
	assert_int_equal(j.counts.faults, 3);
	farm_free(f);
}

static void lease_of_a_lost_or_silent_worker_is_given_again(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		TRANSCRIPT_START_TWO,
		"[2] w3 joins A threads=1 -> -",
		"[2] w3 wants 1 -> -",
		"[2.4] w1 leaves -> w3 gets j1 g0 p0 e0",
		/* the worker was silent: its lease is taken back, but its result is still valid */
		"[20] w3 heartbeat -> -",
		"[31] tick -> -",
		"[31] w3 wants 2 -> w3 gets j1 g1 p0 e0",
		"[32] w2 batch j1 g1 p0 e0 -> merge, merged, w3 loses j1 g1 p0 e0, w2 gets j1 g1 p0 e1",
		NULL,
	});
}

/* If the coordinator reads late what workers sent in time, no worker is taken for silent and no lease for overdue. */
static void messages_read_late_make_no_worker_silent(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		TRANSCRIPT_START_TWO,
		"[2] w3 joins A threads=1 -> -",
		"[700] unread=690 tick -> -",
		"[700] unread=690 w2 heartbeat -> -",
		"[702] unread=692 w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		/* now all input has been read: the third worker has sent nothing, and the second one's lease is overdue
		 */
		"[703] tick -> close w3, w2 gets j1 g1 p0 e0",
		NULL,
	});
}

static void worker_silent_for_long_is_disconnected(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] w1 joins A threads=1 -> -",
		"[0] wake -> 30",
		"[30] tick -> -",
		"[30] wake -> 300",
		"[299] tick -> -",
		"[300] tick -> close w1",
		"[300] w1 wants 1 -> -",
		NULL,
	});
}

static void overdue_lease_is_given_again(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=3 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=4 -> -",
		"[0] w1 wants 3 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot",
		"[1] w1 batch j1 g0 p0 boot -> merge, merged",
		"[1] w1 batch j1 g1 p0 boot -> merge, merged",
		/* durations of leases were unknown when this one was sent: its timeout is 600 s */
		"[599] w1 heartbeat -> -",
		"[600] tick -> w1 gets j1 g2 p0 boot",
		"[601] w1 batch j1 g2 p0 boot -> merge, merged, j1 prepare",
		"[601] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w1 gets j1 g1 p0 e0, w1 gets j1 g2 p0 e0",
		"[602] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		"[602] w1 batch j1 g0 p0 e1 -> merge, merged",
		NULL,
	});
}

static void timeout_of_a_lease_follows_the_median_duration(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=3 rounds=9 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[1] w1 batch j1 g0 p0 boot -> merge, merged, w1 gets j1 g1 p0 boot",
		"[2] w1 batch j1 g1 p0 boot -> merge, merged, w1 gets j1 g2 p0 boot",
		"[30] w1 heartbeat -> -",
		"[59] w1 heartbeat -> -",
		/* ten medians are 10 s, so the minimum of 60 s holds; the second timeout is 120 s */
		"[62] tick -> w1 gets j1 g2 p0 boot",
		"[62] wake -> 89",
		"[85] w1 heartbeat -> -",
		"[110] w1 heartbeat -> -",
		"[130] w1 heartbeat -> -",
		"[150] w1 heartbeat -> -",
		"[175] w1 heartbeat -> -",
		"[181] tick -> -",
		"[182] tick -> w1 gets j1 g2 p0 boot",
		"[183] w1 batch j1 g2 p0 boot -> merge, merged, j1 prepare",
		NULL,
	});
}

static void late_lease_gets_a_second_worker(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			TRANSCRIPT_START_TWO,
			"[1] w3 joins A threads=1 -> -",
			"[1] w3 wants 1 -> -",
			"[3] w2 batch j1 g1 p0 e0 -> merge, merged, w3 gets j1 g1 p0 e1",
			"[3] w3 batch j1 g1 p0 e1 -> merge, merged",
			/* the median is 2 s: after 3 s a second worker gets a copy, and never a third */
			"[3.9] tick -> -",
			"[3.9] wake -> 4",
			"[4] tick -> w2 gets j1 g0 p0 e0",
			"[9] w3 heartbeat -> -",
			"[9] w2 batch j1 g0 p0 e0 -> merge, merged, w1 loses j1 g0 p0 e0, j1 round 1, w3 gets j1 g0 p0 e1",
			"[9] w1 batch j1 g0 p0 e0 -> repeat: merged already",
			NULL,
		});
	struct job_status j;
	assert_true(farm_job_status(f, 1, 9, &j));
	assert_int_equal(j.counts.duplicates, 1);
	assert_int_equal(j.counts.repeats, 1);
	farm_free(f);
}

/* A worker whose lease a copy overtook may hold half as many leases afterwards; the one that had the copy keeps its
 * limit. */
static void overtaken_worker_gets_half_as_many_leases(void **state)
{
	(void)state;
	static const char *const before[] = {
		"[0] restore j1 render 0,0,0,0,0,0,0,0 groups=8 rounds=9 -> j1 is running",
		"[0] w1 joins A threads=8 -> -",
		"[0] w1 wants 9 -> w1 gets j1 g0 p0 e0, w1 gets j1 g1 p0 e0, w1 gets j1 g2 p0 e0, w1 gets j1 g3 p0 e0, "
		"w1 gets j1 g4 p0 e0, w1 gets j1 g5 p0 e0, w1 gets j1 g6 p0 e0, w1 gets j1 g7 p0 e0",
		"[1] w2 joins A threads=1 -> -",
		"[1] w2 wants 1 -> -",
		"[25] w1 heartbeat -> -",
		"[29] w2 heartbeat -> -",
		"[30] tick -> w2 gets j1 g0 p0 e0",
		"[30] w2 wants 0 -> -",
		NULL};
	struct farm *f = transcript_farm_new();
	transcript_play(f, before);
	/* with seven leases it has more than half of eight */
	transcript_play(f, (const char *const[]){
				   "[31] w2 batch j1 g0 p0 e0 -> merge, merged, w1 loses j1 g0 p0 e0",
				   NULL,
			   });
	farm_free(f);
	f = transcript_farm_new();
	transcript_play(f, before);
	/* the first result counts all the same: no worker was late */
	transcript_play(f,
			(const char *const[]){
				"[31] w1 batch j1 g0 p0 e0 -> merge, merged, w2 loses j1 g0 p0 e0, w1 gets j1 g0 p0 e1",
				NULL,
			});
	farm_free(f);
}

static void returned_lease_goes_to_another_worker(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		TRANSCRIPT_START_TWO,
		"[2] w1 wants 0 -> -",
		"[2] w2 wants 2 -> -",
		"[2] w1 returns j1 g0 p0 e0 -> w2 gets j1 g0 p0 e0",
		NULL,
	});
}

static void number_of_requested_leases_is_limited_by_threads(void **state)
{
	(void)state;
	/* the number of leases is limited by the worker's request, and by its threads */
	transcript_check((const char *const[]){
		"[0] submit groups=8 parts=4 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1000 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g0 p1 boot, "
		"w1 gets j1 g0 p2 boot, w1 gets j1 g0 p3 boot",
		"[0] w1 wants 1 -> -",
		"[1] w1 batch j1 g0 p0 boot -> merge, merged",
		NULL,
	});
}

static bool try_join(struct farm *f, uint64_t id, const char *name)
{
	struct event ev = {.kind = EVENT_JOINED, .join = {.peer = id, .name = name, .fingerprint = "A", .threads = 1}};
	struct update u;
	farm_step(f, &ev, &u);
	return u.count == 0;
}

/* A name is kept byte by byte, even if it ends within a letter; a worker without a name, or with one longer than hello
 * allows, is refused. */
static void names_of_workers_are_limited_in_length(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	struct peer_status p, q;
	char name[JOIN_NAME_SIZE + 1];
	for (size_t i = 0; i + 1 < sizeof name; i += 2)
		memcpy(name + i, "\xc3\xa4", 3);
	assert_false(try_join(f, 1, name));
	assert_false(try_join(f, 1, ""));
	name[JOIN_NAME_SIZE - 2] = 0;
	assert_true(try_join(f, 1, name));
	name[JOIN_NAME_SIZE - 4] = 0;
	assert_true(try_join(f, 2, name));
	assert_true(farm_peer_status(f, 2, &p) && farm_peer_status(f, 1, &q));
	assert_string_equal(p.name, name);
	assert_true(p.worker_id != q.worker_id);
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(job_runs_from_bootstrap_to_end),
		cmocka_unit_test(two_rounds_are_open_at_once),
		cmocka_unit_test(a_lease_counts_once),
		cmocka_unit_test(unknown_workers_and_ended_jobs_are_refused),
		cmocka_unit_test(worker_is_quarantined_after_three_faults),
		cmocka_unit_test(lease_of_a_lost_or_silent_worker_is_given_again),
		cmocka_unit_test(messages_read_late_make_no_worker_silent),
		cmocka_unit_test(worker_silent_for_long_is_disconnected),
		cmocka_unit_test(overdue_lease_is_given_again),
		cmocka_unit_test(timeout_of_a_lease_follows_the_median_duration),
		cmocka_unit_test(late_lease_gets_a_second_worker),
		cmocka_unit_test(overtaken_worker_gets_half_as_many_leases),
		cmocka_unit_test(returned_lease_goes_to_another_worker),
		cmocka_unit_test(number_of_requested_leases_is_limited_by_threads),
		cmocka_unit_test(names_of_workers_are_limited_in_length),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
