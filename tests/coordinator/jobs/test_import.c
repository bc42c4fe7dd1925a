/* SPDX-License-Identifier: Apache-2.0 */
/* Whatever is left of the files that earlier coordinators kept in the spool is in the ledger after the next start. */
#include "coordinator/jobs/import.h"

#include "common/base/checked_file.h"
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/jobs/reconcile.h"
#include "coordinator/store/journal.h"
#include "proto/stored.pb-c.h"
#include "tests/support/temporary_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { JOB = 3 };
static struct jobs jobs;
static struct error e;

static int set_up(void **state)
{
	static char spool[128];
	if (temporary_folder_set_up(state))
		return -1;
	memset(&jobs, 0, sizeof jobs);
	snprintf(spool, sizeof spool, "%s/spool", temporary_folder);
	jobs.config.spool_folder = spool;
	return spool_open(&jobs.spool, spool, &e) || spool_create_job_folder(jobs.spool, JOB, &e);
}

static int tear_down(void **state)
{
	ledger_close(jobs.ledger);
	spool_close(jobs.spool);
	return temporary_folder_tear_down(state);
}

static bool job_file_exists(const char *file)
{
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, JOB, file, path);
	return access(path, F_OK) == 0;
}

/* ---- as an earlier coordinator wrote them */

/* ended: whether the row says that the job has ended. */
static void write_old_row(uint64_t revision, bool ended)
{
	struct ledger *l;
	struct ledger_job j = {.id = JOB,
			       .owner = "ann",
			       .name = "box",
			       .version = "0.1",
			       .holder = "",
			       .record = "",
			       .priority = 5,
			       .submitted = 2,
			       .revision = revision,
			       .state = ended ? "done" : "live",
			       .end_time = ended ? 9 : 0};
	if (!ended) {
		j.submission = (const unsigned char *)"row";
		j.submission_size = 3;
		j.plan = (const unsigned char *)"plan";
		j.plan_size = 4;
	}
	assert_int_equal(ledger_open(&l, jobs.config.spool_folder, &e), 0);
	assert_int_equal(ledger_write_row(l, &j, &e), 0);
	ledger_close(l);
}

static void write_old_copy(uint64_t revision, uint64_t extended)
{
	char path[SPOOL_PATH_MAX], text[5][8] = {"ann", "box", "0.1", "copy", "plan"};
	unsigned char bytes[200];
	struct checked_file out;
	Stored__Row m;
	stored__row__init(&m);
	m.id = JOB;
	m.revision = revision;
	m.extended = extended;
	m.priority = 7;
	m.owner = text[0];
	m.name = text[1];
	m.version = text[2];
	m.submission = (ProtobufCBinaryData){4, (uint8_t *)text[3]};
	m.plan = (ProtobufCBinaryData){4, (uint8_t *)text[4]};
	spool_job_path(jobs.spool, JOB, "order", path);
	memcpy(bytes, "hsltO003", 8);
	assert_int_equal(checked_file_create(&out, path, &e), 0);
	assert_int_equal(checked_file_write(&out, bytes, 8 + stored__row__pack(&m, bytes + 8), &e), 0);
	assert_int_equal(checked_file_finish(&out, &e), 0);
	checked_file_close(&out);
}

static void write_old_record(const char *state)
{
	struct job_record r;
	char *text;
	record_init(&r, JOB, "box", "ann");
	text_copy(r.state, sizeof r.state, state);
	r.mutations = 77;
	r.ended = 11;
	assert_int_equal(record_to_json(&r, &text, &e), 0);
	assert_int_equal(spool_write_job_file(jobs.spool, JOB, "job.json", text, strlen(text), &e), 0);
	mem_free(text);
}

static void write_old_file(const char *name, const char *text)
{
	char path[SPOOL_PATH_MAX];
	spool_path(jobs.spool, name, path);
	FILE *f = fopen(path, "w");
	assert_true(f && fputs(text, f) >= 0 && fclose(f) == 0);
}

/* ---- as it is now */

/* Imports twice, as two starts would. */
static void import_twice(struct ledger_job *j)
{
	for (int i = 0; i < 2; i++) {
		assert_int_equal(ledger_open(&jobs.ledger, jobs.config.spool_folder, &e), 0);
		assert_int_equal(import_files(&jobs, &e), 0);
		if (i == 0) {
			ledger_close(jobs.ledger);
			jobs.ledger = NULL;
		}
	}
	assert_int_equal(ledger_read_row(jobs.ledger, JOB, j, &e), 1);
	assert_false(j->is_damaged);
	assert_string_equal(j->owner, "ann");
	assert_string_equal(j->name, "box");
	assert_false(job_file_exists("job.json") || job_file_exists("order"));
}

