/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What happens while the disk is asked: a checkpoint is held up in its last step, and meanwhile its job is cancelled or
 * counts go on; a record or a row that cannot be written is written later; a job goes on while an earlier flush lasts.
 * And what happens without memory.
 */
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/jobs/step.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/failing_memory.h"
#include "tests/support/folder.h"
#include "tests/support/scripted.h"

#include <setjmp.h>
#include <signal.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

enum { STATE_BYTES = 3000, PATIENCE = 60000, TICKS_US = 500000 /* two of the coordinator's */, BOOTSTRAP_LEASES = 8 };
static const char scene[] = "<scene/>";

/* Shared with the coordinator, which is another process. */
static struct {
	_Atomic bool hold_up, held_up, go_on; /* a checkpoint on its way to its name */
	_Atomic bool fail_folder;	      /* then the flush of that name fails */
	_Atomic bool fail_records;
	_Atomic bool hold_flush, held_flush, end_flush; /* the first one of a journal */
	_Atomic bool fail_flush;			/* which then fails */
	_Atomic bool fail_memory;			/* of one allocation, when room was made for a result: */
	_Atomic unsigned allocations;			/* of the one after so many */
} * disk;
static _Thread_local bool fail_next_folder;
static struct plan plan;
static struct plan_request request = {.integrator = "pssmlt",
				      .kind = PLAN_CHAINS,
				      .width = 20,
				      .height = 10,
				      .mutations = 3200,
				      .max_depth = 5,
				      .groups = 2,
				      .chains = 8,
				      .epoch = 100,
				      .bootstrap = 64};
static uint64_t journal_most, keep_most;
static pid_t pid;
static char spool[100], port_file[100];
static struct scripted *client, *worker;

/* ---- the coordinator ---- */

static bool ends_with(const char *path, const char *end)
{
	size_t n = strlen(path), m = strlen(end);
	return n >= m && strcmp(path + n - m, end) == 0;
}

static int own_rename(const char *from, const char *to)
{
	if (ends_with(to, "/job.json") && disk->fail_records) {
		errno = EIO;
		return -1;
	}
	if (ends_with(to, "/checkpoint") && disk->hold_up) {
		disk->held_up = true;
		while (!disk->go_on)
			usleep(1000);
		fail_next_folder = disk->fail_folder;
		disk->hold_up = false;
	}
	return disk_system.rename(from, to);
}

static int own_open(const char *path, int flags, mode_t mode)
{
	if ((flags & O_DIRECTORY) && fail_next_folder) {
		fail_next_folder = false;
		errno = EIO;
		return -1;
	}
	return disk_system.open(path, flags, mode);
}

static int own_fdatasync(int fd)
{
	if (!atomic_exchange(&disk->hold_flush, false))
		return disk_system.fdatasync(fd);
	disk->held_flush = true;
	while (!disk->end_flush)
		usleep(1000);
	errno = EIO;
	return disk->fail_flush ? -1 : disk_system.fdatasync(fd);
}

static int own_fallocate(int fd, int mode, off_t at, off_t size)
{
	if (atomic_exchange(&disk->fail_memory, false))
		mem_fail_after((long)disk->allocations);
	return disk_system.fallocate(fd, mode, at, size);
}

static void serve(void)
{
	struct disk own = disk_system;
	struct server_config c;
	struct error e;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	own.rename = own_rename;
	own.open = own_open;
	own.fdatasync = own_fdatasync;
	own.fallocate = own_fallocate;
	disk_use(&own);
	server_config_init(&c);
	c.listen = "127.0.0.1:0";
	c.spool = spool;
	c.port_file = port_file;
	c.journal_bytes = journal_most;
	c.keep_bytes = keep_most;
	c.retry_seconds = 0.05;
	log_set_level(LOG_LEVEL_ERROR);
	_exit(server_run(&c, &e) ? 1 : 0);
}

