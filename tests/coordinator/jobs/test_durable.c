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
#include "tests/support/temporary_folder.h"
#include "tests/support/staged_server.h"

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
static void send_extend(uint64_t job, uint64_t mutations, const char *refusal)
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
		assert_non_null(strstr(staged_server_request_refused(&m), refusal));
		return;
	}
	staged_server_request(&m);
	struct plan_request longer = scripted_peer_plan_request;
	longer.mutations += mutations;
	assert_int_equal(plan_make(&longer, &staged_server.plan, &e), 0);
}

enum { BOOTSTRAP_AND_ROUND_LEASES = 16 }; /* number of leases */

static unsigned sent_count, open_count;
static struct lease_key open_leases[8]; /* leases not answered yet */

/* Answers leases until `results` results were sent in all, and `acks` of them acknowledged. */
static void work_until(unsigned results, unsigned acks)
{
	for (;;) {
		for (; open_count && sent_count < results; sent_count++)
			assert_true(staged_server_answer_lease(&open_leases[--open_count]));
		if (sent_count == results && staged_server.acknowledged >= acks)
			return;
		struct error e;
		const Farm__Envelope *m = scripted_peer_receive(staged_server.worker);
		assert_non_null(m);
		staged_server.acknowledged += scripted_peer_is_merge_ack(m);
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_true(open_count < 8);
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &open_leases[open_count++], &e), 0);
	}
}

/* The job is cancelled while it is held because its checkpoint failed. */
static void job_is_cancelled_while_its_checkpoint_fails(void **state)
{
	(void)state;
	staged_disk->hold_checkpoint = staged_disk->fail_folder_flush = true;
	staged_server_start();
	uint64_t job = staged_server_submit();
	staged_server_work_until(&staged_disk->checkpoint_held, NULL);
	staged_server_cancel(job);
	staged_disk->release_checkpoint = true;
	staged_server_await_state(job, "cancelled");
	staged_server_end(SIGTERM, true);
}

/* The coordinator is killed while the films of a cancelled job are still being read, after its client was told that the
 * job is over. */
static void cancellation_survives_a_kill(void **state)
{
	(void)state;
	staged_disk->hold_checkpoint = true;
	staged_server_start();
	uint64_t job = staged_server_submit();
	staged_server_work_until(&staged_disk->checkpoint_held, NULL);
	staged_server_cancel(job);
	staged_server_end(SIGKILL, false);
	staged_disk->release_checkpoint = true;
	staged_server_start();
	staged_server_await_state(job, "cancelled");
	staged_server_end(SIGTERM, true);
}

/* Returns the failures in the job's record, when the coordinator had time for ticks after the failure and after the
 * checkpoint. */
static uint64_t failures_recorded_after(useconds_t ticks_us)
{
	struct lease_key failed_lease = {.job = 0};
	struct job_record r;
	struct ledger *l;
	struct error e;
	staged_disk->hold_checkpoint = true;
	staged_disk->checkpoint_held = staged_disk->release_checkpoint = false;
	staged_server_start();
	uint64_t job = staged_server_submit();
	staged_server_work_until(&staged_disk->checkpoint_held, &failed_lease);
	assert_true(failed_lease.job == job);
	staged_server_fail_lease(&failed_lease);
	usleep(ticks_us);
	staged_disk->release_checkpoint = true;
	usleep(ticks_us);
	staged_server_end(SIGKILL, false);
	staged_server_start();
	staged_server_cancel(job);
	staged_server_await_state(job, "cancelled");
	staged_server_end(SIGTERM, true);
	assert_int_equal(ledger_open(&l, staged_server.spool, &e), 0);
	assert_int_equal(ledger_read_record(l, job, &r, &e), 0);
	ledger_close(l);
	return r.counts.failures;
}

/* If the machine was so busy that no tick came, the test runs once more with more time. */
static void failure_is_counted_while_a_checkpoint_is_written(void **state)
{
	(void)state;
	uint64_t failures = 0;
	for (useconds_t us = STAGED_TWO_TICKS_US; !failures && us <= 100 * STAGED_TWO_TICKS_US; us *= 10)
		failures = failures_recorded_after(us);
	assert_int_equal(failures, 1);
}

