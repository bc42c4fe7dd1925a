/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Verified leases, as transcripts: a result counts once two workers have returned the same numbers, a third worker
 * decides where they differ, and a worker that was outvoted too often is quarantined and all its unconfirmed results
 * are dropped. Also which connections count as the same worker after restarts, reconnections and changes of name.
 */
#include "coordinator/core/worker_registry.h"
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* One chain, every lease verified, three workers. */
/* clang-format off */
#define START                                                                          \
	"[0] submit groups=1 verify=1 -> j1 submitted, j1 is queued",                  \
	"[0] w1 joins A threads=1 name=a -> -", "[0] w2 joins A threads=1 name=b -> -", \
	"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",                    \
	"[0] w2 wants 1 -> w2 gets j1 g0 p0 boot"
/* clang-format on */

/* clang-format off */
#define START_ROUNDS                                                                   \
	START, "[1] w1 batch j1 g0 p0 boot says x -> noted",                           \
	"[1] w2 batch j1 g0 p0 boot says x -> merge, merged, j1 prepare",              \
	"[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w2 gets j1 g0 p0 e0"
/* clang-format on */

static void result_counts_once_two_workers_agree(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			START_ROUNDS,
			"[2] w2 batch j1 g0 p0 e0 says x -> noted",
			"[3] w1 batch j1 g0 p0 e0 says x -> merge, merged, j1 round 1, w2 gets j1 g0 p0 e1, w1 gets j1 g0 p0 e1",
			"[4] w1 batch j1 g0 p0 e1 says y -> noted",
			"[4] w2 batch j1 g0 p0 e1 says y -> merge, merged, j1 round 2, j1 publish 2, j1 is done (mutations)",
			NULL,
		});
	struct job_status j;
	assert_true(farm_job_status(f, 1, 4, &j));
	assert_int_equal(j.counts.verified, 3);
	assert_int_equal(j.counts.mismatched, 0);
	assert_int_equal(j.counts.duplicates, 0);
	assert_int_equal(farm_next_quarantined(f, 0), 0);
	farm_free(f);
}

static void third_worker_decides_where_two_differ(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			START_ROUNDS,
			"[2] w1 batch j1 g0 p0 e0 says x -> noted",
			"[2] w2 batch j1 g0 p0 e0 says y -> noted: the result differs from another worker's",
			"[2] w3 joins A threads=1 name=c -> -",
			"[2] w3 wants 1 -> w3 gets j1 g0 p0 e0",
			"[3] w3 batch j1 g0 p0 e0 says y -> merge, merged, #1 wrong result: j1 render group 0 part 0 epoch 0, j1 round 1, "
			"w1 gets j1 g0 p0 e1, w2 gets j1 g0 p0 e1",
			NULL,
		});
	struct job_status j;
	struct peer_status p;
	assert_true(farm_job_status(f, 1, 4, &j));
	assert_int_equal(j.counts.verified, 2);
	assert_int_equal(j.counts.mismatched, 1);
	assert_int_equal(j.counts.failures, 0);
	assert_true(farm_peer_status(f, 1, &p));
	assert_int_equal(p.faults, 1);
	assert_string_equal(p.last_fault, "wrong result: j1 render group 0 part 0 epoch 0");
	assert_true(farm_peer_status(f, 2, &p) && p.faults == 0);
	farm_free(f);
}

static void job_fails_if_four_workers_all_differ(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		START,
		"[1] w1 batch j1 g0 p0 boot says 1 -> noted",
		"[1] w2 batch j1 g0 p0 boot says 2 -> noted: the result differs from another worker's",
		"[1] w3 joins A threads=1 name=c -> -",
		"[1] w3 wants 1 -> w3 gets j1 g0 p0 boot",
		"[1] w3 batch j1 g0 p0 boot says 3 -> noted: the result differs from another worker's",
		"[1] w4 joins A threads=1 name=d -> -",
		"[1] w4 wants 1 -> w4 gets j1 g0 p0 boot",
		"[1] w4 batch j1 g0 p0 boot says 4 -> noted: the result differs from another worker's, "
		"j1 is failed (failed: no two of 4 workers agree on group 0 part 0 epoch 0: a, b, c, d)",
		NULL,
	});
}

