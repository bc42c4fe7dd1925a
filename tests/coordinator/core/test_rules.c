/* SPDX-License-Identifier: Apache-2.0 */
/* What is merged, repeated, refused and handed out again, as transcripts. */
#include "tests/support/transcript.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

/* clang-format off */
#define START_TWO                                                                      \
	"[0] submit -> j1 submitted, j1 is queued",                                    \
	"[0] w1 joins A threads=1 -> -", "[0] w2 joins A threads=1 -> -",              \
	"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",                    \
	"[0] w2 wants 1 -> w2 gets j1 g1 p0 boot",                                     \
	"[1] w1 batch j1 g0 p0 boot -> merge, merged",                                 \
	"[1] w2 batch j1 g1 p0 boot -> merge, merged, j1 prepare",                     \
	"[1] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w2 gets j1 g1 p0 e0"
/* clang-format on */

static void whole_job(void **state)
{
	(void)state;
	transcript((const char *const[]){
		START_TWO,
		"[2] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		"[2] w2 batch j1 g1 p0 e0 -> merge, merged, j1 round 1, w2 gets j1 g1 p0 e1",
		"[3] w2 batch j1 g1 p0 e1 -> merge, merged",
		"[3] w1 batch j1 g0 p0 e1 -> merge, merged, j1 round 2, j1 publish 2, j1 is done (mutations)",
		"[4] w1 batch j1 g0 p0 e1 -> refused: the job is over",
		NULL,
	});
}