static void *duplicate_bytes(const void *bytes, size_t size)
{
	void *copy = malloc(size);
	assert_non_null(copy);
	return memcpy(copy, bytes, size);
}

/* The job was extended after its end, without films, and is cancelled: its earlier result is there, and nothing to make
 * another one from. */
static void record_of_a_cancelled_extension_is_written_later(void **state)
{
	(void)state;
	static _Atomic bool never;
	struct ledger *l;
	struct ledger_job j;
	struct error e;
	staged_server_start();
	uint64_t job = staged_server_submit();
	staged_server_end(SIGKILL, false);
	assert_int_equal(ledger_open(&l, staged_server.spool, &e), 0);
	assert_int_equal(ledger_read_row(l, job, &j, &e), 1);
	void *submission = duplicate_bytes(j.submission, j.submission_size),
	     *frame = duplicate_bytes(j.plan, j.plan_size);
	ledger_close(l);
	staged_server_start();
	staged_server_work_until(&never, NULL);
	staged_server_await_state(job, "done");
	staged_server_end(SIGTERM, true);
	assert_int_equal(ledger_open(&l, staged_server.spool, &e), 0);
	j = (struct ledger_job){.id = job,
				.extended = 1,
				.submission = submission,
				.submission_size = j.submission_size,
				.plan = frame,
				.plan_size = j.plan_size};
	assert_int_equal(ledger_extend_job(l, &j, &e), 0);
	ledger_close(l);
	free(submission);
	free(frame);
	staged_server_start();
	staged_disk->fail_ledger_writes = true;
	staged_server_cancel_unstored(job);
	usleep(STAGED_TWO_TICKS_US);
	staged_server_await_state(job, "running");
	staged_disk->fail_ledger_writes = false;
	staged_server_await_state(job, "done"); /* as before the extension */
	staged_server_end(SIGTERM, true);
}

static int count_batch(void *user, const struct journal_item *item, struct error *e)
{
	(void)e;
	*(unsigned *)user += item->kind == JOURNAL_BATCH && !item->damaged_count;
	return 0;
}

/* Returns the number of leases of the whole job, bootstrap included. */
static unsigned count_job_leases(void)
{
	return staged_server.plan.groups * staged_server.plan.parts * (unsigned)(staged_server.plan.rounds + 1);
}

/* The job's results wait for a slow flush when it ends; then it is extended, and more results come while the flush goes
 * on. */
static void check_extension_during_flush(bool fails)
{
	unsigned first = count_job_leases(), more = first + 6, after = more + 4, stored_count = 0;
	char path[150];
	struct journal_damage found;
	struct journal *j;
	struct error e;
	staged_server.journal_bytes = staged_server.keep_bytes = 1 << 30;
	staged_disk->fail_flush = fails;
	staged_disk->hold_flush = true;
	sent_count = staged_server.acknowledged = open_count = 0;
	staged_server_start();
	uint64_t job = staged_server_submit();
	work_until(first, 0);
	staged_server_await_state(job, "done");
	assert_true(staged_disk->flush_held && staged_server.acknowledged == 0);
	send_extend(job, 6400, NULL);
	assert_true(scripted_peer_request_leases(staged_server.worker, 3));
	work_until(more, 0);
	staged_disk->release_flush = true;
	work_until(more, more);
	work_until(after, after);
	staged_server_await_state(job, "running");
	staged_server_end(SIGKILL, false);
	snprintf(path, sizeof path, "%s/jobs/j%llu", staged_server.spool, (unsigned long long)job);
	assert_int_equal(journal_open(&j, path, job, 0, count_batch, &stored_count, &found, &e), 0);
	journal_release(j);
	assert_true(stored_count >= staged_server.acknowledged);
}

static void job_is_extended_during_a_slow_flush(void **state)
{
	(void)state;
	check_extension_during_flush(false);
}

static void job_is_extended_during_a_flush_that_fails(void **state)
{
	(void)state;
	check_extension_during_flush(true);
}

