/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A live worker against a coordinator that sends arbitrary messages. Its thread pool is replaced by one that works only
 * when told to, and on small leases only, since a coordinator may ask for long work. Everything that was fetched is
 * forgotten after each input, except for the cache.
 */
#include "common/base/log.h"
#include "common/base/mem.h"
#include "tests/fuzz/farm_world.h"
#include "tests/fuzz/folders.h"
#include "tests/fuzz/messages.h"
#include "tests/fuzz/seeds.h"
#include "tests/support/checksummed_frame.h"
#include "worker/daemon/agent.h"
#include "worker/daemon/fetch.h"
#include "worker/daemon/lease_queue.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum speaker { COORDINATOR, POOL, NETWORK, SIGNAL, SPEAKERS };
enum { WORK_MAX = 3000, PIXELS_MAX = 10000 };

/* ---- the thread pool ---- */

struct thread_pool {
	struct task *first;
	unsigned pending;
};

int thread_pool_new(struct thread_pool **c, uv_loop_t *loop, unsigned threads, struct error *e)
{
	(void)loop;
	(void)threads;
	*c = mem_alloc(1, sizeof **c);
	return *c ? 0 : error_set(e, ENOMEM, "no memory for a thread pool");
}

void thread_pool_add(struct thread_pool *c, struct task *t)
{
	struct task **at = &c->first;
	while (*at)
		at = &(*at)->next;
	*at = t;
	t->next = NULL;
	c->pending++;
}

bool thread_pool_remove(struct thread_pool *c, struct task *t)
{
	for (struct task **at = &c->first; *at; at = &(*at)->next)
		if (*at == t) {
			*at = t->next;
			c->pending--;
			return true;
		}
	return false;
}

unsigned thread_pool_pending(const struct thread_pool *c)
{
	return c->pending;
}

void thread_pool_close(struct thread_pool *c)
{
	mem_free(c);
}

/* ---- the worker ---- */

static struct {
	struct agent *agent;
	int listener, fd;
	char address[32], cache[96];
} worker_state = {.fd = -1};

static void start_listening(void)
{
	struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
	socklen_t size = sizeof a;
	worker_state.listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	if (bind(worker_state.listener, (struct sockaddr *)&a, size) || listen(worker_state.listener, 8) ||
	    getsockname(worker_state.listener, (struct sockaddr *)&a, &size))
		abort();
	snprintf(worker_state.address, sizeof worker_state.address, "127.0.0.1:%u", ntohs(a.sin_port));
	snprintf(worker_state.cache, sizeof worker_state.cache, "%s/cache", folders_base());
	log_set_level(getenv("HSLT_FUZZ_LOG") ? LOG_LEVEL_DEBUG : LOG_LEVEL_ERROR);
}

static void start_worker(void)
{
	struct agent_config c = {.coordinator_address = worker_state.address,
				 .name = "w",
				 .cache_folder = worker_state.cache,
				 .max_cache_bytes = 1 << 22,
				 .threads = 1};
	struct error e;
	if (!worker_state.listener)
		start_listening();
	if (agent_open(&worker_state.agent, &c, &e)) {
		fprintf(stderr, "%s\n", e.text);
		abort();
	}
}

static void run_loop(void)
{
	uv_run(&worker_state.agent->loop, UV_RUN_NOWAIT);
}

static void drain_socket(void)
{
	char bytes[1 << 15];
	ssize_t n = 1;
	while (worker_state.fd >= 0 && n > 0)
		n = recv(worker_state.fd, bytes, sizeof bytes, MSG_DONTWAIT);
}

static void send_bytes(const void *bytes, size_t size)
{
	const char *at = bytes;
	while (worker_state.fd >= 0 && size && worker_state.agent->conn) {
		ssize_t n = send(worker_state.fd, at, size, MSG_NOSIGNAL | MSG_DONTWAIT);
		if (n < 0 && errno != EAGAIN)
			return;
		at += n > 0 ? n : 0;
		size -= n > 0 ? (size_t)n : 0;
		run_loop();
	}
}

static void send_hello_ack(void)
{
	Farm__HelloAck ack;
	Farm__Envelope m;
	unsigned char *frame;
	size_t size;
	struct error e;
	farm__hello_ack__init(&ack);
	farm__envelope__init(&m);
	ack.accepted = true;
	ack.version = FARM_VERSION;
	ack.heartbeat_ms = 100000;
	m.body_case = FARM__ENVELOPE__BODY_HELLO_ACK;
	m.hello_ack = &ack;
	if (envelope_pack(&m, NULL, 0, &frame, &size, &e) == 0) {
		send_bytes(frame, size);
		mem_free(frame);
	}
}

