/* SPDX-License-Identifier: Apache-2.0 */
/* Chain states that workers refuse, as transcripts: which worker is asked next, which one is to blame, and that no job
 * fails because of it. */
#include "coordinator/core/doubt.h"
#include "coordinator/core/worker_registry.h"
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* Each worker has one slot; the first worker makes the states after epoch 0 and leaves the next lease to others. */
/* clang-format off */
#define START                                                                       \
	"[0] submit groups=1 rounds=4 -> j1 submitted, j1 is queued",               \
	"[0] w1 joins A threads=1 name=a -> -",                                     \
	"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",                 \
	"[1] w1 batch j1 g0 p0 boot -> merge, merged, j1 prepare",                  \
	"[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0",                    \
	"[2] w1 wants 0 -> -", "[2] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1"
/* clang-format on */

#define WORKER(N, NAME) "[3] w" #N " joins A threads=1 name=" NAME " -> -"

static uint32_t read_wrong_count(const struct farm *f, uint64_t who)
{
	struct worker_status w;
	assert_true(farm_worker_status(f, who, &w));
	return w.wrong_results;
}

static void chains_begin_anew_where_no_earlier_states_are_left(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START,
				   WORKER(2, "b"),
				   WORKER(3, "c"),
				   "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
				   /* Neither the worker that refused nor the one that made the states gets the lease,
				    * though the maker would accept it. */
				   "[4] w2 denies j1 g0 p0 e1 not mine -> -",
				   "[4] w1 wants 1 -> -",
				   NULL,
			   });
	struct job_status j;
	assert_true(farm_job_status(f, 1, 4, &j));
	assert_non_null(strstr(
		j.waiting,
		"a third worker will decide whether the chain states of group 0 part 0 epoch 1 are wrong: a made them, b refused"));
	transcript_play(f, (const char *const[]){
				   "[5] w3 wants 1 -> w3 gets j1 g0 p0 e1",
				   "[6] w3 denies j1 g0 p0 e1 not mine either -> anew, "
				   "#1 wrong chain states: j1 render group 0 part 0 epoch 0, w2 gets j1 g0 p0 e1 anew",
				   /* The lease is given with chain states again. */
				   "[7] w2 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w1 gets j1 g0 p0 e2",
				   NULL,
			   });
	struct peer_status p;
	assert_int_equal(read_wrong_count(f, 1), 1);
	assert_int_equal(read_wrong_count(f, 2) + read_wrong_count(f, 3), 0);
	assert_true(farm_peer_status(f, 2, &p) && p.failures == 0 && p.faults == 0);
	assert_string_equal(doubt_maker_name(f, &(struct lease_key){1, LEASE_RENDER, 0, 0, 2}), "b");
	/* The maker of the states is unknown for other leases: of an earlier epoch, of one that no worker holds, or
	 * without states. */
	assert_string_equal(doubt_maker_name(f, &(struct lease_key){1, LEASE_RENDER, 0, 0, 1}), "?");
	assert_string_equal(doubt_maker_name(f, &(struct lease_key){1, LEASE_RENDER, 0, 0, 3}), "?");
	assert_string_equal(doubt_maker_name(f, &(struct lease_key){1, LEASE_BOOTSTRAP, 0, 0, 0}), "?");
	assert_true(farm_job_status(f, 1, 8, &j));
	assert_int_equal(j.state, JOB_RUNNING);
	farm_free(f);
}

static void third_worker_that_continues_outvotes_the_refusal(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			START,
			WORKER(2, "b"),
			WORKER(3, "c"),
			"[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
			"[3] w3 wants 1 -> -",
			"[4] w2 denies j1 g0 p0 e1 no -> w3 gets j1 g0 p0 e1",
			"[5] w3 batch j1 g0 p0 e1 -> merge, merged, "
			"#2 refused good chain states: j1 render group 0 part 0 epoch 1, j1 round 2, w2 gets j1 g0 p0 e2",
			NULL,
		});
	assert_int_equal(read_wrong_count(f, 2), 1);
	assert_int_equal(read_wrong_count(f, 1) + read_wrong_count(f, 3), 0);
	farm_free(f);
}

/* With one worker's word against another's nobody is to blame, and the job goes on. */
static void chains_begin_anew_if_there_is_no_third_worker(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START,
				   WORKER(2, "b"),
				   "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
				   "[4] w2 denies j1 g0 p0 e1 no -> anew, w2 gets j1 g0 p0 e1 anew",
				   "[5] w2 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w2 gets j1 g0 p0 e2",
				   "[6] w2 denies j1 g0 p0 e2 my own -> -", /* The worker made the states itself: the
									     * other worker is asked. */
				   "[6] w1 wants 1 -> w1 gets j1 g0 p0 e2",
				   "[7] w1 denies j1 g0 p0 e2 no -> anew, w2 gets j1 g0 p0 e2 anew",
				   NULL,
			   });
	assert_int_equal(read_wrong_count(f, 1) + read_wrong_count(f, 2), 0);
	farm_free(f);
}

