/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The server for tests of peers (child_server.h): a child process with its own spool, and a timer in it that carries
 * out the test's requests. The parent waits for its port; at the end it asks the child to stop and checks its exit
 * code, so that leaks and sanitizer errors in the child fail the test.
 */
#include "tests/support/child_server.h"

#include "common/base/mem.h"
#include "coordinator/jobs/step.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"
#include "tests/support/checksummed_frame.h"
#include "tests/support/failing_memory.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <poll.h>
#include <dirent.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

enum { POLLS_MAX = 6000, POLL_US = 10000 }; /* a minute */

static char server_folder[64];
static pid_t server_pid;
static uint16_t server_port;
static void (*make_spool)(const char *path);
static struct {
	_Atomic unsigned count, max_batches;
} * loop_turns; /* turns of its loop, shared with the child */

/* While the folder contains a file `is_busy`, access to the films of jobs is forbidden. */
static void on_poll(uv_timer_t *t)
{
	static bool is_held;
	struct server *s = t->data;
	char path[96];
	snprintf(path, sizeof path, "%s/busy", server_folder);
	bool is_wanted = access(path, F_OK) == 0;
	snprintf(path, sizeof path, "%s/nomem", server_folder);
	if (remove(path) == 0)
		mem_fail_after(1); /* the caller's session is allocated, but its connection is not */
	if (is_held == is_wanted)
		return;
	is_held = is_wanted;
	snprintf(path, sizeof path, "%s/held", server_folder);
	for (struct live_job *job = s->jobs.live_jobs; job; job = job->next)
		job->is_busy = is_wanted;
	if (!is_wanted)
		jobs_notify_films_free(&s->jobs);
	if (is_wanted && fclose(fopen(path, "w")))
		abort();
	if (!is_wanted && remove(path))
		abort();
}

static void on_turn(uv_prepare_t *h)
{
	static unsigned previous_count;
	struct server *s = h->data;
	unsigned current_count = 0;
	const struct waiting_message *w;
	for (struct live_job *job = s->jobs.live_jobs; job; job = job->next)
		STAILQ_FOREACH(w, &job->waiting_messages, next)
			current_count++;
	if (previous_count > current_count && previous_count - current_count > loop_turns->max_batches)
		loop_turns->max_batches = previous_count - current_count;
	previous_count = current_count;
	loop_turns->count++;
}

static int run_server(const struct server_config *c)
{
	struct server *s;
	struct error e;
	uv_timer_t poll_timer;
	uv_prepare_t turn_handle;
	if (server_open(&s, c, &e))
		return 1;
	poll_timer.data = s;
	uv_timer_init(&s->loop, &poll_timer);
	uv_timer_start(&poll_timer, on_poll, 5, 5);
	uv_unref((uv_handle_t *)&poll_timer);
	turn_handle.data = s;
	uv_prepare_init(&s->loop, &turn_handle);
	uv_prepare_start(&turn_handle, on_turn);
	uv_unref((uv_handle_t *)&turn_handle);
	uv_run(&s->loop, UV_RUN_DEFAULT);
	uv_close((uv_handle_t *)&poll_timer, NULL);
	uv_close((uv_handle_t *)&turn_handle, NULL);
	server_close(s);
	return 0;
}

unsigned child_server_turn_count(void)
{
	return loop_turns->count;
}

unsigned child_server_max_batches_per_turn(void)
{
	return atomic_exchange(&loop_turns->max_batches, 0);
}

const char *child_server_folder(void)
{
	return server_folder;
}

void child_server_set_busy(bool busy)
{
	char path[96], held[96];
	snprintf(path, sizeof path, "%s/busy", server_folder);
	snprintf(held, sizeof held, "%s/held", server_folder);
	assert_int_equal(busy ? fclose(fopen(path, "w")) : remove(path), 0);
	for (int i = 0; i < POLLS_MAX && (access(held, F_OK) == 0) != busy; i++)
		usleep(POLL_US);
	assert_true((access(held, F_OK) == 0) == busy);
}

void child_server_set_spool_maker(void (*spool)(const char *path))
{
	make_spool = spool;
}

