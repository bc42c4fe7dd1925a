/* SPDX-License-Identifier: Apache-2.0 */
/* What the status says about a priority: the number of machines that the job would get. */
#include "tests/support/transcript.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static struct job_status read_job_status(const struct farm *f, uint64_t job)
{
	struct job_status s;
	assert_true(farm_job_status(f, job, 1, &s));
	return s;
}

static void expect_share(const struct farm *f, uint64_t job, double share)
{
	double is = read_job_status(f, job).share;
	if (fabs(is - share) > 1e-9 * share)
		fail_msg("j%d has %g, not %g", (int)job, is, share);
}

static void play_line(struct farm *f, const char *line)
{
	transcript_play(f, (const char *const[]){line, NULL});
}

/* Eight machines that take two leases each, and ask for work only once the jobs are there. */
static struct farm *make_eight_workers(void)
{
	struct farm *f = transcript_farm_new();
	char line[64];
	for (int i = 1; i <= 8; i++) {
		snprintf(line, sizeof line, "[0] w%d joins A threads=2 -> -", i);
		play_line(f, line);
		snprintf(line, sizeof line, "[0] w%d wants 2 -> -", i);
		play_line(f, line);
	}
	return f;
}

static void share_follows_priority_and_owner(void **state)
{
	(void)state;
	struct farm *f = make_eight_workers();
	play_line(f, "[0] hold order j1 x -> rejected: no such job");
	play_line(f, "[0] restore j1 boot 1,1,1,1,1,1,1,1,1,1,1,1,0,0,0,0 fingerprint=A groups=16 owner=ann -> "
		     "j1 is bootstrap, w1 gets j1 g12 p0 boot, "
		     "w2 gets j1 g13 p0 boot, w3 gets j1 g14 p0 boot, w4 gets j1 g15 p0 boot");
	expect_share(f, 1, 2); /* the job can use only four leases */
	assert_int_equal(read_job_status(f, 1).workers, 4);
	assert_string_equal(read_job_status(f, 1).place, "4 of 8 machines");
	play_line(
		f,
		"[0] cancel j1 -> j1 cancelled, w1 loses j1 g12 p0 boot, w2 loses j1 g13 p0 boot, w3 loses j1 g14 p0 boot, "
		"w4 loses j1 g15 p0 boot, j1 is cancelled (cancelled: cancelled)");
	assert_string_equal(read_job_status(f, 1).place, "");
	farm_free(f);

	/* no worker asks for work yet: the shares that the jobs would get are the same */
	f = transcript_farm_new();
	for (int i = 1; i <= 8; i++) {
		char line[64];
		snprintf(line, sizeof line, "[0] w%d joins A threads=1 -> -", i);
		play_line(f, line);
	}
	play_line(f, "[0] submit groups=16 owner=ann -> j1 submitted, j1 is queued");
	expect_share(f, 1, 8);
	assert_string_equal(read_job_status(f, 1).place, "0 of 8 machines");
	play_line(f, "[0] submit groups=3 priority=5 owner=ann -> j2 submitted, j2 is queued");
	expect_share(f, 1, 5);
	expect_share(f, 2, 3);
	assert_string_equal(read_job_status(f, 1).place, "0 of 8 machines; j2 comes first");
	assert_string_equal(read_job_status(f, 2).place, "0 of 8 machines");
	play_line(f, "[0] submit groups=16 owner=bob -> j3 submitted, j3 is queued");
	play_line(f, "[0] submit groups=1 owner=bob -> j4 submitted, j4 is queued");
	expect_share(f, 1, 2.5); /* half of five is ann's; bob's other job leaves the remainder to this one */
	expect_share(f, 3, 1.5);
	expect_share(f, 4, 1);
	assert_string_equal(read_job_status(f, 3).place, "0 of 8 machines; j2 comes first; by turns with j1 and j4");
	assert_string_equal(read_job_status(f, 3).owners_place,
			    "0 of 8 machines; 1 job of another owner comes first; by turns with j4 and 1 more");
	play_line(f, "[0] submit groups=16 priority=-1 owner=eve -> j5 submitted, j5 is queued");
	expect_share(f, 5, 0);
	assert_string_equal(read_job_status(f, 5).place, "0 of 8 machines; j2, j1, j3 and 1 more come first");
	assert_string_equal(read_job_status(f, 5).owners_place, "0 of 8 machines; 4 jobs of other owners come first");
	play_line(f, "[0] hold order j2 held by ann -> -");
	expect_share(f, 2, 0);
	expect_share(f, 1, 4);
	expect_share(f, 3, 3);
	play_line(f, "[0] hold order j3 held by bob -> -");
	expect_share(f, 1, 7); /* bob can use only one */
	play_line(f, "[0] priority j5 1 -> -");
	expect_share(f, 5, 8);
	expect_share(f, 1, 0);
	farm_free(f);
}

/* Machines of another fingerprint count for no job that cannot use them. */
static void share_counts_only_usable_machines(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] restore j1 boot 1,0,0,0 fingerprint=A groups=4 -> -",
				   "[0] restore j2 boot 1,0,0,0 fingerprint=B groups=4 priority=3 -> -",
				   "[0] w1 joins A threads=1 -> -",
				   "[0] w2 joins A threads=1 -> -",
				   "[0] w3 joins B threads=1 -> -",
				   NULL,
			   });
	expect_share(f, 1, 2);
	expect_share(f, 2, 1);
	assert_string_equal(read_job_status(f, 1).place, "0 of 2 machines");
	transcript_play(f, (const char *const[]){
				   "[30] tick -> -",
				   NULL,
			   }); /* all workers are silent */
	expect_share(f, 1, 0);
	assert_string_equal(read_job_status(f, 2).place, "0 of 0 machines");
	farm_free(f);
}

static void waiting_job_names_the_jobs_before_it(void **state)
{
	(void)state;
	struct farm *f = transcript_farm_new();
	transcript_play(f, (const char *const[]){
				   "[0] submit groups=4 -> j1 submitted, j1 is queued",
				   "[0] submit groups=4 priority=7 -> j2 submitted, j2 is queued",
				   "[0] w1 joins A threads=1 -> -",
				   "[0] w1 wants 2 -> j2 is bootstrap, w1 gets j2 g0 p0 boot, w1 gets j2 g1 p0 boot",
				   NULL,
			   });
	assert_string_equal(read_job_status(f, 1).waiting, "waits for j2 of higher priority (7)");
	/* j2 has the same owner. */
	assert_string_equal(read_job_status(f, 1).owners_waiting, read_job_status(f, 1).waiting);
	assert_int_equal(read_job_status(f, 2).workers, 1); /* one machine, two leases */
	assert_string_equal(read_job_status(f, 2).place, "1 of 1 machine");
	play_line(f, "[0] submit groups=4 owner=ann -> j3 submitted, j3 is queued");
	assert_string_equal(read_job_status(f, 3).waiting, "waits for j2 of higher priority (7)");
	assert_string_equal(read_job_status(f, 3).owners_waiting,
			    "waits for a job of higher priority of another owner");
	play_line(f, "[0] priority j2 0 -> -");
	assert_string_equal(read_job_status(f, 3).waiting, "workers busy with j2 (priority 0)");
	assert_string_equal(read_job_status(f, 3).owners_waiting, "workers busy with a job of another owner");
	farm_free(f);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(share_follows_priority_and_owner),
		cmocka_unit_test(share_counts_only_usable_machines),
		cmocka_unit_test(waiting_job_names_the_jobs_before_it),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
