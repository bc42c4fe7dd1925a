/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A restarted coordinator reads its jobs from a disk that returns one piece at a time, when the test allows it.
 * Meanwhile it accepts peers, reports its progress, answers what it can, and answers the remaining requests in their
 * order once the jobs are there. No acknowledged result is asked for again.
 */
#include "common/base/disk.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/scripted_peer.h"

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
	ALL_PIECES = 1 << 30,
	RESULTS = 20,
	LEASES = 8 + 4 * 8 /* leases of the job */
};

/* Shared with the coordinator, which is another process. */
static struct {
	_Atomic int allowed_pieces, requested_pieces; /* pieces of journals and checkpoints */
} * disk;
static atomic_bool is_film_file[FILES]; /* indexed by descriptor */

static struct plan plan;
static uint64_t max_journal_bytes;
static double heartbeat_seconds; /* s; a peer that is silent for six of them is disconnected */
static pid_t pid;
static uint16_t port;
static char spool[100], port_file[100];
static struct scripted_peer *client, *worker;

/* ---- the coordinator ---- */

static int film_marking_open(const char *path, int flags, mode_t mode)
{
	int fd = disk_system.open(path, flags, mode);
	if (fd >= 0 && fd < FILES)
		is_film_file[fd] = strstr(path, "/journal.") || strstr(path, "/checkpoint");
	return fd;
}

static ssize_t gated_pread(int fd, void *bytes, size_t size, off_t offset)
{
	if (fd < FILES && is_film_file[fd]) {
		int turn = disk->requested_pieces++;
		while (turn >= disk->allowed_pieces)
			usleep(500);
	}
	return disk_system.pread(fd, bytes, size, offset);
}

static void run_server(void)
{
	struct disk disk_functions = disk_system;
	struct server_config c;
	struct error e;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	disk_functions.open = film_marking_open;
	disk_functions.pread = gated_pread;
	disk_set_calls(&disk_functions);
	server_config_init(&c);
	c.listen_address = "127.0.0.1:0";
	c.spool_folder = spool;
	c.port_file = port_file;
	c.max_journal_bytes = max_journal_bytes;
	c.heartbeat_seconds = heartbeat_seconds;
	log_set_level(LOG_LEVEL_ERROR);
	_exit(server_run(&c, &e) ? 1 : 0);
}

static void start_coordinator(int pieces)
{
	disk->allowed_pieces = pieces;
	disk->requested_pieces = 0;
	unlink(port_file);
	fflush(NULL);
	pid = fork();
	if (pid == 0) {
		signal(SIGSEGV, SIG_DFL);
		run_server();
	}
	port = scripted_peer_read_port(port_file);
}

static void stop_coordinator(int signal, bool well)
{
	int status;
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(worker);
	client = worker = NULL;
	kill(pid, signal);
	assert_true(waitpid(pid, &status, 0) == pid);
	assert_true(!well || (WIFEXITED(status) && WEXITSTATUS(status) == 0));
}

/* ---- its peers ---- */

static struct lease_key merged_leases[LEASES];
static size_t merged_count, sent_count;

static bool is_merged(const struct lease_key *k)
{
	for (size_t i = 0; i < merged_count; i++)
		if (merged_leases[i].kind == k->kind && merged_leases[i].group == k->group &&
		    merged_leases[i].part == k->part && merged_leases[i].epoch == k->epoch)
			return true;
	return false;
}

/* Sends results until there are `results` in all, and each of them is acknowledged, once. */
static void work_until(size_t results)
{
	while (merged_count < results) {
		struct error e;
		struct lease_key k;
		const Farm__Envelope *m = scripted_peer_receive(worker);
		assert_non_null(m);
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK) {
			assert_int_equal(m->lease_ack->verdict, FARM__VERDICT__VERDICT_MERGED);
			assert_int_equal(lease_key_from_wire(m->lease_ack->key, &k, &e), 0);
			assert_false(is_merged(&k));
			merged_leases[merged_count++] = k;
		}
		if (m->body_case != FARM__ENVELOPE__BODY_LEASE_GRANT || sent_count == results)
			continue;
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &k, &e), 0);
		assert_false(is_merged(&k));
		struct batch b = scripted_peer_make_batch(&k, &plan, STATE_BYTES);
		assert_true(scripted_peer_send_batch(worker, &b, &plan));
		batch_fini(&b);
		sent_count++;
	}
}

/* Submits a job, has part of it computed, and stops the coordinator. */
static uint64_t make_partial_job(void)
{
	merged_count = sent_count = 0;
	start_coordinator(ALL_PIECES);
	client = scripted_peer_connect_as(port, FARM__ROLE__ROLE_CLIENT);
	worker = scripted_peer_connect_as(port, FARM__ROLE__ROLE_WORKER);
	assert_true(client && worker && scripted_peer_request_leases(worker, 3));
	uint64_t job = scripted_peer_submit_with_scene(client, &scripted_peer_plan_request, "<scene/>");
	work_until(RESULTS);
	stop_coordinator(SIGKILL, false);
	return job;
}

/* Returns the part of the only job that is read, in percent; -1 if all is read and the job goes on. */
static int read_percent(void)
{
	int n = -1;
	assert_true(scripted_peer_request_job_list(client));
	const Farm__Envelope *m = scripted_peer_receive(client);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER && m->job_list_answer->n_jobs == 1);
	const Farm__JobStatus *s = m->job_list_answer->jobs[0];
	if (strcmp(s->state, "reading") != 0)
		return -1;
	assert_int_equal(sscanf(s->why, "reading, %d %%", &n), 1);
	return n;
}

