/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A coordinator whose disk calls obey the test (staged_server.h): the functions behind common/base/disk.h look at flags
 * in memory that both processes share, and wait until they are told to go on, or fail. The name of its file identifies
 * a call.
 */
#include "tests/support/staged_server.h"

#include "common/base/disk.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/failing_memory.h"
#include "tests/support/temporary_folder.h"

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

enum { STATE_BYTES = 3000, TIMEOUT_MS = 60000, BOOTSTRAP_LEASES = 8 };

struct staged_disk *staged_disk;
struct staged_server staged_server;
static _Thread_local bool fail_next_folder_open;
static atomic_int scene_fd = -1; /* the scene's file that was opened last */
static pid_t server_pid;
static char port_file[100];

/* ---- the coordinator ---- */

static bool ends_with(const char *path, const char *end)
{
	size_t n = strlen(path), m = strlen(end);
	return n >= m && strcmp(path + n - m, end) == 0;
}

static int staged_rename(const char *from, const char *to)
{
	if (ends_with(to, "/checkpoint") && staged_disk->hold_checkpoint) {
		staged_disk->checkpoint_held = true;
		while (!staged_disk->release_checkpoint)
			usleep(1000);
		fail_next_folder_open = staged_disk->fail_folder_flush;
		staged_disk->hold_checkpoint = false;
	}
	return disk_system.rename(from, to);
}

static int staged_open_file(const char *path, int flags, mode_t mode)
{
	if ((flags & O_DIRECTORY) && fail_next_folder_open) {
		fail_next_folder_open = false;
		errno = EIO;
		return -1;
	}
	if (staged_disk->no_journal_room && ends_with(path, ".new")) {
		errno = ENOSPC;
		return -1;
	}
	int fd = disk_system.open(path, flags, mode);
	if (strstr(path, "/blobs/") && !(flags & O_CREAT))
		scene_fd = fd;
	return fd;
}

static ssize_t staged_read(int fd, void *bytes, size_t size)
{
	if (fd == scene_fd && atomic_exchange(&staged_disk->hold_read, false)) {
		staged_disk->read_held = true;
		while (!staged_disk->release_read)
			usleep(1000);
	}
	return disk_system.read(fd, bytes, size);
}

static int staged_fdatasync(int fd)
{
	if (!atomic_exchange(&staged_disk->hold_flush, false))
		return disk_system.fdatasync(fd);
	staged_disk->flush_held = true;
	while (!staged_disk->release_flush)
		usleep(1000);
	errno = EIO;
	return staged_disk->fail_flush ? -1 : disk_system.fdatasync(fd);
}

static int staged_fallocate(int fd, int mode, off_t at, off_t size)
{
	if (atomic_exchange(&staged_disk->fail_allocation, false))
		mem_fail_after((long)staged_disk->allocations_before_failure);
	return disk_system.fallocate(fd, mode, at, size);
}

static int refuse_commit(void *user)
{
	(void)user;
	staged_disk->refused_commits += staged_disk->fail_ledger_writes;
	return staged_disk->fail_ledger_writes;
}

/* SQLite calls this for each connection that it opens. */
int staged_server_hook_commits(sqlite3 *db, const char **text, const struct sqlite3_api_routines *api)
{
	(void)text;
	(void)api;
	sqlite3_commit_hook(db, refuse_commit, NULL);
	return SQLITE_OK;
}

static void run_coordinator(void)
{
	struct disk staged_calls = disk_system;
	struct server_config c;
	struct error e;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	staged_calls.rename = staged_rename;
	staged_calls.open = staged_open_file;
	staged_calls.read = staged_read;
	staged_calls.fdatasync = staged_fdatasync;
	staged_calls.fallocate = staged_fallocate;
	disk_set_calls(&staged_calls);
	sqlite3_auto_extension((void (*)(void))staged_server_hook_commits);
	server_config_init(&c);
	c.listen_address = "127.0.0.1:0";
	c.spool_folder = staged_server.spool;
	c.port_file = port_file;
	c.max_journal_bytes = staged_server.journal_bytes;
	c.retained_film_bytes = staged_server.keep_bytes;
	c.max_state_bytes = staged_server.state_bytes;
	c.retry_seconds = 0.05;
	log_set_level(LOG_LEVEL_ERROR);
	_exit(server_run(&c, &e) ? 1 : 0);
}

void staged_server_start(void)
{
	unlink(port_file);
	fflush(NULL);
	server_pid = fork();
	if (server_pid == 0) {
		signal(SIGSEGV, SIG_DFL); /* otherwise the test would continue in the child */
		run_coordinator();
	}
	uint16_t port = scripted_peer_read_port(port_file);
	staged_server.client = scripted_peer_connect_as(port, FARM__ROLE__ROLE_CLIENT);
	staged_server.worker = scripted_peer_connect_as(port, FARM__ROLE__ROLE_WORKER);
	assert_true(staged_server.client && staged_server.worker &&
		    scripted_peer_request_leases(staged_server.worker, 3));
}

void staged_server_end(int signal, bool must_succeed)
{
	int status;
	scripted_peer_disconnect(staged_server.client);
	scripted_peer_disconnect(staged_server.worker);
	kill(server_pid, signal);
	assert_true(waitpid(server_pid, &status, 0) == server_pid);
	assert_true(!must_succeed || (WIFEXITED(status) && WEXITSTATUS(status) == 0));
}

/* ---- its peers ---- */

