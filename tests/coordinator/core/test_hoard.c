/* SPDX-License-Identifier: Apache-2.0 */
/* Workers that take as many leases as they can get and return nothing: they hold few leases, and others soon get
 * copies. */
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

#define EIGHT_LEASES                                                                                   \
	"w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot, w1 gets j1 g3 p0 boot, " \
	"w1 gets j1 g4 p0 boot, w1 gets j1 g5 p0 boot, w1 gets j1 g6 p0 boot, w1 gets j1 g7 p0 boot"

/* The first copy goes out after 30 s though the duration of leases is unknown, the next ones 1.5 medians after the
 * lease was sent. */
static void one_hoarder_stalls_no_job(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=10 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=4096 -> -",
		"[0] w2 joins A threads=2 -> -",
		"[0] w1 wants 4097 -> j1 is bootstrap, " EIGHT_LEASES,
		"[1] w1 wants 4097 -> -",
		"[20] w1 heartbeat -> -",
		"[20] w2 wants 3 -> w2 gets j1 g8 p0 boot, w2 gets j1 g9 p0 boot",
		"[20] wake -> 30",
		"[29] w2 heartbeat -> -",
		"[30] tick -> w2 gets j1 g0 p0 boot",
		"[31] w2 batch j1 g8 p0 boot -> merge, merged, w2 gets j1 g1 p0 boot",
		"[32] w2 batch j1 g9 p0 boot -> merge, merged, w2 gets j1 g2 p0 boot",
		"[33] w2 batch j1 g0 p0 boot -> merge, merged, w1 loses j1 g0 p0 boot, w2 gets j1 g3 p0 boot",
		NULL,
	});
}

static void lease_limit_grows_with_returned_results(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=30 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=64 -> -",
		"[0] w1 wants 65 -> j1 is bootstrap, " EIGHT_LEASES,
		"[5] w1 batch j1 g0 p0 boot -> merge, merged, w1 gets j1 g8 p0 boot, w1 gets j1 g9 p0 boot, w1 gets j1 g10 p0 boot, "
		"w1 gets j1 g11 p0 boot, w1 gets j1 g12 p0 boot, w1 gets j1 g13 p0 boot, w1 gets j1 g14 p0 boot, "
		"w1 gets j1 g15 p0 boot, w1 gets j1 g16 p0 boot",
		"[6] w1 leaves -> -",
		NULL,
	});
}

/* Both copies are held by such workers: the older copy is given up after two minutes instead of ten, and only for a
 * worker that has nothing to do. */
static void two_hoarders_stall_a_job_for_two_minutes(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=64 -> -",
		"[0] w2 joins A threads=64 -> -",
		"[0] w1 wants 65 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot",
		"[0] w2 wants 65 -> -",
		"[25] w1 heartbeat -> -",
		"[25] w2 heartbeat -> -",
		"[30] tick -> w2 gets j1 g0 p0 boot, w2 gets j1 g1 p0 boot",
		"[50] w1 heartbeat -> -",
		"[50] w2 heartbeat -> -",
		"[75] w1 heartbeat -> -",
		"[75] w2 heartbeat -> -",
		"[100] w1 heartbeat -> -",
		"[100] w2 heartbeat -> -",
		"[110] w3 joins A threads=1 -> -",
		"[115] w3 wants 2 -> -",
		"[119] w1 heartbeat -> -",
		"[119] w2 heartbeat -> -",
		"[125] tick -> w3 gets j1 g0 p0 boot, w3 gets j1 g1 p0 boot",
		"[130] w3 batch j1 g0 p0 boot -> merge, merged, w2 loses j1 g0 p0 boot, w1 loses j1 g0 p0 boot",
		"[131] w3 batch j1 g1 p0 boot -> merge, merged, w2 loses j1 g1 p0 boot, w1 loses j1 g1 p0 boot, j1 prepare",
		NULL,
	});
}

/* Honest workers with long leases: where no worker is idle, nothing is given up before ten minutes. */
static void long_leases_are_kept_while_no_worker_is_idle(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=2 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 -> -",
		"[0] w2 joins A threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[0] w2 wants 1 -> w2 gets j1 g1 p0 boot",
		"[25] w1 heartbeat -> -",
		"[25] w2 heartbeat -> -",
		"[50] w1 heartbeat -> -",
		"[50] w2 heartbeat -> -",
		"[75] w1 heartbeat -> -",
		"[75] w2 heartbeat -> -",
		"[100] w1 heartbeat -> -",
		"[100] w2 heartbeat -> -",
		"[125] tick -> -",
		"[129] w1 heartbeat -> -",
		"[129] w2 heartbeat -> -",
		"[150] tick -> -",
		"[151] w1 batch j1 g0 p0 boot -> merge, merged",
		NULL,
	});
}

/* A worker's limit is halved after each lease that others had to answer for it, and doubled again once it returns a
 * result. */
static void overtaken_worker_may_hold_fewer_leases(void **state)
{
	(void)state;
	transcript_check((const char *const[]){
		"[0] submit groups=8 rounds=9 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=64 -> -",
		"[0] w2 joins A threads=8 -> -",
		"[0] w1 wants 65 -> j1 is bootstrap, " EIGHT_LEASES,
		"[20] w1 heartbeat -> -",
		"[20] w2 wants 4 -> -",
		"[30] tick -> w2 gets j1 g0 p0 boot, w2 gets j1 g1 p0 boot, w2 gets j1 g2 p0 boot, w2 gets j1 g3 p0 boot",
		"[31] w2 batch j1 g0 p0 boot -> merge, merged, w1 loses j1 g0 p0 boot, w2 gets j1 g4 p0 boot",
		"[31] w2 batch j1 g1 p0 boot -> merge, merged, w1 loses j1 g1 p0 boot, w2 gets j1 g5 p0 boot",
		"[31] w2 batch j1 g2 p0 boot -> merge, merged, w1 loses j1 g2 p0 boot, w2 gets j1 g6 p0 boot",
		"[31] w2 batch j1 g3 p0 boot -> merge, merged, w1 loses j1 g3 p0 boot, w2 gets j1 g7 p0 boot",
		"[32] w2 batch j1 g4 p0 boot -> merge, merged, w1 loses j1 g4 p0 boot",
		"[32] w2 batch j1 g5 p0 boot -> merge, merged, w1 loses j1 g5 p0 boot",
		"[32] w2 batch j1 g6 p0 boot -> merge, merged, w1 loses j1 g6 p0 boot",
		"[32] w2 batch j1 g7 p0 boot -> merge, merged, w1 loses j1 g7 p0 boot, j1 prepare",
		"[33] prepared j1 -> j1 is running, w2 gets j1 g0 p0 e0, w1 gets j1 g1 p0 e0, w2 gets j1 g2 p0 e0, "
		"w2 gets j1 g3 p0 e0, w2 gets j1 g4 p0 e0",
		"[34] w1 batch j1 g1 p0 e0 -> merge, merged, w1 gets j1 g5 p0 e0, w1 gets j1 g6 p0 e0",
		NULL,
	});
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(one_hoarder_stalls_no_job),
		cmocka_unit_test(lease_limit_grows_with_returned_results),
		cmocka_unit_test(two_hoarders_stall_a_job_for_two_minutes),
		cmocka_unit_test(long_leases_are_kept_while_no_worker_is_idle),
		cmocka_unit_test(overtaken_worker_may_hold_fewer_leases),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