int child_server_start(double hello_seconds, double heartbeat_seconds, double stall_seconds)
{
	char spool[96], port_file[96], status[96];
	strcpy(server_folder, "/tmp/hslt-peers.XXXXXX");
	if (!mkdtemp(server_folder))
		return -1;
	snprintf(spool, sizeof spool, "%s/spool", server_folder);
	snprintf(port_file, sizeof port_file, "%s/port", server_folder);
	snprintf(status, sizeof status, "%s/status", server_folder);
	if (make_spool)
		make_spool(spool);
	loop_turns = mmap(NULL, sizeof *loop_turns, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (loop_turns == MAP_FAILED)
		return -1;
	fflush(NULL);
	server_pid = fork();
	if (server_pid == 0) {
		struct server_config c;
		server_config_init(&c);
		c.listen_address = "127.0.0.1:0";
		c.spool_folder = spool;
		c.port_file = port_file;
		c.status_socket = status;
		c.max_connections = 8;
		c.max_state_bytes = c.max_send_bytes = 1 << 24;
		c.max_blob_bytes = 1 << 20;
		c.max_fetches = 2;
		c.hello_seconds = hello_seconds;
		c.heartbeat_seconds = heartbeat_seconds;
		c.stall_seconds = stall_seconds;
		log_set_level(LOG_LEVEL_ERROR);
		_exit(run_server(&c));
	}
	server_port = scripted_peer_read_port(port_file);
	return server_port ? 0 : -1;
}

int child_server_stop(void **state)
{
	(void)state;
	char command[96];
	int status = -1;
	kill(server_pid, SIGTERM);
	waitpid(server_pid, &status, 0);
	snprintf(command, sizeof command, "rm -rf '%s'", server_folder);
	munmap(loop_turns, sizeof *loop_turns);
	return system(command) || !WIFEXITED(status) || WEXITSTATUS(status);
}

long child_server_resident_kilobytes(void)
{
	char path[64], line[256];
	long kilobytes = -1;
	snprintf(path, sizeof path, "/proc/%d/status", (int)server_pid);
	FILE *f = fopen(path, "r");
	assert_non_null(f);
	while (fgets(line, sizeof line, f))
		if (sscanf(line, "VmRSS: %ld", &kilobytes) == 1)
			break;
	fclose(f);
	return kilobytes;
}

unsigned child_server_open_file_count(const char *name)
{
	char path[300], target[300];
	unsigned count = 0;
	snprintf(path, sizeof path, "/proc/%d/fd", (int)server_pid);
	DIR *all = opendir(path);
	assert_non_null(all);
	for (const struct dirent *d; (d = readdir(all));) {
		snprintf(path, sizeof path, "/proc/%d/fd/%.20s", (int)server_pid, d->d_name);
		ssize_t n = readlink(path, target, sizeof target - 1);
		target[n > 0 ? n : 0] = 0;
		count += strstr(target, name) != NULL;
	}
	closedir(all);
	return count;
}

/* ---- a peer of our own ---- */

struct scripted_peer *child_server_connect(void)
{
	struct scripted_peer *p = scripted_peer_connect(server_port);
	assert_non_null(p);
	return p;
}

void child_server_send_bytes(const struct scripted_peer *p, const void *bytes, size_t size)
{
	assert_int_equal(send(p->fd, bytes, size, MSG_NOSIGNAL), size);
}

void child_server_send(const struct scripted_peer *p, const Farm__Envelope *m, const void *payload, size_t payload_size)
{
	assert_true(scripted_peer_send(p, m, payload, payload_size));
}

const Farm__HelloAck *child_server_exchange_hello(struct scripted_peer *p, uint32_t version, Farm__Role role)
{
	const Farm__HelloAck *ack = scripted_peer_exchange_hello(p, version, role);
	assert_non_null(ack);
	return ack;
}

void child_server_send_empty(struct scripted_peer *p, Farm__Envelope__BodyCase kind)
{
	Farm__Envelope m;
	Farm__JobList list;
	Farm__LeaseRequest request;
	farm__envelope__init(&m);
	farm__job_list__init(&list);
	farm__lease_request__init(&request);
	request.want = 2;
	m.body_case = kind;
	if (kind == FARM__ENVELOPE__BODY_JOB_LIST)
		m.job_list = &list;
	else
		m.lease_request = &request;
	child_server_send(p, &m, NULL, 0);
}

void child_server_send_job_get(const struct scripted_peer *p, uint64_t job)
{
	Farm__Envelope m;
	Farm__JobGet get;
	farm__envelope__init(&m);
	farm__job_get__init(&get);
	get.job = job;
	m.body_case = FARM__ENVELOPE__BODY_JOB_GET;
	m.job_get = &get;
	child_server_send(p, &m, NULL, 0);
}

static bool is_answering(void)
{
	struct scripted_peer *p = child_server_connect();
	const Farm__HelloAck *ack = scripted_peer_exchange_hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT);
	const Farm__Envelope *answer = NULL;
	if (ack && ack->accepted) {
		child_server_send_empty(p, FARM__ENVELOPE__BODY_JOB_LIST);
		answer = scripted_peer_receive(p);
	}
	bool is_list = answer && answer->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER;
	scripted_peer_disconnect(p);
	return is_list;
}