uint64_t staged_server_submit(void)
{
	return scripted_peer_submit_with_scene(staged_server.client, &scripted_peer_plan_request, "<scene/>");
}

static const Farm__Done *exchange_done(const Farm__Envelope *m)
{
	assert_true(scripted_peer_send(staged_server.client, m, NULL, 0));
	const Farm__Envelope *answer = scripted_peer_receive(staged_server.client);
	assert_true(answer && answer->body_case == FARM__ENVELOPE__BODY_DONE);
	return answer->done;
}

void staged_server_request(const Farm__Envelope *m)
{
	assert_true(exchange_done(m)->ok);
}

const char *staged_server_request_refused(const Farm__Envelope *m)
{
	const Farm__Done *answer = exchange_done(m);
	assert_false(answer->ok);
	return answer->text;
}

static const Farm__Done *send_cancel(uint64_t job)
{
	Farm__Cancel c;
	Farm__Envelope m;
	farm__cancel__init(&c);
	farm__envelope__init(&m);
	c.job = job;
	m.body_case = FARM__ENVELOPE__BODY_CANCEL;
	m.cancel = &c;
	return exchange_done(&m);
}

void staged_server_cancel(uint64_t job)
{
	assert_true(send_cancel(job)->ok);
}

void staged_server_cancel_unstored(uint64_t job)
{
	const Farm__Done *answer = send_cancel(job);
	assert_true(!answer->ok && strstr(answer->text, "cancelled, but only until the coordinator restarts: "));
}

bool staged_server_answer_lease(const struct lease_key *k)
{
	struct batch b = scripted_peer_make_batch(k, &staged_server.plan, STATE_BYTES);
	bool sent = scripted_peer_send_batch(staged_server.worker, &b, &staged_server.plan);
	batch_fini(&b);
	return sent;
}

void staged_server_fail_lease(const struct lease_key *k)
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
	assert_true(scripted_peer_send(staged_server.worker, &m, NULL, 0));
}

void staged_server_work_until(const _Atomic bool *until, struct lease_key *keep)
{
	while (!*until) {
		struct grant grant;
		struct error e;
		if (!scripted_peer_is_readable(staged_server.worker, 5))
			continue;
		const Farm__Envelope *m = scripted_peer_receive(staged_server.worker);
		assert_non_null(m);
		staged_server.acknowledged += scripted_peer_is_merge_ack(m);
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END)
			return;
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_int_equal(grant_unpack(&grant, m->lease_grant, staged_server.worker->reader.payload.bytes,
					      staged_server.worker->reader.payload.size, &e),
				 0);
		if (keep && grant.key.kind == LEASE_RENDER && !keep->job)
			*keep = grant.key;
		else
			assert_true(staged_server_answer_lease(&grant.key));
		grant_fini(&grant);
	}
}

void staged_server_await_state(uint64_t job, const char *state)
{
	for (int i = 0; i < TIMEOUT_MS / 10; i++) {
		assert_true(scripted_peer_request_job_list(staged_server.client));
		const Farm__Envelope *m = scripted_peer_receive(staged_server.client);
		assert_true(m && m->job_list_answer->n_jobs == job);
		if (strcmp(m->job_list_answer->jobs[job - 1]->state, state) == 0)
			return;
		usleep(10000);
	}
	fail_msg("it is never %s", state);
}

bool staged_server_work_to_end(void)
{
	for (const Farm__Envelope *m; (m = scripted_peer_receive(staged_server.worker));) {
		struct lease_key k;
		struct error e;
		if (m->body_case == FARM__ENVELOPE__BODY_JOB_END)
			return true;
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT)
			continue;
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &k, &e), 0);
		if (!staged_server_answer_lease(&k))
			return false;
	}
	return false;
}

uint64_t staged_server_begin_job(void)
{
	struct lease_key kept = {.job = 0};
	staged_disk->hold_checkpoint = true;
	staged_server.acknowledged = 0;
	staged_server_start();
	uint64_t job = staged_server_submit();
	staged_server_work_until(&staged_disk->checkpoint_held, &kept);
	while (staged_server.acknowledged < BOOTSTRAP_LEASES)
		staged_server.acknowledged += scripted_peer_is_merge_ack(scripted_peer_receive(staged_server.worker));
	staged_server_end(SIGKILL, false);
	return job;
}

struct server *staged_server_open_in_process(void)
{
	struct server_config c;
	struct server *s = NULL;
	struct error e;
	server_config_init(&c);
	c.listen_address = "127.0.0.1:0";
	c.spool_folder = staged_server.spool;
	c.retry_seconds = 0.05;
	if (server_open(&s, &c, &e) || server_await_jobs(s, &e) == 0)
		return s;
	server_close(s);
	return NULL;
}

int staged_server_map_disk(void)
{
	staged_disk = mmap(NULL, sizeof *staged_disk, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	return staged_disk == MAP_FAILED;
}

int staged_server_set_up(void **state)
{
	struct error e;
	int rc = temporary_folder_set_up(state);
	snprintf(staged_server.spool, sizeof staged_server.spool, "%s/spool", temporary_folder);
	snprintf(port_file, sizeof port_file, "%s/port", temporary_folder);
	memset(staged_disk, 0, sizeof *staged_disk);
	staged_server.journal_bytes = 2000;
	staged_server.keep_bytes = 0;
	staged_server.state_bytes = 1 << 20;
	return rc ? rc : plan_make(&scripted_peer_plan_request, &staged_server.plan, &e);
}
