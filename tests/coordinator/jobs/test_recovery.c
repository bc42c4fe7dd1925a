/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A restarted coordinator reads its jobs from a disk that returns one piece at a time, when the test allows it.
 * Meanwhile it accepts peers, reports its progress, answers what it can, and answers the remaining requests in their
 * order once the jobs are there. No acknowledged result is asked for again.
 */
#include "common/base/disk.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/folder.h"
#include "tests/support/scripted.h"

#include <setjmp.h>
#include <signal.h>
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

enum {
	STATE_BYTES = 3000,
	PATIENCE = 60000,
	FILES = 256,
	ALL = 1 << 30,
	RESULTS = 20,
	LEASES = 8 + 4 * 8 /* leases of the job */
};

/* Shared with the coordinator, which is another process. */
static struct {
	_Atomic int allowed, asked; /* pieces of journals and checkpoints */
} * disk;
static atomic_bool is_film[FILES]; /* indexed by descriptor */

static struct plan plan;
static uint64_t journal_most;
static double heartbeat; /* s; a peer that is silent for six of them is disconnected */
static pid_t pid;
static uint16_t port;
static char spool[100], port_file[100];
static struct scripted *client, *worker;

/* ---- the coordinator ---- */

static int own_open(const char *path, int flags, mode_t mode)
{
	int fd = disk_system.open(path, flags, mode);
	if (fd >= 0 && fd < FILES)
		is_film[fd] = strstr(path, "/journal.") || strstr(path, "/checkpoint");
	return fd;
}

static ssize_t own_pread(int fd, void *bytes, size_t size, off_t at)
{
	if (fd < FILES && is_film[fd]) {
		int turn = disk->asked++;
		while (turn >= disk->allowed)
			usleep(500);
	}
	return disk_system.pread(fd, bytes, size, at);
}

static void serve(void)
{
	struct disk own = disk_system;
	struct server_config c;
	struct error e;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	own.open = own_open;
	own.pread = own_pread;
	disk_use(&own);
	server_config_init(&c);
	c.listen = "127.0.0.1:0";
	c.spool = spool;
	c.port_file = port_file;
	c.journal_bytes = journal_most;
	c.heartbeat_seconds = heartbeat;
	log_set_level(LOG_LEVEL_ERROR);
	_exit(server_run(&c, &e) ? 1 : 0);
}

static void start(int allowed)
{
	disk->allowed = allowed;
	disk->asked = 0;
	unlink(port_file);
	fflush(NULL);
	pid = fork();
	if (pid == 0) {
		signal(SIGSEGV, SIG_DFL);
		serve();
	}
	port = scripted_port(port_file);
}

static void end(int signal, bool well)
{
	int status;
	scripted_hang_up(client);
	scripted_hang_up(worker);
	client = worker = NULL;
	kill(pid, signal);
	assert_true(waitpid(pid, &status, 0) == pid);
	assert_true(!well || (WIFEXITED(status) && WEXITSTATUS(status) == 0));
}

/* ---- its peers ---- */

static struct lease_key done[LEASES];
static size_t done_count, sent;

static bool is_done(const struct lease_key *k)
{
	for (size_t i = 0; i < done_count; i++)
		if (done[i].kind == k->kind && done[i].group == k->group && done[i].part == k->part &&
		    done[i].epoch == k->epoch)
			return true;
	return false;
}

/* Sends results until there are `results` in all, and each of them is acknowledged, once. */
static void work_until(size_t results)
{
	while (done_count < results) {
		struct error e;
		struct lease_key k;
		const Farm__Envelope *m = scripted_hear(worker);
		assert_non_null(m);
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK) {
			assert_int_equal(m->lease_ack->verdict, FARM__VERDICT__VERDICT_MERGED);
			assert_int_equal(lease_key_from_wire(m->lease_ack->key, &k, &e), 0);
			assert_false(is_done(&k));
			done[done_count++] = k;
		}
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT || sent == results)
			continue;
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &k, &e), 0);
		assert_false(is_done(&k));
		struct batch b = scripted_batch(&k, &plan, STATE_BYTES);
		assert_true(scripted_send(worker, &b, &plan));
		batch_fini(&b);
		sent++;
	}
}

/* Submits a job, has part of it computed, and stops the coordinator. */
static uint64_t begin_a_job(void)
{
	done_count = sent = 0;
	start(ALL);
	client = scripted_call(port, FARM__ROLE__ROLE_CLIENT);
	worker = scripted_call(port, FARM__ROLE__ROLE_WORKER);
	assert_true(client && worker && scripted_want(worker, 3));
	uint64_t job = scripted_submit_whole(client, &scripted_request, "<scene/>");
	work_until(RESULTS);
	end(SIGKILL, false);
	return job;
}

/* Returns the part of the only job that is read, in percent; -1 if all is read and the job goes on. */
static int percent(void)
{
	int n = -1;
	assert_true(scripted_list(client));
	const Farm__Envelope *m = scripted_hear(client);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER && m->job_list_answer->n_jobs == 1);
	const Farm__JobStatus *s = m->job_list_answer->jobs[0];
	if (strcmp(s->state, "reading") != 0)
		return -1;
	assert_int_equal(sscanf(s->why, "reading, %d %%", &n), 1);
	return n;
}