static void two_rounds_open(void **state)
{
	(void)state;
	transcript((const char *const[]){
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

static void repeats(void **state)
{
	(void)state;
	transcript((const char *const[]){
		START_TWO,
		"[2] w1 batch j1 g0 p0 boot -> repeat: merged already",
		"[2] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		"[2] w1 batch j1 g0 p0 e0 -> repeat: merged already",
		"[2] w2 batch j1 g0 p0 e0 -> repeat: merged already",
		/* whoever holds the lease: the first valid answer is the one */
		"[2] w2 batch j1 g0 p0 e1 -> merge, merged, w1 loses j1 g0 p0 e1",
		"[2] w1 batch j1 g0 p0 e1 -> repeat: merged already",
		NULL,
	});
}

static void refused(void **state)
{
	(void)state;
	transcript((const char *const[]){
		START_TWO,
		"[2] w9 batch j1 g0 p0 e0 -> refused: unknown worker",
		"[2] w1 batch j2 g0 p0 e0 -> refused: no such job",
		"[2] cancel j2 -> rejected: no such job",
		"[2] cancel j1 -> j1 cancelled, w1 loses j1 g0 p0 e0, w2 loses j1 g1 p0 e0, j1 is cancelled (cancelled: cancelled)",
		"[3] w1 batch j1 g0 p0 e0 -> refused: the job is over",
		"[3] cancel j1 -> rejected: the job is over",
		NULL,
	});
}

static void set_aside_after_faults(void **state)
{
	(void)state;
	struct farm *f = transcript_farm();
	transcript_play(
		f,
		(const char *const[]){
			START_TWO,
			"[2] w1 batch j1 g0 p0 e0 bad tile 3 holds a NaN -> refused: tile 3 holds a NaN, w1 gets j1 g0 p0 e0",
			"[3] w1 batch j1 g7 p0 e0 -> refused: not a lease of this job",
			"[4] w1 batch j1 g0 p0 e0 bad torn -> refused: torn, #1 quarantined",
			"[5] w1 wants 1 -> -",
			/* its last lease is somebody else's now */
			"[5] w2 batch j1 g1 p0 e0 -> merge, merged, w2 gets j1 g0 p0 e0",
			"[6] w2 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w2 gets j1 g1 p0 e1",
			/* silence and a word do not wash it clean */
			"[33] w2 heartbeat -> -",
			"[36] tick -> -",
			"[40] w1 wants 1 -> -",
			NULL,
		});
	struct peer_status p;
	assert_true(farm_peer(f, 1, &p));
	assert_int_equal(p.state, PEER_QUARANTINED);
	assert_int_equal(p.faults, 3);
	assert_string_equal(p.text, "torn");
	struct job_status j;
	assert_true(farm_job(f, 1, 40, &j));
	assert_int_equal(j.counts.faults, 3);
	farm_free(f);
}

static void worker_gone(void **state)
{
	(void)state;
	transcript((const char *const[]){
		START_TWO,
		"[2] w3 joins A threads=1 -> -",
		"[2] w3 wants 1 -> -",
		"[2.4] w1 leaves -> w3 gets j1 g0 p0 e0",
		/* silent: taken back, but what it made is still good */
		"[20] w3 heartbeat -> -",
		"[31] tick -> -",
		"[31] w3 wants 2 -> w3 gets j1 g1 p0 e0",
		"[32] w2 batch j1 g1 p0 e0 -> merge, merged, w3 loses j1 g1 p0 e0, w2 gets j1 g1 p0 e1",
		NULL,
	});
}

/* Who reads late what was said in time misses nobody for it: not for being silent, not for a lease that is overdue. */
static void read_late(void **state)
{
	(void)state;
	transcript((const char *const[]){
		START_TWO,
		"[2] w3 joins A threads=1 -> -",
		"[700] unread=690 tick -> -",
		"[700] unread=690 w2 heartbeat -> -",
		"[702] unread=692 w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		/* now all has been read: the third has said nothing, and the second's lease is overdue */
		"[703] tick -> close w3, w2 gets j1 g1 p0 e0",
		NULL,
	});
}

static void hung_up(void **state)
{
	(void)state;
	transcript((const char *const[]){
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

static void timeout(void **state)
{
	(void)state;
	transcript((const char *const[]){
		"[0] submit groups=3 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=4 -> -",
		"[0] w1 wants 3 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot",
		"[1] w1 batch j1 g0 p0 boot -> merge, merged",
		"[1] w1 batch j1 g1 p0 boot -> merge, merged",
		/* nothing was known of durations when it was sent: 600 s */
		"[599] w1 heartbeat -> -",
		"[600] tick -> w1 gets j1 g2 p0 boot",
		"[601] w1 batch j1 g2 p0 boot -> merge, merged, j1 prepare",
		"[601] prepared j1 -> j1 is running, w1 gets j1 g0 p0 e0, w1 gets j1 g1 p0 e0, w1 gets j1 g2 p0 e0",
		"[602] w1 batch j1 g0 p0 e0 -> merge, merged, w1 gets j1 g0 p0 e1",
		"[602] w1 batch j1 g0 p0 e1 -> merge, merged",
		NULL,
	});
}

static void timeout_after_median(void **state)
{
	(void)state;
	transcript((const char *const[]){
		"[0] submit groups=3 rounds=9 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1 -> j1 is bootstrap, w1 gets j1 g0 p0 boot",
		"[1] w1 batch j1 g0 p0 boot -> merge, merged, w1 gets j1 g1 p0 boot",
		"[2] w1 batch j1 g1 p0 boot -> merge, merged, w1 gets j1 g2 p0 boot",
		"[30] w1 heartbeat -> -",
		"[59] w1 heartbeat -> -",
		/* ten medians are 10 s, so the least of 60 s; the second time 120 s */
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

static void straggler(void **state)
{
	(void)state;
	struct farm *f = transcript_farm();
	transcript_play(
		f,
		(const char *const[]){
			START_TWO,
			"[1] w3 joins A threads=1 -> -",
			"[1] w3 wants 1 -> -",
			"[3] w2 batch j1 g1 p0 e0 -> merge, merged, w3 gets j1 g1 p0 e1",
			"[3] w3 batch j1 g1 p0 e1 -> merge, merged",
			/* the median is 2 s: after 3 s a second worker, never a third */
			"[3.9] tick -> -",
			"[3.9] wake -> 4",
			"[4] tick -> w2 gets j1 g0 p0 e0",
			"[9] w3 heartbeat -> -",
			"[9] w2 batch j1 g0 p0 e0 -> merge, merged, w1 loses j1 g0 p0 e0, j1 round 1, w3 gets j1 g0 p0 e1",
			"[9] w1 batch j1 g0 p0 e0 -> repeat: merged already",
			NULL,
		});
	struct job_status j;
	assert_true(farm_job(f, 1, 9, &j));
	assert_int_equal(j.counts.duplicates, 1);
	assert_int_equal(j.counts.repeats, 1);
	farm_free(f);
}

/* Who was overtaken by a copy may hold half as many leases, not who had the copy. */
static void overtaken(void **state)
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
	struct farm *f = transcript_farm();
	transcript_play(f, before);
	/* with seven leases it has more than half of eight */
	transcript_play(f, (const char *const[]){
				   "[31] w2 batch j1 g0 p0 e0 -> merge, merged, w1 loses j1 g0 p0 e0",
				   NULL,
			   });
	farm_free(f);
	f = transcript_farm();
	transcript_play(f, before);
	/* the first comes first all the same: nobody was late */
	transcript_play(f,
			(const char *const[]){
				"[31] w1 batch j1 g0 p0 e0 -> merge, merged, w2 loses j1 g0 p0 e0, w1 gets j1 g0 p0 e1",
				NULL,
			});
	farm_free(f);
}

static void failed_lease(void **state)
{
	(void)state;
	transcript((const char *const[]){
		START_TWO,
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

static void never_a_success(void **state)
{
	(void)state;
	transcript((const char *const[]){
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

/* One worker that is out of order, however many leases it has, fails no job that others could make. */
static void out_of_order(void **state)
{
	(void)state;
	transcript((const char *const[]){
		"[0] submit groups=5 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=3 -> -",
		"[0] w2 joins A threads=1 -> -",
		"[0] w1 wants 4 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g1 p0 boot, w1 gets j1 g2 p0 boot, w1 gets j1 g3 p0 boot",
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

/* On all that there are, and three times; on three at once. */
static void out_of_order_all(void **state)
{
	(void)state;
	transcript((const char *const[]){
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

/* What is made is not lost to one worker, however often it fails and calls again: the job waits, and says for what. */
static void one_bad_worker(void **state)
{
	(void)state;
	struct farm *f = transcript_farm();
	transcript_play(f, (const char *const[]){
				   START_TWO,
				   "[2] w2 batch j1 g1 p0 e0 -> merge, merged, w2 gets j1 g1 p0 e1",
				   "[2] w2 leaves -> -",
				   "[2] w1 fails j1 g0 p0 e0 sorry -> -",
				   "[3] w1 wants 1 -> -",
				   "[3] w1 leaves -> -",
				   /* its pause is its own, not its connection's */
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
	assert_true(farm_job(f, 1, 160, &s));
	assert_int_equal(s.state, JOB_RUNNING);
	assert_string_equal(s.waiting, "no worker can compute it: b: sorry");
	transcript_play(f, (const char *const[]){
				   "[160] w5 joins A threads=1 name=c -> -",
				   "[160] w5 wants 1 -> w5 gets j1 g0 p0 e0",
				   "[161] w5 batch j1 g0 p0 e0 -> merge, merged, j1 round 1, w5 gets j1 g1 p0 e1",
				   NULL,
			   });
	farm_free(f);
}

/* Three machines with full disks end no job that a fourth can compute, whatever comes first. */
static void three_full_disks(void **state)
{
	(void)state;
	struct farm *f = transcript_farm();
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
				   /* they pause as others that failed, and it goes on like that for as long as nobody
				      else comes */
				   "[1] wake -> 11",
				   "[11] tick -> w1 gets j1 g3 p0 boot, w2 gets j1 g4 p0 boot, w3 gets j1 g0 p0 boot",
				   "[12] w1 lacks j1 g3 p0 boot disk full -> -",
				   "[12] w2 lacks j1 g4 p0 boot disk full -> -",
				   "[12] w3 lacks j1 g0 p0 boot disk full -> -",
				   NULL,
			   });
	struct job_status s;
	assert_true(farm_job(f, 1, 12, &s));
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
	assert_true(farm_job(f, 1, 14, &s));
	assert_string_equal(s.waiting, "");
	farm_free(f);
}

/* It takes nothing away from what others say of the job: for its end who lacks something is not here. */
static void full_disks_and_a_bad_scene(void **state)
{
	(void)state;
	transcript((const char *const[]){
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
		"[13] submit groups=5 -> j2 submitted, j2 is queued, j2 is bootstrap, w1 gets j2 g0 p0 boot, w2 gets j2 g1 p0 boot, w1 gets j2 g2 p0 boot",
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

/* Names cost nothing, certificates do: where the farm knows three, three names of one are not three workers. */
static void made_up_names(void **state)
{
	(void)state;
	transcript((const char *const[]){
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

static void returned_lease(void **state)
{
	(void)state;
	transcript((const char *const[]){
		START_TWO,
		"[2] w1 wants 0 -> -",
		"[2] w2 wants 2 -> -",
		"[2] w1 returns j1 g0 p0 e0 -> w2 gets j1 g0 p0 e0",
		NULL,
	});
}

static void bounded_wish(void **state)
{
	(void)state;
	/* leases are bounded by what the worker wants, and by its threads */
	transcript((const char *const[]){
		"[0] submit groups=8 parts=4 -> j1 submitted, j1 is queued",
		"[0] w1 joins A threads=1 -> -",
		"[0] w1 wants 1000 -> j1 is bootstrap, w1 gets j1 g0 p0 boot, w1 gets j1 g0 p1 boot, w1 gets j1 g0 p2 boot, w1 gets j1 g0 p3 boot",
		"[0] w1 wants 1 -> -",
		"[1] w1 batch j1 g0 p0 boot -> merge, merged",
		NULL,
	});
}

static bool joins(struct farm *f, uint64_t id, const char *name)
{
	struct event ev = {.kind = EVENT_JOINED, .join = {.peer = id, .name = name, .fingerprint = "A", .threads = 1}};
	struct update u;
	farm_step(f, &ev, &u);
	return u.count == 0;
}

/* A name is kept as it is, whatever letters end where; who has none or a longer one than hello allows is no worker. */
static void long_names(void **state)
{
	(void)state;
	struct farm *f = transcript_farm();
	struct peer_status p, q;
	char name[JOIN_NAME + 1];
	for (size_t i = 0; i + 1 < sizeof name; i += 2)
		memcpy(name + i, "\xc3\xa4", 3);
	assert_false(joins(f, 1, name));
	assert_false(joins(f, 1, ""));
	name[JOIN_NAME - 2] = 0;
	assert_true(joins(f, 1, name));
	name[JOIN_NAME - 4] = 0;
	assert_true(joins(f, 2, name));
	assert_true(farm_peer(f, 2, &p) && farm_peer(f, 1, &q));
	assert_string_equal(p.name, name);
	assert_true(p.who != q.who);
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(whole_job),
		cmocka_unit_test(two_rounds_open),
		cmocka_unit_test(repeats),
		cmocka_unit_test(refused),
		cmocka_unit_test(set_aside_after_faults),
		cmocka_unit_test(worker_gone),
		cmocka_unit_test(read_late),
		cmocka_unit_test(hung_up),
		cmocka_unit_test(timeout),
		cmocka_unit_test(timeout_after_median),
		cmocka_unit_test(straggler),
		cmocka_unit_test(overtaken),
		cmocka_unit_test(failed_lease),
		cmocka_unit_test(three_full_disks),
		cmocka_unit_test(full_disks_and_a_bad_scene),
		cmocka_unit_test(never_a_success),
		cmocka_unit_test(out_of_order),
		cmocka_unit_test(out_of_order_all),
		cmocka_unit_test(one_bad_worker),
		cmocka_unit_test(made_up_names),
		cmocka_unit_test(returned_lease),
		cmocka_unit_test(bounded_wish),
		cmocka_unit_test(long_names),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
