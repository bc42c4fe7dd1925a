/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the coordinator does while the disk is slow or fails. A checkpoint is delayed before its last step while its job
 * is cancelled, or while a lease fails. A job's end that cannot be written is written later. A job ends and is extended
 * while its journal is being flushed.
 */
#include "coordinator/jobs/durable.h"

#include "common/base/disk.h"
#include "coordinator/jobs/step.h"
#include "coordinator/server/server.h"
#include "coordinator/store/journal_file.h"
#include "tests/support/folder.h"
#include "tests/support/staged.h"

#include <setjmp.h>
#include <signal.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* refusal: words that the answer contains; NULL: the extension is accepted. */
static void extend(uint64_t job, uint64_t mutations, const char *refusal)
{
	Farm__Control c;
	Farm__Envelope m;
	struct error e;
	farm__control__init(&c);
	farm__envelope__init(&m);
	c.job = job;
	c.verb = FARM__VERB__VERB_EXTEND;
	c.more_mutations = mutations;
	m.body_case = FARM__ENVELOPE__BODY_CONTROL;
	m.control = &c;
	if (refusal) {
		assert_non_null(strstr(staged_refusal(&m), refusal));
		return;
	}
	staged_order(&m);
	struct plan_request longer = scripted_request;
	longer.mutations += mutations;
	assert_int_equal(plan_make(&longer, &staged.plan, &e), 0);
}

enum { BOOTSTRAP_AND_ROUND = 16 }; /* number of leases */

static unsigned sent, open_count;
static struct lease_key open_leases[8]; /* leases not answered yet */

/* Answers leases until `results` results were sent in all, and `acks` of them acknowledged. */
static void work_until(unsigned results, unsigned acks)
{
	for (;;) {
		for (; open_count && sent < results; sent++)
			assert_true(staged_answer(&open_leases[--open_count]));
		if (sent == results && staged.acknowledged >= acks)
			return;
		struct error e;
		const Farm__Envelope *m = scripted_hear(staged.worker);
		assert_non_null(m);
		staged.acknowledged += scripted_is_merged(m);
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_true(open_count < 8);
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &open_leases[open_count++], &e), 0);
	}
}

/* The job is cancelled while it is held because its checkpoint failed. */
static void cancelled_while_its_checkpoint_fails(void **state)
{
	(void)state;
	staged_disk->hold_up = staged_disk->fail_folder = true;
	staged_start();
	uint64_t job = staged_submit();
	staged_work(&staged_disk->held_up, NULL);
	staged_cancel(job);
	staged_disk->go_on = true;
	staged_await_state(job, "cancelled");
	staged_end(SIGTERM, true);
}

/* The coordinator is killed while the films of a cancelled job are still being read, after its client was told that the
 * job is over. */
static void cancelled_and_killed(void **state)
{
	(void)state;
	staged_disk->hold_up = true;
	staged_start();
	uint64_t job = staged_submit();
	staged_work(&staged_disk->held_up, NULL);
	staged_cancel(job);
	staged_end(SIGKILL, false);
	staged_disk->go_on = true;
	staged_start();
	staged_await_state(job, "cancelled");
	staged_end(SIGTERM, true);
}

/* Returns the failures in the job's record, when the coordinator had time for ticks after the failure and after the
 * checkpoint. */
static uint64_t failures_after(useconds_t ticks_us)
{
	struct lease_key kept = {.job = 0};
	struct job_record r;
	struct ledger *l;
	struct error e;
	staged_disk->hold_up = true;
	staged_disk->held_up = staged_disk->go_on = false;
	staged_start();
	uint64_t job = staged_submit();
	staged_work(&staged_disk->held_up, &kept);
	assert_true(kept.job == job);
	staged_fail(&kept);
	usleep(ticks_us);
	staged_disk->go_on = true;
	usleep(ticks_us);
	staged_end(SIGKILL, false);
	staged_start();
	staged_cancel(job);
	staged_await_state(job, "cancelled");
	staged_end(SIGTERM, true);
	assert_int_equal(ledger_open(&l, staged.spool, &e), 0);
	assert_int_equal(ledger_read_record(l, job, &r, &e), 0);
	ledger_close(l);
	return r.counts.failures;
}