static void start(void)
{
	unsigned port = 0;
	unlink(port_file);
	fflush(NULL);
	pid = fork();
	if (pid == 0) {
		signal(SIGSEGV, SIG_DFL); /* or the test would go on in it */
		serve();
	}
	for (int i = 0; i < PATIENCE && !port; i++) {
		FILE *f = fopen(port_file, "r");
		if (f && fscanf(f, "%u", &port) != 1)
			port = 0;
		if (f)
			fclose(f);
		usleep(1000);
	}
	client = scripted_call((uint16_t)port, FARM__ROLE__ROLE_CLIENT);
	worker = scripted_call((uint16_t)port, FARM__ROLE__ROLE_WORKER);
	assert_true(client && worker && scripted_want(worker, 3));
}

static void end(int signal, bool well)
{
	int status;
	scripted_hang_up(client);
	scripted_hang_up(worker);
	kill(pid, signal);
	assert_true(waitpid(pid, &status, 0) == pid);
	assert_true(!well || (WIFEXITED(status) && WEXITSTATUS(status) == 0));
}

/* ---- its peers ---- */

static uint64_t submit(void)
{
	assert_true(scripted_submit(client, &request, scene));
	const Farm__Envelope *m = scripted_hear(client);
	if (m && m->body_case == FARM__ENVELOPE__BODY_SUBMIT_ANSWER && m->submit_answer->n_missing)
		m = scripted_send_scene(client, scene) ? scripted_hear(client) : NULL;
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_SUBMIT_ANSWER && m->submit_answer->job);
	return m->submit_answer->job;
}

static void order(const Farm__Envelope *m)
{
	assert_true(scripted_say(client, m, NULL, 0));
	const Farm__Envelope *answer = scripted_hear(client);
	assert_true(answer && answer->body_case == FARM__ENVELOPE__BODY_DONE && answer->done->ok);
}

static void cancel(uint64_t job)
{
	Farm__Cancel c;
	Farm__Envelope m;
	farm__cancel__init(&c);
	farm__envelope__init(&m);
	c.job = job;
	m.body_case = FARM__ENVELOPE__BODY_CANCEL;
	m.cancel = &c;
	order(&m);
}

static void fail_lease(const struct lease_key *k)
{
	Farm__LeaseFailed f;
	Farm__LeaseKey key;
	Farm__Envelope m;
	char text[] = "it does not work";
	farm__lease_failed__init(&f);
	farm__envelope__init(&m);
	lease_key_to_wire(k, &key);
	f.key = &key;
	f.text = text;
	m.body_case = FARM__ENVELOPE__BODY_LEASE_FAILED;
	m.lease_failed = &f;
	assert_true(scripted_say(worker, &m, NULL, 0));
}

static void extend(uint64_t job, uint64_t mutations)
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
	order(&m);
	struct plan_request longer = request;
	longer.mutations += mutations;
	assert_int_equal(plan_make(&longer, &plan, &e), 0);
}

/* false: the coordinator is gone. */
static bool answer_lease(const struct lease_key *k)
{
	struct batch b = scripted_batch(k, &plan, STATE_BYTES);
	bool said = scripted_send(worker, &b, &plan);
	batch_fini(&b);
	return said;
}

static unsigned sent, acknowledged, open_count;
static struct lease_key open_leases[8]; /* not answered yet */

/* Until it has sent so many results in all, and heard that so many of them are merged. */
static void work_until(unsigned results, unsigned acks)
{
	for (;;) {
		for (; open_count && sent < results; sent++)
			assert_true(answer_lease(&open_leases[--open_count]));
		if (sent == results && acknowledged >= acks)
			return;
		struct error e;
		const Farm__Envelope *m = scripted_hear(worker);
		assert_non_null(m);
		acknowledged += scripted_is_merged(m);
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_true(open_count < 8);
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &open_leases[open_count++], &e), 0);
	}
}