void child_server_check_answers(void)
{
	assert_true(is_answering());
}

void child_server_await_answers(void)
{
	for (int i = 0; i < POLLS_MAX; i++) {
		if (is_answering())
			return;
		usleep(POLL_US);
	}
	fail_msg("it lets nobody in");
}

/* ---- jobs ---- */

struct plan_request child_server_plan_request(const char *mixture)
{
	struct plan_request r = {.integrator = "pssmlt",
				 .kind = PLAN_CHAINS,
				 .width = 20,
				 .height = 10,
				 .spp = 4,
				 .max_depth = 5,
				 .groups = 2,
				 .bootstrap = 256};
	if (mixture)
		snprintf(r.mixture, sizeof r.mixture, "%s", mixture);
	return r;
}

void child_server_submit(struct scripted_peer *p, const char *mixture, const char *scene_text, const char *file_name,
			 const char *scene_name)
{
	Farm__Submit s;
	Farm__PlanRequest plan;
	Farm__File file, *files[1] = {&file};
	Farm__Envelope m;
	struct blob_hash hash;
	struct error e;
	char name[] = "black", scene[64], file_text[64];
	struct plan_request r = child_server_plan_request(mixture);
	plan_request_to_wire(&r, &plan);
	farm__submit__init(&s);
	farm__file__init(&file);
	farm__envelope__init(&m);
	assert_int_equal(blob_hash_bytes(scene_text, strlen(scene_text), &hash, &e), 0);
	snprintf(file_text, sizeof file_text, "%s", file_name);
	snprintf(scene, sizeof scene, "%s", scene_name);
	file.name = file_text;
	file.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hash.bytes};
	file.size = strlen(scene_text);
	s.name = name;
	s.scene = scene;
	s.plan = &plan;
	s.n_files = 1;
	s.files = files;
	m.body_case = FARM__ENVELOPE__BODY_SUBMIT;
	m.submit = &s;
	child_server_send(p, &m, NULL, 0);
}

void child_server_send_blob(struct scripted_peer *p, const char *true_text, const char *sent_text)
{
	Farm__BlobChunk c;
	Farm__Envelope m;
	struct blob_hash hash;
	struct error e;
	assert_int_equal(blob_hash_bytes(true_text, strlen(true_text), &hash, &e), 0);
	farm__blob_chunk__init(&c);
	farm__envelope__init(&m);
	c.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hash.bytes};
	c.size = strlen(true_text);
	m.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
	m.blob_chunk = &c;
	child_server_send(p, &m, sent_text, strlen(sent_text));
}

const Farm__SubmitAnswer *child_server_receive_submit_answer(struct scripted_peer *p)
{
	const Farm__Envelope *m = scripted_peer_receive(p);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_SUBMIT_ANSWER);
	return m->submit_answer;
}

void child_server_send_batch(struct scripted_peer *p, const struct batch *b, const struct plan *plan)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	assert_int_equal(batch_pack(b, plan, &frame, &size, &e), 0);
	unsigned char *bytes = checksummed_frame(frame, size, &size);
	child_server_send_bytes(p, bytes, size);
	free(bytes);
	mem_free(frame);
}

Farm__Verdict child_server_handle_message(struct scripted_peer *p, struct pending_leases *pending)
{
	struct error e;
	const Farm__Envelope *m = scripted_peer_receive(p);
	assert_non_null(m);
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK)
		return m->lease_ack->verdict;
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_GRANT) {
		assert_true(pending->count < 64);
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &pending->keys[pending->count++], &e), 0);
	}
	pending->job_ended = pending->job_ended || m->body_case == FARM__ENVELOPE__BODY_JOB_END;
	return FARM__VERDICT__VERDICT_NONE;
}

Farm__Verdict child_server_await_verdict(struct scripted_peer *p, struct pending_leases *pending)
{
	Farm__Verdict v;
	while ((v = child_server_handle_message(p, pending)) == FARM__VERDICT__VERDICT_NONE)
		continue;
	return v;
}