/* The third worker leaves before it has answered: the first two are asked again. */
static void first_two_are_asked_again_if_the_third_leaves(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START,
				   WORKER(2, "b"),
				   WORKER(3, "c"),
				   "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
				   "[4] w2 denies j1 g0 p0 e1 no -> -",
				   "[5] w3 leaves -> w2 gets j1 g0 p0 e1",
				   "[6] w2 denies j1 g0 p0 e1 no -> anew, w2 gets j1 g0 p0 e1 anew",
				   NULL,
			   });
	assert_int_equal(read_wrong_count(f, 1) + read_wrong_count(f, 2), 0);
	farm_free(f);
}

/* The worker that made the states may continue from them; its result does not count as a third opinion. */
static void maker_may_continue_from_its_own_states(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START,
				   WORKER(2, "b"),
				   WORKER(3, "c"),
				   "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
				   "[3] w2 wants 0 -> -",
				   "[4] w2 denies j1 g0 p0 e1 no -> -",
				   "[5] w3 leaves -> -",
				   "[5] w1 wants 1 -> w1 gets j1 g0 p0 e1",
				   "[6] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w1 gets j1 g0 p0 e2",
				   NULL,
			   });
	assert_int_equal(read_wrong_count(f, 1) + read_wrong_count(f, 2), 0);
	farm_free(f);
}

/* The epoch that ended in the refused states is computed again, by another worker; if its round was complete, the round
 * is open again. */
static void second_refusal_takes_the_epoch_back(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START,
				   WORKER(2, "b"),
				   WORKER(3, "c"),
				   "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
				   "[4] w2 refuses j1 g0 p0 e1 no -> -",
				   "[5] w1 wants 1 -> -",
				   "[5] w3 wants 1 -> w3 gets j1 g0 p0 e1",
				   "[6] w3 refuses j1 g0 p0 e1 no -> back j1 g0 p0 e0, "
				   "#1 wrong chain states: j1 render group 0 part 0 epoch 0, w2 gets j1 g0 p0 e0",
				   NULL,
			   });
	struct job_status j;
	assert_true(farm_job_status(f, 1, 6, &j));
	assert_int_equal(j.rounds, 0);
	assert_int_equal(j.leases_merged, 0);
	assert_true(j.progress > 0);
	transcript_play(f, (const char *const[]){
				   "[6] w1 batch j1 g0 p0 e1 -> refused: the epoch is not open",
				   "[7] w2 wants 0 -> -",
				   /* The lease does not go to the worker that made the states while there is another
				    * one. */
				   "[7] w2 returns j1 g0 p0 e0 -> w3 gets j1 g0 p0 e0",
				   "[7] w2 wants 1 -> -",
				   "[7] w3 wants 0 -> -",
				   "[7] w3 returns j1 g0 p0 e0 -> w2 gets j1 g0 p0 e0",
				   "[8] w2 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w1 gets j1 g0 p0 e1",
				   "[9] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w2 gets j1 g0 p0 e2",
				   NULL,
			   });
	assert_int_equal(read_wrong_count(f, 1), 1);
	assert_int_equal(read_wrong_count(f, 2) + read_wrong_count(f, 3), 0);
	farm_free(f);
}

/* The grant crossed with the refusal of states that are now discarded: the worker still has the lease, and nobody is to
 * blame. */
static void late_refusal_of_discarded_states_is_ignored(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START,
				   WORKER(2, "b"),
				   WORKER(3, "c"),
				   "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
				   "[3] w3 wants 1 -> -",
				   "[4] w2 refuses j1 g0 p0 e1 no -> w3 gets j1 g0 p0 e1",
				   "[5] w3 refuses j1 g0 p0 e1 no -> back j1 g0 p0 e0, "
				   "#1 wrong chain states: j1 render group 0 part 0 epoch 0, w2 gets j1 g0 p0 e0",
				   "[6] w2 wants 0 -> -",
				   "[6] w2 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w3 gets j1 g0 p0 e1",
				   "[7] w3 recalls j1 g0 p0 e1 no -> -",
				   "[8] w3 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w3 gets j1 g0 p0 e2",
				   NULL,
			   });
	assert_int_equal(read_wrong_count(f, 1), 1);
	assert_int_equal(read_wrong_count(f, 2) + read_wrong_count(f, 3), 0);
	farm_free(f);
}