/* Answers leases until this is so, but the first one of the image, if it is to be kept. */
static void work(const _Atomic bool *until, struct lease_key *keep)
{
	while (!*until) {
		struct grant grant;
		struct error e;
		if (!scripted_has(worker, 5))
			continue;
		const Farm__Envelope *m = scripted_hear(worker);
		assert_non_null(m);
		acknowledged += scripted_is_merged(m);
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END)
			return;
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_int_equal(grant_unpack(&grant, m->lease_grant, worker->reader.payload.bytes,
					      worker->reader.payload.size, &e),
				 0);
		if (keep && grant.key.kind == LEASE_RENDER && !keep->job)
			*keep = grant.key;
		else
			assert_true(answer_lease(&grant.key));
		grant_fini(&grant);
	}
}

static void await_state(uint64_t job, const char *state)
{
	for (int i = 0; i < PATIENCE / 10; i++) {
		assert_true(scripted_list(client));
		const Farm__Envelope *m = scripted_hear(client);
		assert_true(m && m->job_list_answer->n_jobs == job);
		if (strcmp(m->job_list_answer->jobs[job - 1]->state, state) == 0)
			return;
		usleep(10000);
	}
	fail_msg("it is never %s", state);
}

/* ---- tests ---- */

static int set_up(void **state)
{
	struct error e;
	int rc = folder_set_up(state);
	snprintf(spool, sizeof spool, "%s/spool", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	memset(disk, 0, sizeof *disk);
	journal_most = 2000;
	keep_most = 0;
	return rc ? rc : plan_make(&request, &plan, &e);
}

/* The end of the job comes while it is held because of the checkpoint. */
static void cancelled_while_its_checkpoint_fails(void **state)
{
	(void)state;
	disk->hold_up = disk->fail_folder = true;
	start();
	uint64_t job = submit();
	work(&disk->held_up, NULL);
	cancel(job);
	disk->go_on = true;
	await_state(job, "cancelled");
	end(SIGTERM, true);
}

/* The failures that the job's record knows when the coordinator had its ticks after the failure, and after the
 * checkpoint. */
static uint64_t failures_after(useconds_t ticks_us)
{
	struct lease_key kept = {.job = 0};
	struct job_record r;
	struct spool *s;
	struct error e;
	disk->hold_up = true;
	disk->held_up = disk->go_on = false;
	start();
	uint64_t job = submit();
	work(&disk->held_up, &kept);
	assert_true(kept.job == job);
	fail_lease(&kept);
	usleep(ticks_us);
	disk->go_on = true;
	usleep(ticks_us);
	end(SIGKILL, false);
	start();
	cancel(job);
	await_state(job, "cancelled");
	end(SIGTERM, true);
	assert_int_equal(spool_open(&s, spool, &e), 0);
	assert_int_equal(spool_read_record(s, job, &r, &e), 0);
	spool_close(s);
	return r.counts.failures;
}

/* On a machine that is busy enough no tick came: once more, with more time. */
static void counted_while_a_checkpoint_is_written(void **state)
{
	(void)state;
	uint64_t failures = 0;
	for (useconds_t us = TICKS_US; !failures && us <= 100 * TICKS_US; us *= 10)
		failures = failures_after(us);
	assert_int_equal(failures, 1);
}

static void *copy_of(const void *bytes, size_t size)
{
	void *copy = malloc(size);
	assert_non_null(copy);
	return memcpy(copy, bytes, size);
}

/* It went on after its end, without films, and is cancelled: its earlier result is there, and nothing to make another
 * one of. */
static void a_record_is_written_later(void **state)
{
	(void)state;
	static _Atomic bool never;
	struct ledger *l;
	struct ledger_job j;
	struct error e;
	char path[150];
	snprintf(path, sizeof path, "%s/jobs.db", spool);
	start();
	uint64_t job = submit();
	end(SIGKILL, false);
	assert_int_equal(ledger_open(&l, path, &e), 0);
	assert_int_equal(ledger_get(l, job, &j, &e), 1);
	void *submission = copy_of(j.submission, j.submission_size), *frame = copy_of(j.plan, j.plan_size);
	ledger_close(l);
	start();
	work(&never, NULL);
	await_state(job, "done");
	end(SIGTERM, true);
	assert_int_equal(ledger_open(&l, path, &e), 0);
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
	start();
	disk->fail_records = true;
	cancel(job);
	usleep(TICKS_US);
	await_state(job, "running");
	disk->fail_records = false;
	await_state(job, "cancelled");
	end(SIGTERM, true);
}

static int count_batch(void *user, const struct journal_item *item, struct error *e)
{
	(void)e;
	*(unsigned *)user += item->kind == JOURNAL_BATCH && !item->missing;
	return 0;
}

/* Results of the job wait for a slow flush when it ends; it is extended, and others come, while the flush goes on. */
static void extended_during_a_flush(bool fails)
{
	unsigned first = plan.groups * plan.parts * (unsigned)(plan.rounds + 1), more = first + 6, after = more + 4,
		 there = 0;
	char path[150];
	struct journal_found found;
	struct journal *j;
	struct error e;
	journal_most = keep_most = 1 << 30;
	disk->fail_flush = fails;
	disk->hold_flush = true;
	sent = acknowledged = open_count = 0;
	start();
	uint64_t job = submit();
	work_until(first, 0);
	await_state(job, "done");
	assert_true(disk->held_flush && acknowledged == 0);
	extend(job, 6400);
	assert_true(scripted_want(worker, 3));
	work_until(more, 0);
	disk->end_flush = true;
	work_until(more, more);
	work_until(after, after);
	await_state(job, "running");
	end(SIGKILL, false);
	snprintf(path, sizeof path, "%s/jobs/j%llu", spool, (unsigned long long)job);
	assert_int_equal(journal_open(&j, path, job, 0, count_batch, &there, &found, &e), 0);
	journal_release(j);
	assert_true(there >= acknowledged);
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

/* Hears until the job ends or the coordinator does, and answers leases. false: it was the coordinator. */
static bool work_on(void)
{
	for (const Farm__Envelope *m; (m = scripted_hear(worker));) {
		struct lease_key k;
		struct error e;
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END)
			return true;
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &k, &e), 0);
		if (!answer_lease(&k))
			return false;
	}
	return false;
}