/* If the machine was so busy that no tick came, the test runs once more with more time. */
static void counted_while_a_checkpoint_is_written(void **state)
{
	(void)state;
	uint64_t failures = 0;
	for (useconds_t us = STAGED_TICKS_US; !failures && us <= 100 * STAGED_TICKS_US; us *= 10)
		failures = failures_after(us);
	assert_int_equal(failures, 1);
}

static void *copy_of(const void *bytes, size_t size)
{
	void *copy = malloc(size);
	assert_non_null(copy);
	return memcpy(copy, bytes, size);
}

/* The job was extended after its end, without films, and is cancelled: its earlier result is there, and nothing to make
 * another one from. */
static void a_record_is_written_later(void **state)
{
	(void)state;
	static _Atomic bool never;
	struct ledger *l;
	struct ledger_job j;
	struct error e;
	staged_start();
	uint64_t job = staged_submit();
	staged_end(SIGKILL, false);
	assert_int_equal(ledger_open(&l, staged.spool, &e), 0);
	assert_int_equal(ledger_get(l, job, &j, &e), 1);
	void *submission = copy_of(j.submission, j.submission_size), *frame = copy_of(j.plan, j.plan_size);
	ledger_close(l);
	staged_start();
	staged_work(&never, NULL);
	staged_await_state(job, "done");
	staged_end(SIGTERM, true);
	assert_int_equal(ledger_open(&l, staged.spool, &e), 0);
	j = (struct ledger_job){.id = job,
				.extended = 1,
				.submission = submission,
				.submission_size = j.submission_size,
				.plan = frame,
				.plan_size = j.plan_size};
	assert_int_equal(ledger_extend(l, &j, &e), 0);
	ledger_close(l);
	free(submission);
	free(frame);
	staged_start();
	staged_disk->fail_ledger = true;
	staged_cancel_unstored(job);
	usleep(STAGED_TICKS_US);
	staged_await_state(job, "running");
	staged_disk->fail_ledger = false;
	staged_await_state(job, "done"); /* as before the extension */
	staged_end(SIGTERM, true);
}

static int count_batch(void *user, const struct journal_item *item, struct error *e)
{
	(void)e;
	*(unsigned *)user += item->kind == JOURNAL_BATCH && !item->missing;
	return 0;
}

/* Returns the number of leases of the whole job, bootstrap included. */
static unsigned leases_of_the_job(void)
{
	return staged.plan.groups * staged.plan.parts * (unsigned)(staged.plan.rounds + 1);
}

/* The job's results wait for a slow flush when it ends; then it is extended, and more results come while the flush goes
 * on. */
static void extended_during_a_flush(bool fails)
{
	unsigned first = leases_of_the_job(), more = first + 6, after = more + 4, there = 0;
	char path[150];
	struct journal_found found;
	struct journal *j;
	struct error e;
	staged.journal_bytes = staged.keep_bytes = 1 << 30;
	staged_disk->fail_flush = fails;
	staged_disk->hold_flush = true;
	sent = staged.acknowledged = open_count = 0;
	staged_start();
	uint64_t job = staged_submit();
	work_until(first, 0);
	staged_await_state(job, "done");
	assert_true(staged_disk->held_flush && staged.acknowledged == 0);
	extend(job, 6400, NULL);
	assert_true(scripted_want(staged.worker, 3));
	work_until(more, 0);
	staged_disk->end_flush = true;
	work_until(more, more);
	work_until(after, after);
	staged_await_state(job, "running");
	staged_end(SIGKILL, false);
	snprintf(path, sizeof path, "%s/jobs/j%llu", staged.spool, (unsigned long long)job);
	assert_int_equal(journal_open(&j, path, job, 0, count_batch, &there, &found, &e), 0);
	journal_release(j);
	assert_true(there >= staged.acknowledged);
}