/* A copy of the lease is at another worker, with the states that are discarded: it is taken back, and what that worker
 * then says about these states comes too late. */
static void lease_with_discarded_states_is_revoked(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START,
				   WORKER(2, "b"),
				   WORKER(3, "c"),
				   "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
				   "[4] w3 wants 1 -> -",
				   "[6] w2 heartbeat -> w3 gets j1 g0 p0 e1",
				   "[6] w4 joins A threads=1 name=d -> -",
				   "[7] w2 wants 0 -> -",
				   "[7] w2 refuses j1 g0 p0 e1 no -> -",
				   "[7] w4 wants 1 -> -",
				   "[12] w3 heartbeat -> w4 gets j1 g0 p0 e1",
				   "[13] w4 denies j1 g0 p0 e1 no -> w3 loses j1 g0 p0 e1, anew, "
				   "#1 wrong chain states: j1 render group 0 part 0 epoch 0, w4 gets j1 g0 p0 e1 anew",
				   "[13] w3 refuses j1 g0 p0 e1 no -> -", /* about the lease it held before */
				   "[13] w4 refuses j1 g0 p0 e1 no -> -", /* also about the earlier lease */
				   "[14] w4 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w3 gets j1 g0 p0 e2",
				   NULL,
			   });
	farm_free(f);
}

/* A worker that refuses states again and again does not hold up the job for ever. */
static void chains_begin_anew_after_four_refusals(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   START,
				   WORKER(2, "b"),
				   "[3] w2 wants 1 -> w2 gets j1 g0 p0 e1",
				   NULL,
			   });
	for (int i = 0; i < 4; i++)
		transcript_play(f, (const char *const[]){
					   /* The states were made by the other worker. */
					   "[4] w2 refuses j1 g0 p0 e1 no -> back j1 g0 p0 e0, w2 gets j1 g0 p0 e0",
					   "[4] w2 wants 0 -> -",
					   "[4] w2 returns j1 g0 p0 e0 -> -",
					   "[4] w1 wants 1 -> -", /* it made the epoch's states, and another worker is
								   * connected */
					   "[4] w2 leaves -> w1 gets j1 g0 p0 e0",
					   "[5] w1 wants 0 -> -",
					   "[5] w1 batch j1 g0 p0 e0 -> merge, merged, j1 round 1",
					   "[5] w2 joins A threads=1 name=b -> -",
					   "[5] w2 wants 1 -> w2 gets j1 g0 p0 e1",
					   NULL,
				   });
	transcript_play(f, (const char *const[]){
				   "[6] w2 refuses j1 g0 p0 e1 no -> anew, w2 gets j1 g0 p0 e1 anew",
				   "[7] w2 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w2 gets j1 g0 p0 e2",
				   NULL,
			   });
	assert_int_equal(read_wrong_count(f, 1) + read_wrong_count(f, 2), 0);
	farm_free(f);
}

/* One worker made several epochs in a row, and so far only the last states were checked. */
static void unchecked_epochs_are_taken_back_one_by_one(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=2 rounds=4 -> j1 submitted, j1 is queued",
				   "[0] w1 joins A threads=2 name=a -> -",
				   "[0] w1 wants 2 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot",
				   "[1] w1 batch j1 g0 p0 boot -> merge, merged",
				   "[1] w1 batch j1 g1 p0 boot -> merge, merged, j1 prepare",
				   "[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w1 gets j1 g1 p0 e0",
				   "[2] w2 joins A threads=2 name=b -> -",
				   "[2] w3 joins A threads=2 name=c -> -",
				   "[2] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
				   "[2] w1 wants 1 -> -",
				   "[2] w1 batch j1 g0 p0 e1 -> merge, merged",
				   "[2] w1 batch j1 g1 p0 e0 -> merge, merged, j1 round 1, w1 gets j1 g1 p0 e1",
				   "[2] w2 wants 1 -> w2 gets j1 g0 p0 e2",
				   "[2] w1 batch j1 g1 p0 e1 -> merge, merged, j1 round 2, w1 gets j1 g1 p0 e2",
				   "[3] w2 refuses j1 g0 p0 e2 no -> -",
				   "[3] w3 wants 1 -> w3 gets j1 g0 p0 e2",
				   "[4] w3 refuses j1 g0 p0 e2 no -> back j1 g0 p0 e1, "
				   "#1 wrong chain states: j1 render group 0 part 0 epoch 1, w2 gets j1 g0 p0 e1",
				   NULL,
			   });
	transcript_play(
		f,
		(const char *const[]){
			"[5] w1 wants 0 -> -",
			"[5] w1 batch j1 g1 p0 e2 -> merge, merged", /* one round ahead */
			"[5] w2 refuses j1 g0 p0 e1 no -> w3 gets j1 g0 p0 e1",
			"[6] w3 refuses j1 g0 p0 e1 no -> back j1 g0 p0 e0, "
			"#1 wrong chain states: j1 render group 0 part 0 epoch 0, w2 gets j1 g0 p0 e0",
			"[7] w2 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w3 gets j1 g0 p0 e1",
			"[8] w3 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, w2 gets j1 g0 p0 e2, w3 gets j1 g1 p0 e3",
			"[9] w2 batch j1 g0 p0 e2 -> merge, merged, j1 round 3, w2 gets j1 g0 p0 e3",
			"[9] w3 batch j1 g1 p0 e3 -> merge, merged",
			"[9] w2 batch j1 g0 p0 e3 -> merge, merged, j1 round 4, j1 publish 4, j1 is done (mutations)",
			NULL,
		});
	assert_int_equal(read_wrong_count(f, 1), 2);
	assert_int_equal(read_wrong_count(f, 2) + read_wrong_count(f, 3), 0);
	farm_free(f);
}

