/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator whose disk calls obey the test (staged.h): the functions behind common/base/disk.h look at flags in
 * memory that both processes share, and wait until they are told to go on, or fail. The name of its file identifies a
 * call.
 */
#include "tests/support/staged.h"

#include "common/base/disk.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/failing_memory.h"
#include "tests/support/folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <cmocka.h>

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

enum { STATE_BYTES = 3000, PATIENCE = 60000, BOOTSTRAP_LEASES = 8 };

struct staged_disk *staged_disk;
struct staged staged;
static _Thread_local bool fail_next_folder;
static atomic_int scene_fd = -1; /* the scene's file that was opened last */
static pid_t pid;
static char port_file[100];

/* ---- the coordinator ---- */

static bool ends_with(const char *path, const char *end)
{
	size_t n = strlen(path), m = strlen(end);
	return n >= m && strcmp(path + n - m, end) == 0;
}

static int own_rename(const char *from, const char *to)
{
	if (ends_with(to, "/checkpoint") && staged_disk->hold_up) {
		staged_disk->held_up = true;
		while (!staged_disk->go_on)
			usleep(1000);
		fail_next_folder = staged_disk->fail_folder;
		staged_disk->hold_up = false;
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
	if (staged_disk->no_room && ends_with(path, ".new")) {
		errno = ENOSPC;
		return -1;
	}
	int fd = disk_system.open(path, flags, mode);
	if (strstr(path, "/blobs/") && !(flags & O_CREAT))
		scene_fd = fd;
	return fd;
}

static ssize_t own_read(int fd, void *bytes, size_t size)
{
	if (fd == scene_fd && atomic_exchange(&staged_disk->hold_read, false)) {
		staged_disk->held_read = true;
		while (!staged_disk->end_read)
			usleep(1000);
	}
	return disk_system.read(fd, bytes, size);
}

static int own_fdatasync(int fd)
{
	if (!atomic_exchange(&staged_disk->hold_flush, false))
		return disk_system.fdatasync(fd);
	staged_disk->held_flush = true;
	while (!staged_disk->end_flush)
		usleep(1000);
	errno = EIO;
	return staged_disk->fail_flush ? -1 : disk_system.fdatasync(fd);
}

static int own_fallocate(int fd, int mode, off_t at, off_t size)
{
	if (atomic_exchange(&staged_disk->fail_memory, false))
		mem_fail_after((long)staged_disk->allocations);
	return disk_system.fallocate(fd, mode, at, size);
}

static int refuse_commit(void *user)
{
	(void)user;
	staged_disk->refused += staged_disk->fail_ledger;
	return staged_disk->fail_ledger;
}

/* SQLite calls this for each connection that it opens. */
int staged_hook_commits(sqlite3 *db, const char **text, const struct sqlite3_api_routines *api)
{
	(void)text;
	(void)api;
	sqlite3_commit_hook(db, refuse_commit, NULL);
	return SQLITE_OK;
}

static void serve(void)
{
	struct disk own = disk_system;
	struct server_config c;
	struct error e;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	own.rename = own_rename;
	own.open = own_open;
	own.read = own_read;
	own.fdatasync = own_fdatasync;
	own.fallocate = own_fallocate;
	disk_use(&own);
	sqlite3_auto_extension((void (*)(void))staged_hook_commits);
	server_config_init(&c);
	c.listen = "127.0.0.1:0";
	c.spool = staged.spool;
	c.port_file = port_file;
	c.journal_bytes = staged.journal_bytes;
	c.keep_bytes = staged.keep_bytes;
	c.state_bytes = staged.state_bytes;
	c.retry_seconds = 0.05;
	log_set_level(LOG_LEVEL_ERROR);
	_exit(server_run(&c, &e) ? 1 : 0);
}

void staged_start(void)
{
	unlink(port_file);
	fflush(NULL);
	pid = fork();
	if (pid == 0) {
		signal(SIGSEGV, SIG_DFL); /* otherwise the test would continue in the child */
		serve();
	}
	uint16_t port = scripted_port(port_file);
	staged.client = scripted_call(port, FARM__ROLE__ROLE_CLIENT);
	staged.worker = scripted_call(port, FARM__ROLE__ROLE_WORKER);
	assert_true(staged.client && staged.worker && scripted_want(staged.worker, 3));
}

void staged_end(int signal, bool well)
{
	int status;
	scripted_hang_up(staged.client);
	scripted_hang_up(staged.worker);
	kill(pid, signal);
	assert_true(waitpid(pid, &status, 0) == pid);
	assert_true(!well || (WIFEXITED(status) && WEXITSTATUS(status) == 0));
}

/* ---- its peers ---- */

uint64_t staged_submit(void)
{
	return scripted_submit_whole(staged.client, &scripted_request, "<scene/>");
}

static const Farm__Done *ask_for_done(const Farm__Envelope *m)
{
	assert_true(scripted_say(staged.client, m, NULL, 0));
	const Farm__Envelope *answer = scripted_hear(staged.client);
	assert_true(answer && answer->body_case == FARM__ENVELOPE__BODY_DONE);
	return answer->done;
}

void staged_order(const Farm__Envelope *m)
{
	assert_true(ask_for_done(m)->ok);
}

const char *staged_refusal(const Farm__Envelope *m)
{
	const Farm__Done *answer = ask_for_done(m);
	assert_false(answer->ok);
	return answer->text;
}

static const Farm__Done *cancel(uint64_t job)
{
	Farm__Cancel c;
	Farm__Envelope m;
	farm__cancel__init(&c);
	farm__envelope__init(&m);
	c.job = job;
	m.body_case = FARM__ENVELOPE__BODY_CANCEL;
	m.cancel = &c;
	return ask_for_done(&m);
}

void staged_cancel(uint64_t job)
{
	assert_true(cancel(job)->ok);
}

void staged_cancel_unstored(uint64_t job)
{
	const Farm__Done *answer = cancel(job);
	assert_true(!answer->ok && strstr(answer->text, "cancelled, but only until the coordinator restarts: "));
}

bool staged_answer(const struct lease_key *k)
{
	struct batch b = scripted_batch(k, &staged.plan, STATE_BYTES);
	bool said = scripted_send(staged.worker, &b, &staged.plan);
	batch_fini(&b);
	return said;
}

void staged_fail(const struct lease_key *k)
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
	assert_true(scripted_say(staged.worker, &m, NULL, 0));
}