static void assert_submission(const struct ledger_job *j, const char *text)
{
	assert_int_equal(j->submission_size, strlen(text));
	if (*text)
		assert_memory_equal(j->submission, text, strlen(text));
}

static void assert_ended(const char *submission)
{
	struct ledger_job j;
	struct job_record r;
	import_twice(&j);
	assert_string_equal(j.state, "done");
	assert_true(j.end_time == 11);
	assert_submission(&j, submission);
	assert_int_equal(ledger_read_record(jobs.ledger, JOB, &r, &e), 0);
	assert_int_equal(r.mutations, 77);
}

static void live_job_is_imported(void **state)
{
	(void)state;
	struct ledger_job j;
	write_old_row(2, false);
	write_old_copy(2, 0);
	write_old_record("queued");
	import_twice(&j);
	assert_submission(&j, "row");
	assert_true(j.priority == 5 && j.end_time == 0 && j.revision == 3);
}

static void copy_newer_than_the_row_is_imported(void **state)
{
	(void)state;
	struct ledger_job j;
	write_old_row(2, false);
	write_old_copy(3, 0);
	write_old_record("queued");
	import_twice(&j);
	assert_submission(&j, "copy");
	assert_true(j.priority == 7 && j.end_time == 0 && j.revision == 4);
}

static void lost_row_is_restored_from_the_copy(void **state)
{
	(void)state;
	struct ledger_job j;
	write_old_copy(3, 0);
	import_twice(&j);
	assert_submission(&j, "copy");
	assert_string_equal(j.state, "live");
}

static void ended_job_is_imported(void **state)
{
	(void)state;
	write_old_row(2, true);
	write_old_record("done");
	assert_ended("");
}

static void ended_job_with_films_keeps_its_submission(void **state)
{
	(void)state;
	write_old_row(2, true);
	write_old_copy(1, 0);
	write_old_record("done");
	assert_ended("copy");
}

/* The coordinator was stopped between the two writes. */
static void job_ended_only_in_its_record_is_imported_as_ended(void **state)
{
	(void)state;
	write_old_row(2, false);
	write_old_copy(2, 0);
	write_old_record("done");
	assert_ended("copy");
}

static void lone_record_of_an_ended_job_is_imported(void **state)
{
	(void)state;
	write_old_record("done");
	assert_ended("");
}

/* The job runs again: its record describes its first end. */
static void extended_job_is_imported_as_live(void **state)
{
	(void)state;
	struct ledger_job j;
	struct job_record r;
	write_old_copy(3, 1);
	write_old_record("done");
	import_twice(&j);
	assert_true(j.end_time == 0 && j.extended == 1);
	assert_string_equal(j.state, "live");
	assert_int_equal(ledger_read_record(jobs.ledger, JOB, &r, &e), 0);
	assert_int_equal(r.mutations, 77);
}

static void damaged_record_is_set_aside(void **state)
{
	(void)state;
	struct ledger_job j;
	struct job_record r;
	write_old_row(2, true);
	assert_int_equal(spool_write_job_file(jobs.spool, JOB, "job.json", "{\"schema\":", 10, &e), 0);
	assert_int_equal(spool_write_job_file(jobs.spool, JOB, "result.exr", "image", 5, &e), 0);
	import_twice(&j);
	assert_true(j.end_time == 9);
	assert_int_equal(ledger_read_record(jobs.ledger, JOB, &r, &e), 0);
	assert_true(r.has_result && r.priority == 5 && r.ended == 9);
	assert_string_equal(r.state, "done");
	assert_non_null(strstr(r.note, "was damaged"));
	assert_true(job_file_exists("job.json.damaged"));
}

static void unknown_job_with_films_stops_the_start(void **state)
{
	(void)state;
	struct ledger_job j;
	write_old_record("running");
	assert_int_equal(spool_write_job_file(jobs.spool, JOB, "checkpoint", "films", 5, &e), 0);
	assert_int_equal(reconcile_spool(&jobs, &e), -EBADMSG);
	assert_non_null(strstr(e.text, "has lost 1 job: j3 (jobs.db and jobs-copy.db have no row for it"));
	assert_int_equal(ledger_read_row(jobs.ledger, JOB, &j, &e), 0);
	assert_true(job_file_exists("job.json") && job_file_exists("checkpoint"));
}