/* The job is extended once its end is in the ledger, and the coordinator's next start continues it. */
static void job_is_extended_after_its_end_was_written_late(void **state)
{
	(void)state;
	staged_server.keep_bytes = 1 << 30;
	sent_count = staged_server.acknowledged = open_count = 0;
	staged_server_start();
	uint64_t job = staged_server_submit();
	work_until(count_job_leases() - 1, 0);
	staged_disk->fail_ledger_writes = true;
	staged_disk->refused_commits = 0;
	work_until(count_job_leases(), 0);
	while (!staged_disk->refused_commits)
		usleep(1000);
	staged_server_await_state(job, "running");
	staged_disk->fail_ledger_writes = false;
	staged_server_await_state(job, "done");
	send_extend(job, 6400, NULL);
	staged_server_end(SIGKILL, false);
	staged_server_start();
	staged_server_await_state(job, "running");
	staged_server_end(SIGKILL, false);
}

/* Makes a job that is done and keeps its films. */
static uint64_t make_done_job(void)
{
	staged_server.keep_bytes = 1 << 30;
	sent_count = staged_server.acknowledged = open_count = 0;
	staged_server_start();
	uint64_t job = staged_server_submit();
	work_until(count_job_leases(), 0);
	staged_server_await_state(job, "done");
	return job;
}

/* The films of the ended job include chain states; another job takes so much memory that they do not fit. */
static void extension_needs_room_in_memory(void **state)
{
	(void)state;
	staged_server.keep_bytes = 1 << 30;
	sent_count = staged_server.acknowledged = open_count = 0;
	staged_server_start();
	uint64_t job = staged_server_submit(), lease_count = count_job_leases();
	work_until((unsigned)lease_count, 0);
	staged_server_await_state(job, "done");
	uint64_t other = staged_server_submit();
	assert_true(scripted_peer_request_leases(staged_server.worker, 3));
	work_until((unsigned)lease_count + BOOTSTRAP_AND_ROUND_LEASES,
		   (unsigned)lease_count + BOOTSTRAP_AND_ROUND_LEASES);
	staged_server_end(SIGTERM, true);
	staged_server.state_bytes = chain_states_max_bytes(&staged_server.plan);
	staged_server_start();
	staged_server_await_state(other, "running");
	send_extend(job, 6400, "memory has no room for its chain states beside those of j2");
	staged_server_cancel(other);
	staged_server_await_state(other, "cancelled");
	send_extend(job, 6400, NULL);
	staged_server_end(SIGTERM, true);
}

/* The job's films stay on the disk, and once there is room the job is extended. */
static void extension_needs_room_on_the_disk(void **state)
{
	(void)state;
	uint64_t job = make_done_job();
	staged_disk->no_journal_room = true;
	send_extend(job, 6400, "it cannot continue: extend it when the disk has room: ");
	staged_disk->no_journal_room = false;
	send_extend(job, 6400, NULL);
	staged_server_end(SIGKILL, false);
}

/* Opens the server in this process, with a ledger that can be made to fail. */
static struct server *open_server(void)
{
	sqlite3_auto_extension((void (*)(void))staged_server_hook_commits);
	struct server *s = staged_server_open_in_process();
	sqlite3_reset_auto_extension();
	assert_non_null(s);
	return s;
}

/* The end of a job without a result waits in a list. */
static void end_without_a_result_is_written_later(void **state)
{
	(void)state;
	struct ledger_job j;
	struct error e;
	staged_server_start();
	uint64_t job = staged_server_submit();
	staged_server_end(SIGKILL, false);
	struct server *s = open_server();
	staged_disk->fail_ledger_writes = true;
	jobs_step(&s->jobs, &(struct event){.kind = EVENT_CANCEL, .job = job});
	assert_true(s->jobs.unrecorded_ends && !s->jobs.live_jobs);
	assert_int_equal(ledger_read_row(s->jobs.ledger, job, &j, &e), 1);
	assert_string_equal(j.state, "live");
	staged_disk->fail_ledger_writes = false;
	while (s->jobs.unrecorded_ends)
		uv_run(&s->loop, UV_RUN_ONCE);
	assert_int_equal(ledger_read_row(s->jobs.ledger, job, &j, &e), 1);
	assert_string_equal(j.state, "cancelled");
	server_close(s);
}

/* An extension was refused, and the end that then had to be written failed as well: the films stay for the next
 * extension. With `extended`, that extension came before the end could be written. */