static void worker_cannot_verify_itself(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=2 verify=1 -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=1 name=a -> -",
				   "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
				   /* the worker gets other leases, and not this one again */
				   "[1] w1 batch j1 g0 p0 boot says x -> noted, w1 gets j1 g1 p0 boot",
				   "[1] w1 batch j1 g0 p0 boot says x -> repeat: the result waits for another worker's",
				   "[1] w1 batch j1 g1 p0 boot says x -> noted",
				   NULL,
			   });
	struct job_status j;
	assert_true(farm_job_status(f, 1, 1, &j));
	assert_string_equal(j.waiting, "verification waits for a second worker (2 leases have one answer)");
	transcript_play(
		f,
		(const char *const[]){
			/* another connection of the same name is the same worker, and so is another name with the same
			 * home */
			"[1] w2 joins A threads=1 name=a home=c start=1 -> -",
			"[1] w2 wants 1 -> -",
			"[1] w3 joins A threads=1 name=b home=c start=1 -> close w2",
			"[1] w3 wants 1 -> -",
			"[1] w3 batch j1 g0 p0 boot says x -> repeat: the result waits for another worker's",
			"[1] w3 batch j1 g0 p0 boot says y -> refused: the result differs from the same worker's earlier one",
			/* with another certificate it is another worker */
			"[1] w4 joins A threads=1 certificate=d name=a -> -",
			"[1] w4 wants 1 -> w4 gets j1 g0 p0 boot",
			"[2] w4 batch j1 g0 p0 boot says x -> merge, merged, w4 gets j1 g1 p0 boot",
			"[2] w4 batch j1 g1 p0 boot says x -> merge, merged, j1 prepare",
			NULL,
		});
	farm_free(f);
}

static void reconnected_worker_is_not_asked_again(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		START_ROUNDS,
		"[2] w1 batch j1 g0 p0 e0 says x -> noted",
		"[2] w1 leaves -> -",
		"[2] w2 leaves -> -",
		"[3] w3 joins A threads=1 name=a -> -",
		"[3] w3 wants 1 -> -", /* the worker is connected again, and has already answered */
		"[4] w4 joins A threads=1 name=c -> -",
		"[4] w4 wants 1 -> w4 gets j1 g0 p0 e0",
		"[5] w4 batch j1 g0 p0 e0 says x -> merge, merged, j1 round 1, w3 gets j1 g0 p0 e1, w4 gets j1 g0 p0 e1",
		NULL,
	});
}

static void restart_computes_unverified_leases_anew(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		/* unconfirmed results are lost: two workers compute the lease anew */
		"[0] restore j1 render 1 fingerprint=A elapsed=5 groups=1 rounds=9 verify=1 -> j1 is running",
		"[0] w1 joins A threads=1 name=a -> -",
		"[0] w2 joins A threads=1 name=b -> -",
		"[0] w1 batch j1 g0 p0 e1 says x -> noted",
		"[0] w1 wants 1 -> -",
		"[0] w2 wants 1 -> w2 gets j1 g0 p0 e1",
		"[1] w2 batch j1 g0 p0 e1 says x -> merge, merged, j1 round 2, w1 gets j1 g0 p0 e2, w2 gets j1 g0 p0 e2",
		NULL,
	});
}

/* A share of the leases is verified: the same leases whichever workers compute them, and about as many as were asked
 * for. */
static void requested_share_of_leases_is_verified(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=2 verify=0.3 -> j1 submitted, j1 is queued",
				   "[0] submit groups=2 -> j2 submitted, j2 is queued",
				   "[0] submit groups=2 mixed verify=1 -> j3 submitted, j3 is queued",
				   NULL,
			   });
	int verified_count = 0;
	for (uint64_t e = 0; e < 10000; e++) {
		struct lease_key k = {1, LEASE_RENDER, (uint32_t)(e & 1), 0, e / 2};
		verified_count += farm_lease_is_verified(f, &k);
		k.job = 2;
		assert_false(farm_lease_is_verified(f, &k));
		k.job = 3;
		assert_false(farm_lease_is_verified(f, &k));
	}
	assert_in_range(verified_count, 2760, 3240); /* within 5.2 sigma of a fair draw; the draw is fixed */
	farm_free(f);
}