static void call_while_it_reads(struct scripted **p, Farm__Role role)
{
	*p = scripted_connect(port);
	assert_non_null(*p);
	const Farm__HelloAck *ack = scripted_hello(*p, FARM_VERSION, role);
	assert_true(ack && ack->accepted);
	assert_non_null(strstr(ack->text, "is reading its jobs, "));
}

static void say_job_get(uint64_t job)
{
	Farm__JobGet get;
	Farm__Envelope m;
	farm__job_get__init(&get);
	farm__envelope__init(&m);
	get.job = job;
	m.body_case = FARM__ENVELOPE__BODY_JOB_GET;
	m.job_get = &get;
	assert_true(scripted_say(worker, &m, NULL, 0));
}

static void say_watch(uint64_t job)
{
	Farm__Watch watch;
	Farm__Envelope m;
	farm__watch__init(&watch);
	farm__envelope__init(&m);
	watch.job = job;
	m.body_case = FARM__ENVELOPE__BODY_WATCH;
	m.watch = &watch;
	assert_true(scripted_say(client, &m, NULL, 0));
}

/* ---- tests ---- */

static int set_up(void **state)
{
	struct error e;
	int rc = folder_set_up(state);
	snprintf(spool, sizeof spool, "%s/spool", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	memset(disk, 0, sizeof *disk);
	journal_most = 1 << 20;
	heartbeat = 60;
	return rc ? rc : plan_make(&scripted_request, &plan, &e);
}

static void answers_while_it_reads(uint64_t job)
{
	int seen = 0, last = 0;
	heartbeat = 2; /* s; not less: on a busy machine this process may be unable to send anything for seconds */
	start(0);
	call_while_it_reads(&client, FARM__ROLE__ROLE_CLIENT);
	call_while_it_reads(&worker, FARM__ROLE__ROLE_WORKER);
	say_job_get(job);
	assert_true(scripted_want(worker, 3));
	assert_int_equal(percent(), 0);
	while (!seen) { /* one piece after the other */
		disk->allowed++;
		while (disk->asked <= disk->allowed)
			usleep(1000);
		assert_true(scripted_say(worker, ENVELOPE(HEARTBEAT, heartbeat), NULL, 0));
		int n = percent();
		assert_true(n >= last && n <= 100);
		seen = n > 0 && n < 100;
		last = n;
	}
	say_watch(job);
	assert_true(scripted_has(client, PATIENCE)); /* a heartbeat: the coordinator is alive, and the answer comes
						      * later */
	disk->allowed = ALL;
	const Farm__Envelope *m = scripted_hear(client);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_STATUS &&
		    strcmp(m->job_status->state, "reading") != 0);
	assert_true(client->heartbeats > 0);
	m = scripted_hear(worker);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_INFO);
	work_until(LEASES); /* no acknowledged result is asked for again */
	end(SIGTERM, true);
}

static void a_journal(void **state)
{
	(void)state;
	answers_while_it_reads(begin_a_job());
}

static void a_checkpoint(void **state)
{
	(void)state;
	journal_most = 2000;
	answers_while_it_reads(begin_a_job());
}

/* The coordinator is told to stop before it has read all jobs, and the next one reads them all. */
static void told_to_stop(void **state)
{
	(void)state;
	begin_a_job();
	start(3);
	while (disk->asked < 4)
		usleep(1000);
	kill(pid, SIGTERM);
	while ((client = scripted_connect(port))) { /* until the coordinator has seen the signal */
		scripted_hang_up(client);
		usleep(10000);
	}
	disk->allowed = 5;
	end(0, true);
	assert_true(disk->asked <= 6);
	start(ALL);
	client = scripted_call(port, FARM__ROLE__ROLE_CLIENT);
	worker = scripted_call(port, FARM__ROLE__ROLE_WORKER);
	assert_true(client && worker && scripted_want(worker, 3));
	work_until(LEASES);
	end(SIGTERM, true);
}

/* A client that sends more requests than may wait gets an error; others are served. */
static void too_much_is_asked(void **state)
{
	(void)state;
	uint64_t job = begin_a_job();
	start(0);
	call_while_it_reads(&worker, FARM__ROLE__ROLE_WORKER);
	int asked = 0;
	while (asked < 1000000 && scripted_want(worker, 3))
		asked++;
	assert_true(asked > 1000 && asked < 1000000);
	call_while_it_reads(&client, FARM__ROLE__ROLE_CLIENT);
	say_watch(job);
	disk->allowed = ALL;
	const Farm__Envelope *m;
	while ((m = scripted_hear(client)) && m->body_case == FARM__ENVELOPE__BODY_HEARTBEAT)
		;
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_STATUS);
	end(SIGTERM, true);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_journal, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(a_checkpoint, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(told_to_stop, set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(too_much_is_asked, set_up, folder_tear_down),
	};
	signal(SIGPIPE, SIG_IGN);
	disk = mmap(NULL, sizeof *disk, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	return disk == MAP_FAILED || cmocka_run_group_tests_name("coordinator/jobs/test_recovery", tests, NULL, NULL);
}