static void extended_during_a_slow_flush(void **state)
{
	(void)state;
	extended_during_a_flush(false);
}

static void extended_during_a_flush_that_fails(void **state)
{
	(void)state;
	extended_during_a_flush(true);
}

/* The job is extended once its end is in the ledger, and the coordinator's next start continues it. */
static void extended_after_its_end_was_written_late(void **state)
{
	(void)state;
	staged.keep_bytes = 1 << 30;
	sent = staged.acknowledged = open_count = 0;
	staged_start();
	uint64_t job = staged_submit();
	work_until(leases_of_the_job() - 1, 0);
	staged_disk->fail_ledger = true;
	staged_disk->refused = 0;
	work_until(leases_of_the_job(), 0);
	while (!staged_disk->refused)
		usleep(1000);
	staged_await_state(job, "running");
	staged_disk->fail_ledger = false;
	staged_await_state(job, "done");
	extend(job, 6400, NULL);
	staged_end(SIGKILL, false);
	staged_start();
	staged_await_state(job, "running");
	staged_end(SIGKILL, false);
}

/* Makes a job that is done and keeps its films. */
static uint64_t done_and_kept(void)
{
	staged.keep_bytes = 1 << 30;
	sent = staged.acknowledged = open_count = 0;
	staged_start();
	uint64_t job = staged_submit();
	work_until(leases_of_the_job(), 0);
	staged_await_state(job, "done");
	return job;
}

/* The films of the ended job include chain states; another job takes so much memory that they do not fit. */
static void extended_when_memory_has_room(void **state)
{
	(void)state;
	staged.keep_bytes = 1 << 30;
	sent = staged.acknowledged = open_count = 0;
	staged_start();
	uint64_t job = staged_submit(), all = leases_of_the_job();
	work_until((unsigned)all, 0);
	staged_await_state(job, "done");
	uint64_t other = staged_submit();
	assert_true(scripted_want(staged.worker, 3));
	work_until((unsigned)all + BOOTSTRAP_AND_ROUND, (unsigned)all + BOOTSTRAP_AND_ROUND);
	staged_end(SIGTERM, true);
	staged.state_bytes = chain_states_max(&staged.plan);
	staged_start();
	staged_await_state(other, "running");
	extend(job, 6400, "memory has no room for its chain states beside those of j2");
	staged_cancel(other);
	staged_await_state(other, "cancelled");
	extend(job, 6400, NULL);
	staged_end(SIGTERM, true);
}

/* The job's films stay on the disk, and once there is room the job is extended. */
static void extended_when_the_disk_has_room(void **state)
{
	(void)state;
	uint64_t job = done_and_kept();
	staged_disk->no_room = true;
	extend(job, 6400, "it cannot continue: extend it when the disk has room: ");
	staged_disk->no_room = false;
	extend(job, 6400, NULL);
	staged_end(SIGKILL, false);
}

/* Opens the server in this process, with a ledger that can be made to fail. */
static struct server *open_here(void)
{
	sqlite3_auto_extension((void (*)(void))staged_hook_commits);
	struct server *s = staged_open_here();
	sqlite3_reset_auto_extension();
	assert_non_null(s);
	return s;
}

/* The end of a job without a result waits in a list. */
static void a_row_ends_later(void **state)
{
	(void)state;
	struct ledger_job j;
	struct error e;
	staged_start();
	uint64_t job = staged_submit();
	staged_end(SIGKILL, false);
	struct server *s = open_here();
	staged_disk->fail_ledger = true;
	jobs_step(&s->jobs, &(struct event){.kind = EVENT_CANCEL, .job = job});
	assert_true(s->jobs.endings && !s->jobs.live);
	assert_int_equal(ledger_get(s->jobs.ledger, job, &j, &e), 1);
	assert_string_equal(j.state, "live");
	staged_disk->fail_ledger = false;
	while (s->jobs.endings)
		uv_run(&s->loop, UV_RUN_ONCE);
	assert_int_equal(ledger_get(s->jobs.ledger, job, &j, &e), 1);
	assert_string_equal(j.state, "cancelled");
	server_close(s);
}