/* Both files of the ledger are gone, and all that is left of a waiting job is an empty journal. */
static void waiting_job_without_a_ledger_is_kept(void **state)
{
	(void)state;
	struct journal *j;
	char path[SPOOL_PATH_MAX];
	spool_job_path(jobs.spool, JOB, NULL, path);
	assert_int_equal(journal_create(&j, path, JOB, 0, &e), 0);
	journal_release(j);
	assert_int_equal(reconcile_spool(&jobs, &e), -EBADMSG);
	assert_non_null(strstr(e.text, "has lost 1 job: j3"));
	assert_true(job_file_exists("journal.0"));
	ledger_close(jobs.ledger);
	jobs.config.accept_loss = true;
	assert_int_equal(reconcile_spool(&jobs, &e), 0);
	assert_false(job_file_exists(NULL));
	assert_int_equal(ledger_next_id(jobs.ledger), JOB + 1);
}

/* The coordinator was stopped before the job got its row; the ledger has rows of other jobs. */
static void journal_without_a_row_is_deleted(void **state)
{
	(void)state;
	struct journal *j;
	struct ledger *l;
	char path[SPOOL_PATH_MAX];
	assert_int_equal(ledger_open(&l, jobs.config.spool_folder, &e), 0);
	assert_int_equal(ledger_skip_ids(l, JOB - 1, &e), 0);
	ledger_close(l);
	spool_job_path(jobs.spool, JOB, NULL, path);
	assert_int_equal(journal_create(&j, path, JOB, 0, &e), 0);
	journal_release(j);
	assert_int_equal(reconcile_spool(&jobs, &e), 0);
	assert_false(job_file_exists(NULL));
}

static void job_that_was_never_accepted_is_deleted(void **state)
{
	(void)state;
	write_old_record("queued");
	assert_int_equal(spool_write_job_file(jobs.spool, JOB, "log", "line", 4, &e), 0);
	assert_int_equal(reconcile_spool(&jobs, &e), 0);
	assert_false(job_file_exists(NULL));
	assert_int_equal(ledger_next_id(jobs.ledger), JOB + 1);
}

static void record_of_another_version_is_refused(void **state)
{
	(void)state;
	write_old_row(2, true);
	assert_int_equal(spool_write_job_file(jobs.spool, JOB, "job.json", "{\"schema\":2}", 12, &e), 0);
	assert_int_equal(ledger_open(&jobs.ledger, jobs.config.spool_folder, &e), 0);
	assert_int_equal(import_files(&jobs, &e), -EPROTO);
	assert_true(job_file_exists("job.json"));
}

static void notes_are_imported(void **state)
{
	(void)state;
	static const char *const names[][2] = {{"clock", "clock"}, {"aside", "quarantined"}};
	char *text;
	write_old_file("next-job", "41\n");
	for (int i = 0; i < 2; i++)
		write_old_file(names[i][0], "{}");
	for (int start = 0; start < 2; start++) {
		assert_int_equal(ledger_open(&jobs.ledger, jobs.config.spool_folder, &e), 0);
		assert_int_equal(import_files(&jobs, &e), 0);
		assert_int_equal(ledger_next_id(jobs.ledger), 41);
		for (int i = 0; i < 2; i++) {
			assert_int_equal(ledger_get_note(jobs.ledger, names[i][1], &text, &e), 0);
			assert_string_equal(text, "{}");
			mem_free(text);
		}
		if (start == 0)
			ledger_close(jobs.ledger);
	}
	write_old_file("next-job", "none\n");
	assert_int_equal(import_files(&jobs, &e), -EBADMSG);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(live_job_is_imported, set_up, tear_down),
		cmocka_unit_test_setup_teardown(copy_newer_than_the_row_is_imported, set_up, tear_down),
		cmocka_unit_test_setup_teardown(lost_row_is_restored_from_the_copy, set_up, tear_down),
		cmocka_unit_test_setup_teardown(ended_job_is_imported, set_up, tear_down),
		cmocka_unit_test_setup_teardown(ended_job_with_films_keeps_its_submission, set_up, tear_down),
		cmocka_unit_test_setup_teardown(job_ended_only_in_its_record_is_imported_as_ended, set_up, tear_down),
		cmocka_unit_test_setup_teardown(lone_record_of_an_ended_job_is_imported, set_up, tear_down),
		cmocka_unit_test_setup_teardown(extended_job_is_imported_as_live, set_up, tear_down),
		cmocka_unit_test_setup_teardown(damaged_record_is_set_aside, set_up, tear_down),
		cmocka_unit_test_setup_teardown(unknown_job_with_films_stops_the_start, set_up, tear_down),
		cmocka_unit_test_setup_teardown(job_that_was_never_accepted_is_deleted, set_up, tear_down),
		cmocka_unit_test_setup_teardown(waiting_job_without_a_ledger_is_kept, set_up, tear_down),
		cmocka_unit_test_setup_teardown(journal_without_a_row_is_deleted, set_up, tear_down),
		cmocka_unit_test_setup_teardown(record_of_another_version_is_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(notes_are_imported, set_up, tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