/* Whichever allocation it is that fails while a result is merged: the job goes on, at the latest when the coordinator
 * starts again. */
static void without_memory_for_a_result(void **state)
{
	(void)state;
	enum { TRIES = 6 };
	unsigned ends = 0;
	for (unsigned i = 0; i < TRIES; i++) {
		disk->allocations = i;
		start();
		uint64_t job = submit();
		disk->fail_memory = true;
		if (!work_on()) {
			ends++;
			end(SIGKILL, false);
			start();
			assert_true(work_on());
		}
		await_state(job, "done");
		assert_false(disk->fail_memory);
		end(SIGTERM, true);
	}
	assert_true(ends > 0);
}

/* From now on the ledger takes no end of a job before a job 2 is in it. */
static void refuse_ends(void)
{
	char path[150];
	sqlite3 *db;
	start();
	end(SIGTERM, true);
	snprintf(path, sizeof path, "%s/jobs.db", spool);
	assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
	assert_int_equal(
		sqlite3_exec(
			db,
			"CREATE TRIGGER refuse BEFORE UPDATE OF ended ON jobs WHEN NEW.ended IS NOT NULL AND NOT EXISTS"
			" (SELECT * FROM jobs WHERE id = 2) BEGIN SELECT RAISE(ABORT, 'no'); END",
			NULL, NULL, NULL),
		SQLITE_OK);
	assert_int_equal(sqlite3_close(db), SQLITE_OK);
}

static void extended_before_its_row_has_ended(void **state)
{
	(void)state;
	keep_most = 1 << 30;
	refuse_ends();
	start();
	uint64_t job = submit();
	assert_true(work_on());
	await_state(job, "done");
	extend(job, 6400);
	end(SIGKILL, false);
	start();
	await_state(job, "running");
	end(SIGKILL, false);
}

/* ---- the coordinator is in this process ---- */

