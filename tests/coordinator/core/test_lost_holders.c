/* SPDX-License-Identifier: Apache-2.0 */
/* Workers that disconnect while they hold leases, as transcripts: which of these losses count against a job and its
 * owner. */
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define JOB "[0] submit groups=1 -> j1 submitted, j1 is queued"

static enum job_state read_job_state(const struct farm *f, uint64_t job, double now, struct job_status *s)
{
	assert_true(farm_job_status(f, job, now, s));
	return s->state;
}

static void play_line(struct farm *f, const char *line)
{
	transcript_play(f, (const char *const[]){line, NULL});
}

/* A lease that ends with its worker's connection is counted once, whichever side closed the connection. */
static void lease_lost_with_its_connection_is_counted_once(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	struct job_counts c;
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=2 parts=2 -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=2 home=a start=1 -> -",
				   "[0] w2 joins A threads=1 home=b start=1 -> -",
				   "[1] w1 wants 2 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g0 p1 boot",
				   "[2] w1 batch j1 g0 p0 boot -> merge, merged, w1 gets j1 g1 p0 boot",
				   "[2] w2 wants 1 -> w2 gets j1 g1 p1 boot",
				   "[3] w1 leaves -> -",
				   NULL,
			   });
	assert_true(farm_job_counts(f, 1, &c));
	assert_int_equal(c.lost, 2);
	play_line(f, "[4] w3 joins A threads=1 home=b start=2 -> close w2");
	assert_true(farm_job_counts(f, 1, &c));
	assert_int_equal(c.lost, 3);
	farm_free(f);
}

/* The render process dies, and the worker reconnects after a restart and reports the lease that it held: this counts
 * once as a failure, as if the worker still held the lease. The job fails after three workers, and its owner's next job
 * gets one lease at a time. */
static void failure_reported_after_a_restart_counts_once(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			"[0] submit groups=1 owner=ann -> j1 submitted, j1 is queued",
			"[0] w1 joins A threads=1 home=a start=1 -> -",
			"[0] w2 joins A threads=1 home=b start=1 -> -",
			"[0] w3 joins A threads=1 home=c start=1 -> -",
			"[1] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
			"[2] w1 leaves -> -",
			"[2] w4 joins A threads=1 name=d home=a start=2 -> -",
			"[2] w4 fails j1 g0 p0 boot SIGSEGV -> -",
			"[2] w4 fails j1 g0 p0 boot SIGSEGV -> -", /* reported once */
			"[2] w4 wants 1 -> -",			   /* and the worker pauses */
			"[2] w2 wants 1 -> w2 gets j1 g0 p0 boot",
			/* the restarted worker connects before the old connection is known to be cut */
			"[3] w5 joins A threads=1 home=b start=2 -> close w2",
			"[3] w5 fails j1 g0 p0 boot SIGABRT -> -",
			"[3] w3 wants 1 -> w3 gets j1 g0 p0 boot",
			"[3] w3 leaves -> -",
			"[3] w6 joins A threads=1 home=c start=2 -> -",
			"[3] w6 fails j1 g0 p0 boot SIGFPE -> j1 is failed (failed: w6: SIGFPE)",
			"[3] submit groups=2 parts=2 owner=ann -> j2 submitted, j2 is queued, j2 is bootstrap, w4 gets j2 g0 p0 boot",
			"[3] w6 wants 1 -> -",
			"[3] w5 wants 1 -> -",
			/* ann, whose job failed, does not get all workers: the others go to bob */
			"[3] submit groups=2 parts=1 owner=bob -> j3 submitted, j3 is queued, j3 is bootstrap, "
			"w6 gets j3 g0 p0 boot, w5 gets j3 g1 p0 boot",
			"[4] w5 batch j3 g1 p0 boot -> merge, merged",
			NULL,
		});
	struct job_status s;
	assert_int_equal(read_job_state(f, 2, 4, &s), JOB_BOOTSTRAP);
	assert_int_equal(s.leases, 1);
	/* a result was merged: the job is as good as any other */
	play_line(f, "[5] w4 batch j2 g0 p0 boot -> merge, merged, w5 gets j2 g0 p1 boot, w4 gets j2 g1 p0 boot");
	farm_free(f);
}

