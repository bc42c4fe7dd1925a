/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The server for tests of peers (served.h): a child process with its own spool, and a timer in it that carries out the
 * test's requests. The parent waits for its port; at the end it asks the child to stop and checks its exit code, so
 * that leaks and sanitizer errors in the child fail the test.
 */
#include "tests/support/served.h"

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

enum { LOOKS = 6000, LOOK_US = 10000 }; /* a minute */

static char folder[64];
static pid_t server;
static uint16_t port;
static void (*prepare)(const char *path);
static struct {
	_Atomic unsigned count, at_once;
} * turns; /* turns of its loop, shared with the child */

/* While the folder contains a file `busy`, access to the films of jobs is forbidden. */
static void on_look(uv_timer_t *t)
{
	static bool held;
	struct server *s = t->data;
	char path[96];
	snprintf(path, sizeof path, "%s/busy", folder);
	bool wanted = access(path, F_OK) == 0;
	snprintf(path, sizeof path, "%s/nomem", folder);
	if (remove(path) == 0)
		mem_fail_after(1); /* the caller's session is allocated, but its connection is not */
	if (held == wanted)
		return;
	held = wanted;
	snprintf(path, sizeof path, "%s/held", folder);
	for (struct live_job *job = s->jobs.live; job; job = job->next)
		job->busy = wanted;
	if (!wanted)
		jobs_films_free(&s->jobs);
	if (wanted && fclose(fopen(path, "w")))
		abort();
	if (!wanted && remove(path))
		abort();
}

static void on_turn(uv_prepare_t *h)
{
	static unsigned before;
	struct server *s = h->data;
	unsigned now = 0;
	const struct waiting_batch *w;
	for (struct live_job *job = s->jobs.live; job; job = job->next)
		STAILQ_FOREACH(w, &job->waiting, next)
			now++;
	if (before > now && before - now > turns->at_once)
		turns->at_once = before - now;
	before = now;
	turns->count++;
}

static int serve(const struct server_config *c)
{
	struct server *s;
	struct error e;
	uv_timer_t look;
	uv_prepare_t turn;
	if (server_open(&s, c, &e))
		return 1;
	look.data = s;
	uv_timer_init(&s->loop, &look);
	uv_timer_start(&look, on_look, 5, 5);
	uv_unref((uv_handle_t *)&look);
	turn.data = s;
	uv_prepare_init(&s->loop, &turn);
	uv_prepare_start(&turn, on_turn);
	uv_unref((uv_handle_t *)&turn);
	uv_run(&s->loop, UV_RUN_DEFAULT);
	uv_close((uv_handle_t *)&look, NULL);
	uv_close((uv_handle_t *)&turn, NULL);
	server_close(s);
	return 0;
}

unsigned served_turn(void)
{
	return turns->count;
}

unsigned served_at_once(void)
{
	return atomic_exchange(&turns->at_once, 0);
}

const char *served_folder(void)
{
	return folder;
}

void served_set_busy(bool busy)
{
	char path[96], held[96];
	snprintf(path, sizeof path, "%s/busy", folder);
	snprintf(held, sizeof held, "%s/held", folder);
	assert_int_equal(busy ? fclose(fopen(path, "w")) : remove(path), 0);
	for (int i = 0; i < LOOKS && (access(held, F_OK) == 0) != busy; i++)
		usleep(LOOK_US);
	assert_true((access(held, F_OK) == 0) == busy);
}

void served_prepare(void (*spool)(const char *path))
{
	prepare = spool;
}