void staged_work(const _Atomic bool *until, struct lease_key *keep)
{
	while (!*until) {
		struct grant grant;
		struct error e;
		if (!scripted_has(staged.worker, 5))
			continue;
		const Farm__Envelope *m = scripted_hear(staged.worker);
		assert_non_null(m);
		staged.acknowledged += scripted_is_merged(m);
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END)
			return;
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_int_equal(grant_unpack(&grant, m->lease_grant, staged.worker->reader.payload.bytes,
					      staged.worker->reader.payload.size, &e),
				 0);
		if (keep && grant.key.kind == LEASE_RENDER && !keep->job)
			*keep = grant.key;
		else
			assert_true(staged_answer(&grant.key));
		grant_fini(&grant);
	}
}

void staged_await_state(uint64_t job, const char *state)
{
	for (int i = 0; i < PATIENCE / 10; i++) {
		assert_true(scripted_list(staged.client));
		const Farm__Envelope *m = scripted_hear(staged.client);
		assert_true(m && m->job_list_answer->n_jobs == job);
		if (strcmp(m->job_list_answer->jobs[job - 1]->state, state) == 0)
			return;
		usleep(10000);
	}
	fail_msg("it is never %s", state);
}

bool staged_work_on(void)
{
	for (const Farm__Envelope *m; (m = scripted_hear(staged.worker));) {
		struct lease_key k;
		struct error e;
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END)
			return true;
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &k, &e), 0);
		if (!staged_answer(&k))
			return false;
	}
	return false;
}

uint64_t staged_begin_a_job(void)
{
	struct lease_key kept = {.job = 0};
	staged_disk->hold_up = true;
	staged.acknowledged = 0;
	staged_start();
	uint64_t job = staged_submit();
	staged_work(&staged_disk->held_up, &kept);
	while (staged.acknowledged < BOOTSTRAP_LEASES)
		staged.acknowledged += scripted_is_merged(scripted_hear(staged.worker));
	staged_end(SIGKILL, false);
	return job;
}

struct server *staged_open_here(void)
{
	struct server_config c;
	struct server *s = NULL;
	struct error e;
	server_config_init(&c);
	c.listen = "127.0.0.1:0";
	c.spool = staged.spool;
	c.retry_seconds = 0.05;
	if (server_open(&s, &c, &e) || server_await_jobs(s, &e) == 0)
		return s;
	server_close(s);
	return NULL;
}

int staged_open(void)
{
	staged_disk = mmap(NULL, sizeof *staged_disk, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	return staged_disk == MAP_FAILED;
}

int staged_set_up(void **state)
{
	struct error e;
	int rc = folder_set_up(state);
	snprintf(staged.spool, sizeof staged.spool, "%s/spool", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	memset(staged_disk, 0, sizeof *staged_disk);
	staged.journal_bytes = 2000;
	staged.keep_bytes = 0;
	staged.state_bytes = 1 << 20;
	return rc ? rc : plan_make(&scripted_request, &staged.plan, &e);
}