static struct server *open_here(void)
{
	struct server_config c;
	struct server *s = NULL;
	struct error e;
	server_config_init(&c);
	c.listen = "127.0.0.1:0";
	c.spool = spool;
	c.retry_seconds = 0.05;
	if (server_open(&s, &c, &e) || server_await_jobs(s, &e) == 0)
		return s;
	server_close(s);
	return NULL;
}

static void a_row_ends_later(void **state)
{
	(void)state;
	struct ledger_job j = {.id = 2, .owner = "", .name = "", .version = ""};
	struct error e;
	refuse_ends();
	start();
	uint64_t job = submit();
	end(SIGKILL, false);
	struct server *s = open_here();
	assert_non_null(s);
	jobs_step(&s->jobs, &(struct event){.kind = EVENT_CANCEL, .job = job});
	assert_true(s->jobs.endings && !s->jobs.live);
	assert_int_equal(ledger_add(s->jobs.ledger, &j, &e), 0);
	while (s->jobs.endings)
		uv_run(&s->loop, UV_RUN_ONCE);
	assert_int_equal(ledger_next(s->jobs.ledger, 0, &j, &e), 1);
	assert_int_equal(j.id, 2);
	server_close(s);
}

/* Half of its leases are merged, and stored, so that there are films. */
static uint64_t begin_a_job(void)
{
	struct lease_key kept = {.job = 0};
	disk->hold_up = true;
	acknowledged = 0;
	start();
	uint64_t job = submit();
	work(&disk->held_up, &kept);
	while (acknowledged < BOOTSTRAP_LEASES)
		acknowledged += scripted_is_merged(scripted_hear(worker));
	end(SIGKILL, false);
	return job;
}

/* Whatever its image is for, the job lives, and in the end there is one. */
static void no_memory_for_an_image(void **state)
{
	(void)state;
	uint64_t id = begin_a_job();
	struct server *s = open_here();
	assert_non_null(s);
	struct live_job *job = jobs_find(&s->jobs, id);
	assert_true(job && job->canvas);
	for (enum publish_what what = PUBLISH_ERROR_ONLY; what <= PUBLISH_RESULT; what++) {
		mem_fail_after(0);
		publish_start(&s->jobs, job, what, live_job_rounds(job));
		mem_fail_after(-1);
		assert_true(job->busy && !s->jobs.deferred);
		while (job->busy || (what == PUBLISH_RESULT && !job->record.has_result))
			uv_run(&s->loop, UV_RUN_ONCE);
		struct job_status status;
		assert_true(farm_job(s->jobs.farm, id, jobs_now(&s->jobs), &status) && status.state == JOB_RUNNING);
	}
	server_close(s);
}

/* Whether the allocation that was to fail had its turn. */
static bool has_failed(void)
{
	void *p = mem_alloc(1, 1);
	for (int i = 0; i < 1000 && p; i++, p = mem_alloc(1, 1))
		mem_free(p);
	mem_free(p);
	mem_fail_after(-1);
	return p != NULL;
}

static bool opens_without(long allocation)
{
	struct job_counts counts;
	mem_fail_after(allocation);
	struct server *s = open_here();
	bool failed = has_failed();
	assert_true(s || failed);
	if (s) {
		assert_true(s->jobs.live && s->jobs.live->canvas &&
			    farm_counts(s->jobs.farm, s->jobs.live->id, &counts));
		server_close(s);
	}
	return failed;
}

/* It starts with all its jobs or not at all. */
static void no_memory_for_a_start(void **state)
{
	(void)state;
	begin_a_job();
	long n = 0;
	while (opens_without(n))
		n++;
	print_message("   %ld allocations\n", n);
	assert_true(n > 50);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(cancelled_while_its_checkpoint_fails, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(counted_while_a_checkpoint_is_written, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_record_is_written_later, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_during_a_slow_flush, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_during_a_flush_that_fails, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(without_memory_for_a_result, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(extended_before_its_row_has_ended, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_row_ends_later, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(no_memory_for_an_image, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(no_memory_for_a_start, set_up, folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	disk = mmap(NULL, sizeof *disk, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	return disk == MAP_FAILED ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