int served_start(double hello_seconds, double heartbeat_seconds, double stall_seconds)
{
	char spool[96], port_file[96], status[96];
	strcpy(folder, "/tmp/hslt-peers.XXXXXX");
	if (!mkdtemp(folder))
		return -1;
	snprintf(spool, sizeof spool, "%s/spool", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	snprintf(status, sizeof status, "%s/status", folder);
	if (prepare)
		prepare(spool);
	turns = mmap(NULL, sizeof *turns, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (turns == MAP_FAILED)
		return -1;
	fflush(NULL);
	server = fork();
	if (server == 0) {
		struct server_config c;
		server_config_init(&c);
		c.listen = "127.0.0.1:0";
		c.spool = spool;
		c.port_file = port_file;
		c.status_socket = status;
		c.max_connections = 8;
		c.state_bytes = c.send_bytes = 1 << 24;
		c.blob_bytes = 1 << 20;
		c.max_fetches = 2;
		c.hello_seconds = hello_seconds;
		c.heartbeat_seconds = heartbeat_seconds;
		c.stall_seconds = stall_seconds;
		log_set_level(LOG_LEVEL_ERROR);
		_exit(serve(&c));
	}
	port = scripted_port(port_file);
	return port ? 0 : -1;
}

int served_stop(void **state)
{
	(void)state;
	char command[96];
	int status = -1;
	kill(server, SIGTERM);
	waitpid(server, &status, 0);
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	munmap(turns, sizeof *turns);
	return system(command) || !WIFEXITED(status) || WEXITSTATUS(status);
}

long served_kilobytes(void)
{
	char path[64], line[256];
	long kilobytes = -1;
	snprintf(path, sizeof path, "/proc/%d/status", (int)server);
	FILE *f = fopen(path, "r");
	assert_non_null(f);
	while (fgets(line, sizeof line, f))
		if (sscanf(line, "VmRSS: %ld", &kilobytes) == 1)
			break;
	fclose(f);
	return kilobytes;
}

unsigned served_open_files(const char *name)
{
	char path[300], target[300];
	unsigned count = 0;
	snprintf(path, sizeof path, "/proc/%d/fd", (int)server);
	DIR *all = opendir(path);
	assert_non_null(all);
	for (const struct dirent *d; (d = readdir(all));) {
		snprintf(path, sizeof path, "/proc/%d/fd/%.20s", (int)server, d->d_name);
		ssize_t n = readlink(path, target, sizeof target - 1);
		target[n > 0 ? n : 0] = 0;
		count += strstr(target, name) != NULL;
	}
	closedir(all);
	return count;
}

/* ---- a peer of our own ---- */

struct scripted *peer_call(void)
{
	struct scripted *p = scripted_connect(port);
	assert_non_null(p);
	return p;
}

void peer_say_bytes(const struct scripted *p, const void *bytes, size_t size)
{
	assert_int_equal(send(p->fd, bytes, size, MSG_NOSIGNAL), size);
}

void peer_say(const struct scripted *p, const Farm__Envelope *m, const void *payload, size_t payload_size)
{
	assert_true(scripted_say(p, m, payload, payload_size));
}

const Farm__HelloAck *peer_hello(struct scripted *p, uint32_t version, Farm__Role role)
{
	const Farm__HelloAck *ack = scripted_hello(p, version, role);
	assert_non_null(ack);
	return ack;
}

void peer_say_empty(struct scripted *p, Farm__Envelope__BodyCase what)
{
	Farm__Envelope m;
	Farm__JobList list;
	Farm__LeaseRequest request;
	farm__envelope__init(&m);
	farm__job_list__init(&list);
	farm__lease_request__init(&request);
	request.want = 2;
	m.body_case = what;
	if (what == FARM__ENVELOPE__BODY_JOB_LIST)
		m.job_list = &list;
	else
		m.lease_request = &request;
	peer_say(p, &m, NULL, 0);
}

void peer_say_job_get(const struct scripted *p, uint64_t job)
{
	Farm__Envelope m;
	Farm__JobGet get;
	farm__envelope__init(&m);
	farm__job_get__init(&get);
	get.job = job;
	m.body_case = FARM__ENVELOPE__BODY_JOB_GET;
	m.job_get = &get;
	peer_say(p, &m, NULL, 0);
}

static bool is_answering(void)
{
	struct scripted *p = peer_call();
	const Farm__HelloAck *ack = scripted_hello(p, FARM_VERSION, FARM__ROLE__ROLE_CLIENT);
	const Farm__Envelope *answer = NULL;
	if (ack && ack->accepted) {
		peer_say_empty(p, FARM__ENVELOPE__BODY_JOB_LIST);
		answer = scripted_hear(p);
	}
	bool is_list = answer && answer->body_case == FARM__ENVELOPE__BODY_JOB_LIST_ANSWER;
	scripted_hang_up(p);
	return is_list;
}

void served_still_works(void)
{
	assert_true(is_answering());
}

void served_works_again(void)
{
	for (int i = 0; i < LOOKS; i++) {
		if (is_answering())
			return;
		usleep(LOOK_US);
	}
	fail_msg("it lets nobody in");
}

/* ---- jobs ---- */

struct plan_request peer_plan_request(const char *mixture)
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

void peer_submit(struct scripted *p, const char *mixture, const char *scene_text, const char *file_name,
		 const char *scene_name)
{
	Farm__Submit s;
	Farm__PlanRequest plan;
	Farm__File file, *files[1] = {&file};
	Farm__Envelope m;
	struct blob_hash hash;
	struct error e;
	char name[] = "black", scene[64], file_text[64];
	struct plan_request r = peer_plan_request(mixture);
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
	peer_say(p, &m, NULL, 0);
}

void peer_send_blob(struct scripted *p, const char *true_text, const char *sent_text)
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
	peer_say(p, &m, sent_text, strlen(sent_text));
}

const Farm__SubmitAnswer *peer_submit_answer(struct scripted *p)
{
	const Farm__Envelope *m = scripted_hear(p);
	assert_non_null(m);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_SUBMIT_ANSWER);
	return m->submit_answer;
}

void peer_send_batch(struct scripted *p, const struct batch *b, const struct plan *plan)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	assert_int_equal(batch_pack(b, plan, &frame, &size, &e), 0);
	unsigned char *bytes = checksummed_frame(frame, size, &size);
	peer_say_bytes(p, bytes, size);
	free(bytes);
	mem_free(frame);
}

Farm__Verdict peer_attend(struct scripted *p, struct lease_queue *d)
{
	struct error e;
	const Farm__Envelope *m = scripted_hear(p);
	assert_non_null(m);
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK)
		return m->lease_ack->verdict;
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_GRANT) {
		assert_true(d->count < 64);
		assert_int_equal(lease_key_from_wire(m->lease_grant->key, &d->keys[d->count++], &e), 0);
	}
	d->job_ended = d->job_ended || m->body_case == FARM__ENVELOPE__BODY_JOB_END;
	return FARM__VERDICT__VERDICT_NONE;
}

Farm__Verdict peer_verdict(struct scripted *p, struct lease_queue *d)
{
	Farm__Verdict v;
	while ((v = peer_attend(p, d)) == FARM__VERDICT__VERDICT_NONE)
		continue;
	return v;
}