static void worker_outvoted_three_times_is_quarantined(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			"[0] submit groups=1 rounds=9 verify=1 -> j1 submitted, j1 is queued",
			"[0] w1 joins A threads=1 name=a -> -",
			"[0] w2 joins A threads=1 name=b -> -",
			"[0] w3 joins A threads=1 name=c home=c start=4 -> -",
			"[0] w3 wants 1 -> j1 is bootstrap, w3 gets j1 g0 p0 boot",
			"[0] w1 wants 1 -> w1 gets j1 g0 p0 boot",
			"[0] w2 wants 1 -> -",
			"[1] w3 batch j1 g0 p0 boot says 1 -> noted",
			"[1] w1 batch j1 g0 p0 boot says x -> noted: the result differs from another worker's, w2 gets j1 g0 p0 boot",
			"[1] w2 batch j1 g0 p0 boot says x -> merge, merged, "
			"#3 wrong result: j1 bootstrap group 0 part 0 epoch 0, j1 prepare",
			"[1] prepared j1 -> j1 is running, w3 gets j1 g0 p0 e0, w1 gets j1 g0 p0 e0",
			"[2] w3 batch j1 g0 p0 e0 says 1 -> noted",
			"[2] w1 batch j1 g0 p0 e0 says x -> noted: the result differs from another worker's, w2 gets j1 g0 p0 e0",
			"[2] w2 batch j1 g0 p0 e0 says x -> merge, merged, #3 wrong result: j1 render group 0 part 0 epoch 0, j1 round 1, "
			"w3 gets j1 g0 p0 e1, w1 gets j1 g0 p0 e1",
			"[3] w3 batch j1 g0 p0 e1 says 1 -> noted, w2 gets j1 g0 p0 e1", /* its copy at w1 is late */
			"[3] w1 batch j1 g0 p0 e1 says x -> noted: the result differs from another worker's",
			"[3] w2 batch j1 g0 p0 e1 says x -> merge, merged, "
			"#3 wrong result: j1 render group 0 part 0 epoch 1, #3 quarantined, j1 round 2, "
			"w1 gets j1 g0 p0 e2, w2 gets j1 g0 p0 e2",
			/* none of its results count, now or when it reconnects, under whatever name */
			"[4] w3 batch j1 g0 p0 e2 says x -> refused: the worker is quarantined: its results do not count",
			"[4] w3 leaves -> -",
			"[4] w5 joins A threads=1 name=d home=c start=5 -> -",
			"[4] w5 wants 1 -> -",
			"[4] w5 batch j1 g0 p0 e2 says x -> refused: the worker is quarantined: its results do not count",
			"[5] w6 joins A threads=1 name=c home=b start=1 -> -",
			"[5] w6 wants 1 -> -",
			NULL,
		});
	struct peer_status p;
	struct worker_status w;
	struct job_status j;
	assert_true(farm_peer_status(f, 6, &p));
	assert_int_equal(p.state, PEER_QUARANTINED);
	assert_int_equal(farm_next_quarantined(f, 0), 3);
	assert_int_equal(farm_next_quarantined(f, 3), 0);
	assert_true(farm_worker_status(f, 3, &w));
	assert_int_equal(w.wrong_results, 3);
	assert_string_equal(w.name, "c");
	assert_int_equal(w.restarts, 5);
	assert_string_equal(w.last_fault, "wrong result: j1 render group 0 part 0 epoch 1");
	assert_true(farm_job_status(f, 1, 5, &j));
	assert_int_equal(j.counts.failures, 0);
	assert_int_equal(j.counts.mismatched, 3);
	transcript_play(f, (const char *const[]){
				   "[6] w1 batch j1 g0 p0 e2 says x -> noted",
				   NULL,
			   });
	farm_free(f);
}

/* Its unconfirmed results of other leases do not count either. */
static void unconfirmed_results_of_a_quarantined_worker_are_dropped(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=1 rounds=9 verify=1 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 name=a -> -",
		"[0] w2 joins A threads=1 name=b -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[0] w1 batch j1 g0 p0 boot says x -> noted",
		"[1] w1 batch j1 g7 p0 boot -> refused: not a lease of this job",
		"[1] w1 batch j1 g7 p0 boot -> refused: not a lease of this job",
		"[1] w1 batch j1 g7 p0 boot -> refused: not a lease of this job, #1 quarantined",
		"[2] w2 wants 1 -> w2 gets j1 g0 p0 boot",
		"[2] w2 batch j1 g0 p0 boot says x -> noted",
		NULL,
	});
}

static void quarantined_workers_are_remembered(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] quarantined certificate=a name=b home=c -> -",
		"[0] submit groups=1 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 certificate=a name=b -> -",
		"[0] w1 wants 1 -> -",
		"[0] w2 joins A threads=1 name=b -> -",
		"[0] w2 wants 1 -> j1 is bootstrap, w2 gets j1 g0 p0 boot",
		NULL,
	});
}

static void one_identity_is_one_worker_at_a_time(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=1 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 name=a home=a start=7 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		/* the worker was restarted: the leases that it held are free at once */
		"[1] w2 joins A threads=1 name=b home=a start=8 -> close w1",
		"[1] w2 wants 1 -> w2 gets j1 g0 p0 boot",
		"[2] w3 joins A threads=1 name=a home=a start=7 -> rejected: this is start 7 of a, and its start 8 has connected before",
		/* the same process on a new connection */
		"[3] w4 joins A threads=1 name=b home=a start=8 -> close w2",
		"[3] w4 wants 1 -> w4 gets j1 g0 p0 boot",
		"[4] w4 leaves -> -",
		"[4] w5 joins A threads=1 name=a home=a start=7 -> rejected: this is start 7 of a, and its start 8 has connected before",
		/* one name on two machines, or one home with two certificates: no connection is replaced */
		"[5] w6 joins A threads=1 name=a home=b start=1 -> -",
		"[5] w7 joins A threads=1 name=a home=c start=1 -> -",
		"[5] w8 joins A threads=1 certificate=d name=a home=c start=1 -> -",
		"[5] w9 joins A threads=1 name=a -> -",
		NULL,
	});
}