/* An extension was refused, and the end that then had to be written failed as well: the films stay for the next
 * extension. With `extended`, that extension came before the end could be written. */
static void an_end_with_films_comes_later(bool extended)
{
	struct job_record r;
	struct ledger_job j;
	struct error e;
	uint64_t job = done_and_kept();
	staged_end(SIGTERM, true);
	struct server *s = open_here();
	struct ledger *l = s->jobs.ledger;
	assert_int_equal(ledger_read_record(l, job, &r, &e), 0);
	uint64_t films, later;
	assert_int_equal(spool_film_bytes(s->jobs.spool, job, 1, &films, &e), 0);
	assert_true(films > 0);
	staged_disk->fail_ledger = true;
	durable_end_again(&s->jobs, &r);
	assert_non_null(s->jobs.endings);
	staged_disk->fail_ledger = false;
	assert_int_equal(ledger_get(l, job, &j, &e), 1);
	size_t size = j.submission_size;
	assert_true(size > 0);
	if (extended) {
		void *submission = copy_of(j.submission, size), *plan = copy_of(j.plan, j.plan_size);
		struct ledger_job longer = {.id = job,
					    .extended = r.extended + 1,
					    .submission = submission,
					    .submission_size = size,
					    .plan = plan,
					    .plan_size = j.plan_size};
		assert_int_equal(ledger_extend(l, &longer, &e), 0);
		free(submission);
		free(plan);
	}
	while (s->jobs.endings)
		uv_run(&s->loop, UV_RUN_ONCE);
	assert_int_equal(spool_film_bytes(s->jobs.spool, job, 1, &later, &e), 0);
	assert_int_equal(later, films);
	assert_int_equal(ledger_get(l, job, &j, &e), 1);
	assert_int_equal(j.submission_size, size);
	assert_int_equal(j.ended > 0, !extended);
	server_close(s);
}

static void a_refused_extension_ends_later(void **state)
{
	(void)state;
	an_end_with_films_comes_later(false);
}

static void extended_again_before_that(void **state)
{
	(void)state;
	an_end_with_films_comes_later(true);
}

static uint64_t none_left(const char *path)
{
	(void)path;
	return 0;
}

/* The job's journal is as long as its checkpoint, and the disk has no room for another checkpoint. If the job were
 * released, its next result would hold it again and again, with all the leases that are computed in between. */
static void held_until_a_checkpoint_fits(void **state)
{
	(void)state;
	const struct disk *before = disk_calls;
	struct disk full = *disk_calls;
	full.available = none_left;
	struct error e;
	uint64_t id = staged_begin_a_job();
	struct server *s = open_here();
	assert_int_equal(server_await_jobs(s, &e), 0);
	struct live_job *job = jobs_find(&s->jobs, id);
	assert_true(job && job->canvas && journal_bytes(job->journal) > JOURNAL_HEAD);
	uint64_t kept = job->checkpoint_bytes;
	job->checkpoint_bytes = 1;
	job->kept_bytes = 0;
	job->held_bytes = 100;
	durable_hold(&s->jobs, job, "its results cannot be stored", "the disk is full");
	disk_use(&full);
	int rc = durable_mend(&s->jobs, job);
	disk_use(before);
	assert_int_equal(rc, -ENOSPC);
	assert_true(job->held);
	assert_int_equal(durable_mend(&s->jobs, job), 0);
	assert_false(job->held);
	job->checkpoint_bytes = kept;
	server_close(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(cancelled_while_its_checkpoint_fails, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(cancelled_and_killed, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(counted_while_a_checkpoint_is_written, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_record_is_written_later, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_during_a_slow_flush, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_during_a_flush_that_fails, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_after_its_end_was_written_late, staged_set_up,
						folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_when_memory_has_room, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_when_the_disk_has_room, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(held_until_a_checkpoint_fits, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_row_ends_later, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_refused_extension_ends_later, staged_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_again_before_that, staged_set_up, folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return staged_open() ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