/* A worker that refuses states which others can continue from is quarantined after three times. */
static void worker_that_refuses_good_states_is_quarantined(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(
		f,
		(const char *const[]){
			"[0] submit groups=3 rounds=4 -> j1 submitted, j1 is queued",
			"[0] w1 joins A threads=3 name=a -> -",
			"[0] w1 wants 3 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot",
			"[1] w1 batch j1 g0 p0 boot -> merge, merged",
			"[1] w1 batch j1 g1 p0 boot -> merge, merged",
			"[1] w1 batch j1 g2 p0 boot -> merge, merged, j1 prepare",
			"[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w1 gets j1 g1 p0 e0, w1 gets j1 g2 p0 e0",
			"[2] w1 wants 0 -> -",
			"[2] w1 batch j1 g0 p0 e0 -> merge, merged",
			"[2] w1 batch j1 g1 p0 e0 -> merge, merged",
			"[2] w1 batch j1 g2 p0 e0 -> merge, merged, j1 round 1",
			"[3] w2 joins A threads=3 name=b -> -",
			"[3] w3 joins A threads=3 name=c -> -",
			"[3] w2 wants 3 -> w2 gets j1 g0 p0 e1, w2 gets j1 g1 p0 e1, w2 gets j1 g2 p0 e1",
			"[4] w2 denies j1 g0 p0 e1 no -> -",
			"[4] w2 denies j1 g1 p0 e1 no -> -",
			"[4] w2 denies j1 g2 p0 e1 no -> -",
			"[5] w3 wants 3 -> w3 gets j1 g0 p0 e1, w3 gets j1 g1 p0 e1, w3 gets j1 g2 p0 e1",
			"[6] w3 wants 0 -> -",
			"[6] w3 batch j1 g0 p0 e1 -> merge, merged, "
			"#2 refused good chain states: j1 render group 0 part 0 epoch 1, w2 gets j1 g0 p0 e2",
			"[6] w3 batch j1 g1 p0 e1 -> merge, merged, "
			"#2 refused good chain states: j1 render group 1 part 0 epoch 1, w2 gets j1 g1 p0 e2",
			NULL,
		});
	transcript_play(f, (const char *const[]){
				   "[6] w3 batch j1 g2 p0 e1 -> merge, merged, "
				   "#2 refused good chain states: j1 render group 2 part 0 epoch 1, #2 quarantined, "
				   "w2 loses j1 g0 p0 e2, w2 loses j1 g1 p0 e2, j1 round 2",
				   NULL,
			   });
	assert_int_equal(read_wrong_count(f, 1) + read_wrong_count(f, 3), 0);
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(chains_begin_anew_where_no_earlier_states_are_left),
		cmocka_unit_test(third_worker_that_continues_outvotes_the_refusal),
		cmocka_unit_test(chains_begin_anew_if_there_is_no_third_worker),
		cmocka_unit_test(first_two_are_asked_again_if_the_third_leaves),
		cmocka_unit_test(maker_may_continue_from_its_own_states),
		cmocka_unit_test(second_refusal_takes_the_epoch_back),
		cmocka_unit_test(late_refusal_of_discarded_states_is_ignored),
		cmocka_unit_test(lease_with_discarded_states_is_revoked),
		cmocka_unit_test(chains_begin_anew_after_four_refusals),
		cmocka_unit_test(unchecked_epochs_are_taken_back_one_by_one),
		cmocka_unit_test(worker_that_refuses_good_states_is_quarantined),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