static void check_late_end_with_films(bool extended)
{
	struct job_record r;
	struct ledger_job j;
	struct error e;
	uint64_t job = make_done_job();
	staged_server_end(SIGTERM, true);
	struct server *s = open_server();
	struct ledger *l = s->jobs.ledger;
	assert_int_equal(ledger_read_record(l, job, &r, &e), 0);
	uint64_t films, later;
	assert_int_equal(spool_film_bytes(s->jobs.spool, job, 1, &films, &e), 0);
	assert_true(films > 0);
	staged_disk->fail_ledger_writes = true;
	durable_restore_end(&s->jobs, &r);
	assert_non_null(s->jobs.unrecorded_ends);
	staged_disk->fail_ledger_writes = false;
	assert_int_equal(ledger_read_row(l, job, &j, &e), 1);
	size_t size = j.submission_size;
	assert_true(size > 0);
	if (extended) {
		void *submission = duplicate_bytes(j.submission, size), *plan = duplicate_bytes(j.plan, j.plan_size);
		struct ledger_job longer = {.id = job,
					    .extended = r.extended + 1,
					    .submission = submission,
					    .submission_size = size,
					    .plan = plan,
					    .plan_size = j.plan_size};
		assert_int_equal(ledger_extend_job(l, &longer, &e), 0);
		free(submission);
		free(plan);
	}
	while (s->jobs.unrecorded_ends)
		uv_run(&s->loop, UV_RUN_ONCE);
	assert_int_equal(spool_film_bytes(s->jobs.spool, job, 1, &later, &e), 0);
	assert_int_equal(later, films);
	assert_int_equal(ledger_read_row(l, job, &j, &e), 1);
	assert_int_equal(j.submission_size, size);
	assert_int_equal(j.end_time > 0, !extended);
	server_close(s);
}

static void end_of_a_refused_extension_is_written_later(void **state)
{
	(void)state;
	check_late_end_with_films(false);
}

static void late_end_does_not_undo_a_new_extension(void **state)
{
	(void)state;
	check_late_end_with_films(true);
}

static uint64_t no_bytes_available(const char *path)
{
	(void)path;
	return 0;
}

/* The job's journal is as long as its checkpoint, and the disk has no room for another checkpoint. If the job were
 * released, its next result would hold it again and again, with all the leases that are computed in between. */
static void job_is_held_until_a_checkpoint_fits(void **state)
{
	(void)state;
	const struct disk *before = disk_calls;
	struct disk full = *disk_calls;
	full.available = no_bytes_available;
	struct error e;
	uint64_t id = staged_server_begin_job();
	struct server *s = open_server();
	assert_int_equal(server_await_jobs(s, &e), 0);
	struct live_job *job = jobs_find_live(&s->jobs, id);
	assert_true(job && job->canvas && journal_bytes(job->journal) > JOURNAL_HEAD_SIZE);
	uint64_t original_bytes = job->checkpoint_bytes;
	job->checkpoint_bytes = 1;
	job->merged_record_bytes = 0;
	job->blocked_result_bytes = 100;
	durable_hold_job(&s->jobs, job, "its results cannot be stored", "the disk is full");
	disk_set_calls(&full);
	int rc = durable_retry_job(&s->jobs, job);
	disk_set_calls(before);
	assert_int_equal(rc, -ENOSPC);
	assert_true(job->is_held_for_storage);
	assert_int_equal(durable_retry_job(&s->jobs, job), 0);
	assert_false(job->is_held_for_storage);
	job->checkpoint_bytes = original_bytes;
	server_close(s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(job_is_cancelled_while_its_checkpoint_fails, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(cancellation_survives_a_kill, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(failure_is_counted_while_a_checkpoint_is_written, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(record_of_a_cancelled_extension_is_written_later, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(job_is_extended_during_a_slow_flush, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(job_is_extended_during_a_flush_that_fails, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(job_is_extended_after_its_end_was_written_late, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(extension_needs_room_in_memory, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(extension_needs_room_on_the_disk, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(job_is_held_until_a_checkpoint_fits, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(end_without_a_result_is_written_later, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(end_of_a_refused_extension_is_written_later, staged_server_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(late_end_does_not_undo_a_new_extension, staged_server_set_up,
						temporary_folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return staged_server_map_disk() ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