/* The only worker of its kind cannot spoil a job of which nothing is merged yet. */
static void only_worker_of_its_fingerprint_cannot_block_a_job(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=1 verify=1 -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=1 name=a -> -",
				   "[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
				   "[1] w1 batch j1 g0 p0 boot says x -> noted",
				   "[2] w2 joins B threads=1 name=b -> -",
				   "[2] w2 wants 1 -> -",
				   "[2] w3 joins B threads=1 name=c -> w2 gets j1 g0 p0 boot",
				   "[2] w3 wants 1 -> w3 gets j1 g0 p0 boot",
				   "[3] w2 batch j1 g0 p0 boot says y -> noted",
				   "[3] w3 leaves -> -",
				   "[3] w2 leaves -> w1 gets j1 g0 p0 boot",
				   NULL,
			   });
	farm_free(f);
}

/* If one result is there and the second takes long, a third worker gets the lease. */
static void third_worker_is_asked_if_the_second_is_slow(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		START_ROUNDS,
		"[2] w1 batch j1 g0 p0 e0 says x -> noted",
		"[2] w2 batch j1 g0 p0 e0 says x -> merge, merged, j1 round 1, w1 gets j1 g0 p0 e1, w2 gets j1 g0 p0 e1",
		"[2] w3 joins A threads=1 name=c -> -",
		"[2] w3 wants 1 -> -",
		"[3] w1 batch j1 g0 p0 e1 says x -> noted",
		"[3.4] tick -> -",
		"[3.5] tick -> w3 gets j1 g0 p0 e1",
		"[4] w3 batch j1 g0 p0 e1 says x -> merge, merged, w2 loses j1 g0 p0 e1, j1 round 2, j1 publish 2, j1 is done (mutations)",
		NULL,
	});
}

static void quarantine_by_faults(struct farm *f, uint64_t peer, const char *certificate, const char *name)
{
	struct update u;
	struct event ev = {
		.kind = EVENT_JOINED,
		.time = 10.0 + (double)peer,
		.join = {.peer = peer, .name = name, .certificate = certificate, .fingerprint = "A", .threads = 1}};
	farm_step(f, &ev, &u);
	ev = (struct event){
		.kind = EVENT_BATCH, .time = ev.time, .peer = peer, .lease = {.key = {.job = 1, .kind = LEASE_RENDER}}};
	for (int i = 0; i < 3; i++)
		farm_step(f, &ev, &u);
	ev = (struct event){.kind = EVENT_LEFT, .time = ev.time, .peer = peer};
	farm_step(f, &ev, &u);
}

/* A worker that changes its name again and again is remembered by the last names, and displaces no record of another
 * certificate. */
static void changing_names_displace_no_other_record(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	struct worker_status w;
	char name[16];
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=1 -> j1 submitted, j1 is queued",
				   NULL,
			   });
	quarantine_by_faults(f, 1, "b", "honest once");
	for (uint64_t i = 2; i < 500; i++) {
		snprintf(name, sizeof name, "n%u", (unsigned)i);
		quarantine_by_faults(f, i, "a", name);
	}
	uint64_t who = farm_next_quarantined(f, 0);
	assert_true(farm_worker_status(f, who, &w) && strcmp(w.certificate, "b") == 0);
	int count = 0;
	while ((who = farm_next_quarantined(f, who))) {
		assert_true(farm_worker_status(f, who, &w));
		count++;
	}
	assert_int_equal(count, IDENTITY_QUARANTINED_MAX);
	assert_string_equal(w.name, "n499");
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(result_counts_once_two_workers_agree),
		cmocka_unit_test(third_worker_decides_where_two_differ),
		cmocka_unit_test(job_fails_if_four_workers_all_differ),
		cmocka_unit_test(worker_cannot_verify_itself),
		cmocka_unit_test(reconnected_worker_is_not_asked_again),
		cmocka_unit_test(restart_computes_unverified_leases_anew),
		cmocka_unit_test(requested_share_of_leases_is_verified),
		cmocka_unit_test(worker_outvoted_three_times_is_quarantined),
		cmocka_unit_test(unconfirmed_results_of_a_quarantined_worker_are_dropped),
		cmocka_unit_test(quarantined_workers_are_remembered),
		cmocka_unit_test(one_identity_is_one_worker_at_a_time),
		cmocka_unit_test(only_worker_of_its_fingerprint_cannot_block_a_job),
		cmocka_unit_test(third_worker_is_asked_if_the_second_is_slow),
		cmocka_unit_test(changing_names_displace_no_other_record),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