/* The limit on an owner expires, and the status gives the reason while it lasts. */
static void limit_on_an_owner_expires(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=1 owner=ann -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=1 home=a start=1 -> -",
				   "[0] w2 joins A threads=1 home=b start=1 -> -",
				   "[0] w3 joins A threads=1 home=c start=1 -> -",
				   "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
				   "[0] w4 joins A threads=1 home=a start=2 -> close w1",
				   "[0] w4 fails j1 g0 p0 boot dead -> -",
				   "[0] w2 wants 1 -> w2 gets j1 g0 p0 boot",
				   "[0] w5 joins A threads=1 home=b start=2 -> close w2",
				   "[0] w5 fails j1 g0 p0 boot dead -> -",
				   "[0] w3 wants 1 -> w3 gets j1 g0 p0 boot",
				   "[0] w6 joins A threads=1 home=c start=2 -> close w3",
				   "[0] w6 fails j1 g0 p0 boot dead -> j1 is failed (failed: w6: dead)",
				   "[1] submit groups=1 owner=ann -> j2 submitted, j2 is queued",
				   "[1] submit groups=1 owner=ann -> j3 submitted, j3 is queued",
				   "[1] w6 wants 1 -> j2 is bootstrap, w6 gets j2 g0 p0 boot",
				   "[1] w5 wants 1 -> -",
				   NULL,
			   });
	struct job_status s;
	assert_int_equal(read_job_state(f, 3, 1, &s), JOB_QUEUED);
	assert_non_null(strstr(s.waiting, "one lease at a time"));
	transcript_play(f, (const char *const[]){
				   "[25] w6 heartbeat -> -",
				   "[25] w5 heartbeat -> -",
				   "[50] w6 heartbeat -> -",
				   "[50] w5 heartbeat -> -",
				   "[61] w5 heartbeat -> j3 is bootstrap, w5 gets j3 g0 p0 boot",
				   NULL,
			   });
	farm_free(f);
}

/* Workers vanish without a reason and do not return: the job fails after eight in a row on one lease, with nothing
 * merged in between. */
static void eight_workers_lost_in_a_row_fail_the_job(void **state)
{
	(void)state;
	char line[160];
	struct farm *f = transcript_farm_new();
	play_line(f, JOB);
	for (int i = 1; i <= 8; i++) {
		snprintf(line, sizeof line, "[%d] w%d joins A threads=1 -> -", i, i);
		play_line(f, line);
		snprintf(line, sizeof line, "[%d] w%d wants 1 -> %sw%d gets j1 g0 p0 boot", i, i,
			 i == 1 ? "j1 is bootstrap, " : "", i);
		play_line(f, line);
		snprintf(line, sizeof line, "[%d] w%d leaves -> %s", i, i,
			 i < 8 ? "-"
			       : "j1 is failed (failed: job: 8 workers in a row were lost while they held "
				 "bootstrap group 0 part 0 epoch 0 (8 end the job); the last one: w8)");
		play_line(f, line);
	}
	farm_free(f);
}

/* One worker that vanishes again and again counts once, and comes back each time: killed and restarted, or cut off and
 * reconnected. */
static void one_worker_lost_repeatedly_fails_no_job(void **state)
{
	(void)state;
	char line[160];
	struct job_status s;
	struct farm *f = transcript_farm_new();
	play_line(f, JOB);
	for (int i = 1; i <= 20; i++) {
		snprintf(line, sizeof line, "[%d] w%d joins A threads=1 name=a home=a start=%d -> -", i, i, 1 + i / 2);
		play_line(f, line);
		snprintf(line, sizeof line, "[%d] w%d wants 1 -> %sw%d gets j1 g0 p0 boot", i, i,
			 i == 1 ? "j1 is bootstrap, " : "", i);
		play_line(f, line);
		snprintf(line, sizeof line, "[%d] w%d leaves -> -", i, i);
		play_line(f, line);
	}
	assert_int_equal(read_job_state(f, 1, 21, &s), JOB_BOOTSTRAP);
	assert_int_equal(s.counts.failures, 0);
	farm_free(f);
}