static void connect_while_reading(struct scripted_peer **p, Farm__Role role)
{
	*p = scripted_peer_connect(port);
	assert_non_null(*p);
	const Farm__HelloAck *ack = scripted_peer_exchange_hello(*p, FARM_VERSION, role);
	assert_true(ack && ack->accepted);
	assert_non_null(strstr(ack->text, "is reading its jobs, "));
}

static void request_job(uint64_t job)
{
	Farm__JobGet get;
	Farm__Envelope m;
	farm__job_get__init(&get);
	farm__envelope__init(&m);
	get.job = job;
	m.body_case = FARM__ENVELOPE__BODY_JOB_GET;
	m.job_get = &get;
	assert_true(scripted_peer_send(worker, &m, NULL, 0));
}

static void send_watch(uint64_t job)
{
	Farm__Watch watch;
	Farm__Envelope m;
	farm__watch__init(&watch);
	farm__envelope__init(&m);
	watch.job = job;
	m.body_case = FARM__ENVELOPE__BODY_WATCH;
	m.watch = &watch;
	assert_true(scripted_peer_send(client, &m, NULL, 0));
}

/* ---- tests ---- */

static int set_up(void **state)
{
	struct error e;
	int rc = temporary_folder_set_up(state);
	snprintf(spool, sizeof spool, "%s/spool", temporary_folder);
	snprintf(port_file, sizeof port_file, "%s/port", temporary_folder);
	memset(disk, 0, sizeof *disk);
	max_journal_bytes = 1 << 20;
	heartbeat_seconds = 60;
	return rc ? rc : plan_make(&scripted_peer_plan_request, &plan, &e);
}

static void check_answers_while_reading(uint64_t job)
{
	int seen_midway = 0, last = 0;
	/* s; not less: on a busy machine this process may be unable to send anything for seconds. */
	heartbeat_seconds = 2;
	start_coordinator(0);
	connect_while_reading(&client, FARM__ROLE__ROLE_CLIENT);
	connect_while_reading(&worker, FARM__ROLE__ROLE_WORKER);
	request_job(job);
	assert_true(scripted_peer_request_leases(worker, 3));
	assert_int_equal(read_percent(), 0);
	while (!seen_midway) { /* one piece after the other */
		disk->allowed_pieces++;
		while (disk->requested_pieces <= disk->allowed_pieces)
			usleep(1000);
		assert_true(scripted_peer_send(worker, ENVELOPE(HEARTBEAT, heartbeat), NULL, 0));
		int n = read_percent();
		assert_true(n >= last && n <= 100);
		seen_midway = n > 0 && n < 100;
		last = n;
	}
	send_watch(job);
	assert_true(scripted_peer_is_readable(client, PATIENCE)); /* a heartbeat: the coordinator is alive, and the
								   * answer comes later */
	disk->allowed_pieces = ALL_PIECES;
	const Farm__Envelope *m = scripted_peer_receive(client);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_STATUS &&
		    strcmp(m->job_status->state, "reading") != 0);
	assert_true(client->heartbeats > 0);
	m = scripted_peer_receive(worker);
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_INFO);
	work_until(LEASES); /* no acknowledged result is asked for again */
	stop_coordinator(SIGTERM, true);
}

static void peers_are_answered_while_a_journal_is_read(void **state)
{
	(void)state;
	check_answers_while_reading(make_partial_job());
}

static void peers_are_answered_while_a_checkpoint_is_read(void **state)
{
	(void)state;
	max_journal_bytes = 2000;
	check_answers_while_reading(make_partial_job());
}

/* The coordinator is told to stop before it has read all jobs, and the next one reads them all. */
static void stop_while_reading_loses_nothing(void **state)
{
	(void)state;
	make_partial_job();
	start_coordinator(3);
	while (disk->requested_pieces < 4)
		usleep(1000);
	kill(pid, SIGTERM);
	while ((client = scripted_peer_connect(port))) { /* until the coordinator has seen the signal */
		scripted_peer_disconnect(client);
		usleep(10000);
	}
	disk->allowed_pieces = 5;
	stop_coordinator(0, true);
	assert_true(disk->requested_pieces <= 6);
	start_coordinator(ALL_PIECES);
	client = scripted_peer_connect_as(port, FARM__ROLE__ROLE_CLIENT);
	worker = scripted_peer_connect_as(port, FARM__ROLE__ROLE_WORKER);
	assert_true(client && worker && scripted_peer_request_leases(worker, 3));
	work_until(LEASES);
	stop_coordinator(SIGTERM, true);
}

/* A client that sends more requests than may wait gets an error; others are served. */
static void too_many_waiting_requests_are_an_error(void **state)
{
	(void)state;
	uint64_t job = make_partial_job();
	start_coordinator(0);
	connect_while_reading(&worker, FARM__ROLE__ROLE_WORKER);
	int request_count = 0;
	while (request_count < 1000000 && scripted_peer_request_leases(worker, 3))
		request_count++;
	assert_true(request_count > 1000 && request_count < 1000000);
	connect_while_reading(&client, FARM__ROLE__ROLE_CLIENT);
	send_watch(job);
	disk->allowed_pieces = ALL_PIECES;
	const Farm__Envelope *m;
	while ((m = scripted_peer_receive(client)) && m->body_case == FARM__ENVELOPE__BODY_HEARTBEAT)
		;
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_JOB_STATUS);
	stop_coordinator(SIGTERM, true);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(peers_are_answered_while_a_journal_is_read, set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(peers_are_answered_while_a_checkpoint_is_read, set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(stop_while_reading_loses_nothing, set_up, temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(too_many_waiting_requests_are_an_error, set_up,
						temporary_folder_tear_down),
	};
	signal(SIGPIPE, SIG_IGN);
	disk = mmap(NULL, sizeof *disk, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	return disk == MAP_FAILED || cmocka_run_group_tests_name("coordinator/jobs/test_recovery", tests, NULL, NULL);
}