static void disconnect(void)
{
	struct linger reset = {1, 0};
	if (worker_state.fd >= 0) {
		setsockopt(worker_state.fd, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
		close(worker_state.fd);
	}
	worker_state.fd = -1;
	for (int i = 0; worker_state.agent->conn && i < 1000; i++)
		run_loop();
}

/* A real worker waits before it calls again; this one does not. */
static void accept_worker(void)
{
	struct agent *a = worker_state.agent;
	for (int i = 0; i < 1000 && worker_state.fd < 0 && !a->has_left; i++) {
		if (!a->conn && !a->is_resolving)
			uv_timer_start(&a->retry_timer, a->retry_timer.timer_cb, 0, 0);
		if (a->is_resolving)
			uv_run(&a->loop, UV_RUN_ONCE);
		run_loop();
		worker_state.fd = accept4(worker_state.listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
	}
	setsockopt(worker_state.fd, IPPROTO_TCP, TCP_NODELAY, &(int){1}, sizeof(int));
	run_loop();
	send_hello_ack();
}

/* ---- steps ---- */

static bool is_small(const struct plan *p)
{
	uint64_t pixels = (uint64_t)p->width * p->height;
	return pixels <= PIXELS_MAX && p->border < 16 && p->bootstrap / (p->groups * p->parts) <= WORK_MAX &&
	       p->epoch <= WORK_MAX &&
	       (p->kind == PLAN_CHAINS ? p->chains / (p->groups * p->parts) * p->epoch : pixels * p->epoch) <=
		       WORK_MAX &&
	       p->max_depth <= 16;
}

static bool is_building(const struct task *t)
{
	for (const struct job_cache *b = worker_state.agent->job_caches; b; b = b->next)
		if (&b->task == t)
			return true;
	return false;
}

/* Runs a task and returns it, as a thread of the pool does. */
static void run_next_task(void)
{
	struct thread_pool *c = worker_state.agent->thread_pool;
	struct task *t = c->first;
	if (!t)
		return;
	c->first = t->next;
	if (is_building(t)) {
		if (is_small(&((struct job_cache *)t)->plan))
			t->run(t);
		else
			((struct job_cache *)t)->state = JOB_CACHE_FAILED;
	} else {
		struct lease_task *l = (struct lease_task *)t;
		atomic_store(&l->stop_requested, !is_small(&l->job_cache->plan));
		t->run(t);
	}
	c->pending--;
	t->on_done(t);
}

static void run_step(const struct step *s)
{
	unsigned char *bytes;
	size_t size;
	switch (s->speaker % SPEAKERS) {
	case COORDINATOR:
		if (worker_state.fd < 0)
			accept_worker();
		bytes = checksummed_frame_from_parts(s->header, s->header_size, s->payload, s->payload_size, false,
						     &size);
		send_bytes(bytes, size);
		free(bytes);
		break;
	case POOL:
		run_next_task();
		break;
	case NETWORK:
		disconnect();
		break;
	case SIGNAL:
		if (!worker_state.agent->is_leaving) {
			worker_state.agent->is_leaving = true;
			lease_queue_return_unstarted(worker_state.agent);
			agent_leave_if_idle(worker_state.agent);
		}
	}
	run_loop();
	drain_socket();
}

/* Files of the cache are read by libuv's pool, which this fuzzer does not control; a worker that ends waits for it. */
static void finish_reading(void)
{
	for (struct job_cache *b = worker_state.agent->job_caches; b;) {
		bool is_reading = b->reading.check;
		if (is_reading)
			uv_run(&worker_state.agent->loop, UV_RUN_ONCE);
		b = is_reading ? worker_state.agent->job_caches : b->next;
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	struct step steps[SCRIPT_STEPS];
	if (!worker_state.agent)
		start_worker();
	size_t count = script_read(bytes, size, steps);
	for (size_t i = 0; i < count && !worker_state.agent->has_left; i++)
		run_step(&steps[i]);
	disconnect();
	finish_reading();
	if (!worker_state.agent->has_left)
		*worker_state.agent->thread_pool = (struct thread_pool){0};
	lease_queue_close(worker_state.agent);
	if (worker_state.agent->is_leaving) {
		agent_close(worker_state.agent);
		worker_state.agent = NULL;
	}
	return 0;
}

size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t max_size, unsigned seed)
{
	return script_mutate(bytes, size, max_size, seed, SPEAKERS);
}

/* ---- seeds ---- */

static char room_scene[] =
	"<scene version=\"3.0.0\"><sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/><film type=\"hdrfilm\">"
	"<integer name=\"width\" value=\"20\"/><integer name=\"height\" value=\"10\"/></film></sensor>"
	"<shape type=\"sphere\"><point name=\"center\" x=\"0\" y=\"0\" z=\"4\"/><bsdf type=\"diffuse\"/></shape>"
	"<shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/><translate y=\"3\" z=\"4\"/></transform>"
	"<emitter type=\"area\"><rgb name=\"radiance\" value=\"9\"/></emitter></shape></scene>";

static void add_job(struct seed *s, uint64_t job)
{
	struct plan plan = farm_world_make_plan(job);
	struct blob_hash hash;
	struct error e;
	Farm__JobInfo info;
	Farm__Plan wire;
	Farm__File file, *files[1] = {&file};
	Farm__BlobChunk chunk;
	Farm__Envelope m;
	char name[] = "s.xml";
	farm__job_info__init(&info);
	farm__file__init(&file);
	farm__blob_chunk__init(&chunk);
	blob_hash_bytes(room_scene, strlen(room_scene), &hash, &e);
	plan_to_wire(&plan, &wire);
	file.name = info.name = info.scene = name;
	file.hash = chunk.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hash.bytes};
	file.size = chunk.size = strlen(room_scene);
	info.job = job;
	info.plan = &wire;
	info.n_files = 1;
	info.files = files;
	SEED_SAY(s, COORDINATOR, JOB_INFO, job_info, &info);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
	m.blob_chunk = &chunk;
	seed_add_message(s, COORDINATOR, &m, room_scene, strlen(room_scene));
}

static void add_grant(struct seed *s, const struct lease_key *k)
{
	Farm__LeaseKey key;
	Farm__LeaseGrant g;
	uint64_t seeds[2] = {UINT64_MAX, UINT64_MAX}; /* seeds of a bootstrap that found no light */
	struct plan plan = farm_world_make_plan(k->job);
	farm__lease_grant__init(&g);
	lease_key_to_wire(k, &key);
	g.key = &key;
	if (k->kind == LEASE_RENDER && plan.kind == PLAN_CHAINS) {
		struct plan_range chains = plan_chain_range(&plan, k->part);
		g.n_seeds = (size_t)(chains.end - chains.begin);
		g.seeds = seeds;
	}
	SEED_SAY(s, COORDINATOR, LEASE_GRANT, lease_grant, &g);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc;
	(void)argv;
	static const struct lease_key keys[] = {{.job = FARM_JOB_BOOTSTRAP, .kind = LEASE_BOOTSTRAP},
						{.job = FARM_JOB_CHAINS, .kind = LEASE_RENDER},
						{.job = FARM_JOB_SAMPLES, .kind = LEASE_RENDER}};
	if (!seeds_are_requested())
		return 0;
	for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
		for (int end = 0; end < 3; end++) {
			struct seed s = {0};
			Farm__LeaseKey key;
			Farm__LeaseAck ack;
			Farm__LeaseRevoke revoke;
			Farm__JobEnd job_end;
			farm__lease_ack__init(&ack);
			farm__lease_revoke__init(&revoke);
			farm__job_end__init(&job_end);
			lease_key_to_wire(&keys[i], &key);
			ack.key = revoke.key = &key;
			ack.verdict = FARM__VERDICT__VERDICT_MERGED;
			job_end.job = keys[i].job;
			add_grant(&s, &keys[i]);
			add_job(&s, keys[i].job);
			seed_add_raw(&s, POOL, "-");
			if (end == 1)
				SEED_SAY(&s, COORDINATOR, LEASE_REVOKE, lease_revoke, &revoke);
			seed_add_raw(&s, end == 2 ? SIGNAL : POOL, "-");
			if (end == 0) {
				seed_add_raw(&s, NETWORK, "-");
				add_job(&s, keys[i].job);
				SEED_SAY(&s, COORDINATOR, LEASE_ACK, lease_ack, &ack);
			}
			SEED_SAY(&s, COORDINATOR, JOB_END, job_end, &job_end);
			seed_write(&s, "lease", 3 * i + (size_t)end);
		}
	struct seed flood = {0};
	for (uint64_t epoch = 0; epoch < SCRIPT_STEPS; epoch++)
		add_grant(&flood, &(struct lease_key){.job = FARM_JOB_SAMPLES, .kind = LEASE_RENDER, .epoch = epoch});
	seed_write(&flood, "flood", 0);
	exit(0);
}