/* Racks of four workers lose power again and again in the middle of all leases; then they, or others, connect. Each
 * merged result restarts the count. */
static void racks_losing_power_fail_no_job(void **state)
{
	(void)state;
	char line[200];
	struct job_status s;
	struct farm *f = transcript_farm_new();
	play_line(f, "[0] submit groups=4 rounds=9 -> j1 submitted, j1 is queued");
	int peer = 0;
	for (int rack = 0; rack < 14; rack++) {
		for (int i = 0; i < 4; i++) {
			snprintf(line, sizeof line, "[%d] w%d joins A threads=1 -> -", rack, peer + i + 1);
			play_line(f, line);
		}
		struct update u;
		for (int i = 1; i <= 4; i++)
			farm_step(f,
				  &(struct event){.kind = EVENT_LEASE_REQUEST,
						  .time = rack,
						  .peer = (uint64_t)(peer + i),
						  .wanted_leases = 1},
				  &u);
		if (rack % 7 == 6) /* one result of each lease is merged */
			for (uint32_t g = 0; g < 4; g++)
				for (uint64_t i = 1; i <= 4; i++) {
					struct lease_status l;
					if (!farm_lease_status(f, (uint64_t)peer + i, 0, &l) || l.key.group != g)
						continue;
					struct event batch = {
						.kind = EVENT_BATCH, .time = rack, .peer = (uint64_t)peer + i};
					batch.lease.key = l.key;
					batch.lease.is_valid = true;
					farm_step(f, &batch, &u);
				}
		for (int i = 1; i <= 4; i++)
			farm_step(f, &(struct event){.kind = EVENT_LEFT, .time = rack, .peer = (uint64_t)(peer + i)},
				  &u);
		peer += 4;
	}
	assert_true(read_job_state(f, 1, 15, &s) != JOB_FAILED);
	assert_int_equal(s.counts.failures, 0);
	farm_free(f);
}

/* Eight names with one certificate do not count as eight workers, if the farm has workers with another certificate. */
static void lost_workers_of_one_certificate_fail_no_job(void **state)
{
	(void)state;
	char line[160];
	struct job_status s;
	struct farm *f = transcript_farm_new();
	play_line(f, JOB);
	play_line(f, "[0] w90 joins A threads=1 certificate=b -> -");
	for (int i = 1; i <= 12; i++) {
		snprintf(line, sizeof line, "[%d] w%d joins A threads=1 certificate=a -> -", i, i);
		play_line(f, line);
		snprintf(line, sizeof line, "[%d] w%d wants 1 -> %sw%d gets j1 g0 p0 boot", i, i,
			 i == 1 ? "j1 is bootstrap, " : "", i);
		play_line(f, line);
		snprintf(line, sizeof line, "[%d] w%d leaves -> -", i, i);
		play_line(f, line);
	}
	assert_int_equal(read_job_state(f, 1, 13, &s), JOB_BOOTSTRAP);
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(lease_lost_with_its_connection_is_counted_once),
		cmocka_unit_test(failure_reported_after_a_restart_counts_once),
		cmocka_unit_test(limit_on_an_owner_expires),
		cmocka_unit_test(eight_workers_lost_in_a_row_fail_the_job),
		cmocka_unit_test(one_worker_lost_repeatedly_fails_no_job),
		cmocka_unit_test(racks_losing_power_fail_no_job),
		cmocka_unit_test(lost_workers_of_one_certificate_fail_no_job),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
