/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator of the fuzzers (farm.h): its spool is made once by a conversation with scripted peers and copied for
 * each run; its loop runs only when called; its peers are TCP and UNIX connections that are read without blocking.
 *
 * It is settled when all peers have hung up and no job is being written or read. Anything that should work and does not
 * ends the program, which libFuzzer reports as a finding.
 */
#include "tests/fuzz/farm_world.h"

#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/wire/batch_wire.h"
#include "coordinator/peers/session.h"
#include "coordinator/server/server_options.h"
#include "tests/fuzz/folders.h"
#include "tests/support/black_batch.h"
#include "tests/support/checksummed_frame.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

const char farm_world_scene[] = "<scene version=\"3.0.0\"/>";

static void require(bool ok, const char *what)
{
	if (!ok) {
		fprintf(stderr, "the world of the fuzzer cannot be made: %s\n", what);
		abort();
	}
}

/* ---- turning ---- */

void farm_world_run_once(struct farm_world *w)
{
	uv_run(&w->server->loop, UV_RUN_NOWAIT);
}

static bool is_at_work(const struct server *s)
{
	for (const struct live_job *job = s->jobs.live_jobs; job; job = job->next)
		if (job->is_busy)
			return true;
	return s->jobs.is_flushing || s->peers.session_count;
}

void farm_world_settle(struct farm_world *w)
{
	w->settle_count++;
	for (unsigned i = 0; i < FARM_WORLD_PEERS; i++)
		farm_world_disconnect(w, i);
	farm_world_run_once(w);
	while (is_at_work(w->server))
		uv_run(&w->server->loop, UV_RUN_ONCE);
	farm_world_run_once(w);
}

/* ---- start and end ---- */

int farm_world_open(struct farm_world *w, struct error *e)
{
	char socket_path[160];
	struct server_config c;
	server_config_init(&c);
	snprintf(socket_path, sizeof socket_path, "%s.sock", w->spool);
	c.listen_address = "127.0.0.1:0";
	c.spool_folder = w->spool;
	c.status_socket = socket_path;
	c.max_journal_bytes = 1 << 12; /* so that there are checkpoints */
	c.max_connections = 16;
	/* Findings must not depend on the machine's load. */
	c.heartbeat_seconds = c.hello_seconds = c.stall_seconds = 3600;
	for (unsigned i = 0; i < FARM_WORLD_PEERS; i++)
		w->peers[i].fd = -1;
	int rc = server_open(&w->server, &c, e);
	if (rc)
		return rc;
	rc = server_await_jobs(w->server, e);
	if (rc) {
		server_close(w->server);
		w->server = NULL;
	}
	return rc;
}

void farm_world_close(struct farm_world *w)
{
	for (unsigned i = 0; i < FARM_WORLD_PEERS; i++)
		farm_world_disconnect(w, i);
	server_close(w->server);
	w->server = NULL;
}

static void make_first_spool(void);

static void template_path(char path[128])
{
	snprintf(path, 128, "%s/template", folders_base());
}

static void ensure_first_spool(void)
{
	static bool made;
	if (made)
		return;
	made = true;
	log_set_level(getenv("HSLT_FUZZ_LOG") ? LOG_LEVEL_DEBUG : LOG_LEVEL_ERROR);
	make_first_spool();
}

void farm_world_copy_spool(const char *to)
{
	char from[128];
	ensure_first_spool();
	template_path(from);
	folders_copy(from, to);
}

struct farm_world *farm_world_new(void)
{
	static unsigned count;
	struct farm_world *w = calloc(1, sizeof *w);
	struct error e;
	ensure_first_spool();
	snprintf(w->spool, sizeof w->spool, "%s/%u", folders_base(), count++);
	farm_world_copy_spool(w->spool);
	int rc = farm_world_open(w, &e);
	require(rc == 0, e.text);
	return w;
}

void farm_world_free(struct farm_world *w)
{
	if (w->server)
		farm_world_close(w);
	folders_remove(w->spool);
	free(w);
}

/* ---- peers ---- */

static uint16_t server_port(const struct server *s)
{
	struct sockaddr_in a;
	int size = sizeof a;
	uv_tcp_getsockname(&s->peers.listeners[0].tcp, (struct sockaddr *)&a, &size);
	return a.sin_port;
}

void farm_world_connect(struct farm_world *w, unsigned peer, bool status_socket)
{
	struct sockaddr_in a = {
		.sin_family = AF_INET, .sin_port = server_port(w->server), .sin_addr = {htonl(INADDR_LOOPBACK)}};
	struct sockaddr_un u = {.sun_family = AF_UNIX};
	struct farm_world_peer *p = &w->peers[peer];
	snprintf(u.sun_path, sizeof u.sun_path, "%.100s.sock", w->spool);
	farm_world_disconnect(w, peer);
	p->fd = socket(status_socket ? AF_UNIX : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	const struct sockaddr *to = status_socket ? (const struct sockaddr *)&u : (const struct sockaddr *)&a;
	if (p->fd >= 0 && connect(p->fd, to, status_socket ? sizeof u : sizeof a)) {
		close(p->fd);
		p->fd = -1;
		return;
	}
	struct linger reset = {1, 0}; /* with thousands of calls, closed connections must not pile up in the kernel */
	setsockopt(p->fd, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
	setsockopt(p->fd, IPPROTO_TCP, TCP_NODELAY, &(int){1}, sizeof(int)); /* sent at once, to be read in the next
									      * turn */
	frame_reader_init(&p->reader, (struct frame_limits){1 << 22, 1 << 24});
	farm_world_run_once(w);
}

void farm_world_disconnect(struct farm_world *w, unsigned peer)
{
	struct farm_world_peer *p = &w->peers[peer];
	if (p->fd < 0)
		return;
	close(p->fd);
	frame_reader_fini(&p->reader);
	envelope_fini(&p->received);
	*p = (struct farm_world_peer){.fd = -1};
}

void farm_world_drain(struct farm_world *w, unsigned peer)
{
	char bytes[1 << 15];
	ssize_t n = 1;
	while (w->peers[peer].fd >= 0 && n > 0)
		n = recv(w->peers[peer].fd, bytes, sizeof bytes, MSG_DONTWAIT);
	if (w->peers[peer].fd >= 0 && (n == 0 || (errno != EAGAIN && errno != EINTR)))
		farm_world_disconnect(w, peer);
}

void farm_world_send_bytes(struct farm_world *w, unsigned peer, const void *bytes, size_t size)
{
	const char *next = bytes;
	while (size && w->peers[peer].fd >= 0) {
		ssize_t n = send(w->peers[peer].fd, next, size, MSG_NOSIGNAL | MSG_DONTWAIT);
		if (n < 0 && errno != EAGAIN) {
			farm_world_disconnect(w, peer);
			return;
		}
		next += n > 0 ? n : 0;
		size -= n > 0 ? (size_t)n : 0;
		farm_world_run_once(w);
	}
}

void farm_world_send_message(struct farm_world *w, unsigned peer, const Farm__Envelope *m, const void *payload,
			     size_t size)
{
	size_t n;
	unsigned char *frame = checksummed_frame_from_message(m, payload, size, &n);
	w->peers[peer].has_spoken = true;
	farm_world_send_bytes(w, peer, frame, n);
	free(frame);
}

void farm_world_send_step(struct farm_world *w, unsigned peer, const struct step *step)
{
	size_t n;
	unsigned char *frame = checksummed_frame_from_parts(step->header, step->header_size, step->payload,
							    step->payload_size, !w->peers[peer].has_spoken, &n);
	w->peers[peer].has_spoken = true;
	farm_world_send_bytes(w, peer, frame, n);
	free(frame);
}

void farm_world_send_hello(struct farm_world *w, unsigned peer, Farm__Role role)
{
	Farm__Hello h;
	Farm__Envelope m;
	char name[32], fingerprint[] = "p1", none[] = "";
	farm__hello__init(&h);
	farm__envelope__init(&m);
	snprintf(name, sizeof name, "w%u-%u", peer, w->settle_count);
	h.version = FARM_VERSION;
	h.role = role;
	h.name = name;
	h.fingerprint = role == FARM__ROLE__ROLE_WORKER ? fingerprint : none;
	h.threads = 1;
	m.body_case = FARM__ENVELOPE__BODY_HELLO;
	m.hello = &h;
	farm_world_send_message(w, peer, &m, NULL, 0);
}

/* ---- the jobs ---- */

struct plan farm_world_make_plan(uint64_t job)
{
	struct plan p;
	struct error e;
	struct plan_request r = {.integrator = "pssmlt",
				 .kind = PLAN_CHAINS,
				 .width = 20,
				 .height = 10,
				 .border = 2,
				 .spp = 4,
				 .max_depth = 5,
				 .groups = 2,
				 .bootstrap = 64,
				 .chains = 4,
				 .epoch = 100};
	if (job == FARM_JOB_CHAINS)
		r.target_error = 1e-4; /* so that its error is estimated */
	if (job == FARM_JOB_CHAINS || job == FARM_JOB_EXTENDABLE)
		snprintf(r.integrator, sizeof r.integrator, "hslt"),
			snprintf(r.mixture, sizeof r.mixture, "independent=0.1,hslt=0.9");
	if (job == FARM_JOB_SAMPLES) {
		r.kind = PLAN_SAMPLES;
		r.chains = 0;
		r.epoch = 1;
		snprintf(r.integrator, sizeof r.integrator, "path");
	}
	require(plan_make(&r, &p, &e) == 0, e.text);
	return p;
}

const Farm__Envelope *farm_world_make_submission(uint64_t job)
{
	static Farm__Submit s;
	static Farm__PlanRequest request;
	static Farm__File file, *files[1] = {&file};
	static Farm__Envelope m;
	static struct blob_hash hash;
	static char name[] = "job", scene[] = "s.xml", integrator[16], mixture[PLAN_MUTATIONS_MAX];
	struct error e;
	struct plan p = farm_world_make_plan(job);
	require(blob_hash_bytes(farm_world_scene, strlen(farm_world_scene), &hash, &e) == 0, "a hash");
	farm__submit__init(&s);
	farm__plan_request__init(&request);
	farm__file__init(&file);
	farm__envelope__init(&m);
	snprintf(integrator, sizeof integrator, "%s", p.integrator);
	snprintf(mixture, sizeof mixture, "%s", p.mutations);
	request.integrator = integrator;
	request.mixture = mixture;
	request.kind = p.kind;
	request.width = p.width;
	request.height = p.height;
	request.spp = 4;
	request.max_depth = p.max_depth;
	request.groups = p.groups;
	request.bootstrap = p.bootstrap;
	request.chains = p.chains;
	request.epoch = p.epoch;
	request.target_error = p.target_error;
	request.border = p.border;
	file.name = scene;
	file.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hash.bytes};
	file.size = strlen(farm_world_scene);
	s.name = name;
	s.scene = scene;
	s.plan = &request;
	s.n_files = 1;
	s.files = files;
	s.verify = job == FARM_JOB_SAMPLES;
	m.body_case = FARM__ENVELOPE__BODY_SUBMIT;
	m.submit = &s;
	return &m;
}

static void fill_tile(struct batch *b, const struct plan *plan)
{
	b->tile_count = 1;
	b->tiles = mem_alloc(1, sizeof *b->tiles);
	b->tiles[0] = (struct tile){0, 0, plan->width, plan->height,
				    mem_alloc((size_t)plan->width * plan->height, TILE_CHANNELS * sizeof(float))};
	for (size_t i = 0; i < (size_t)plan->width * plan->height * TILE_CHANNELS; i++)
		b->tiles[0].xyz[i] = 0.01f;
}

struct batch farm_world_make_batch(const struct lease_key *k, const struct plan *plan)
{
	struct batch b = black_batch(k, plan, 4);
	if (k->kind == LEASE_RENDER) {
		fill_tile(&b, plan);
	} else if (k->job != FARM_JOB_DONE) {
		for (uint64_t i = 0; i < b.weight_count; i++)
			b.weights[i] = 1;
		b.independent_sum = b.independent_square = (double)b.weight_count;
	}
	return b;
}

/* ---- the first spool ---- */

static const Farm__Envelope *receive_message(struct farm_world *w, unsigned peer)
{
	struct farm_world_peer *p = &w->peers[peer];
	for (int i = 0; i < 100000; i++) {
		struct error e;
		unsigned char byte;
		size_t used;
		ssize_t got = recv(p->fd, &byte, 1, MSG_DONTWAIT);
		require(got != 0, "the coordinator has hung up");
		if (got != 1) {
			uv_run(&w->server->loop, UV_RUN_ONCE);
			continue;
		}
		int rc = frame_reader_feed(&p->reader, &byte, 1, &used, &e);
		require(rc >= 0, e.text);
		if (!rc)
			continue;
		envelope_fini(&p->received);
		require(envelope_unpack(&p->received, p->reader.header.bytes, p->reader.header.size, &e) == 0, e.text);
		return p->received.message;
	}
	require(false, "the coordinator says nothing");
	return NULL;
}

static const Farm__Envelope *receive_kind(struct farm_world *w, unsigned peer, Farm__Envelope__BodyCase kind)
{
	const Farm__Envelope *m;
	while ((m = receive_message(w, peer))->body_case != kind)
		require(m->body_case != FARM__ENVELOPE__BODY_FAULT, "a fault");
	return m;
}

static void submit_job(struct farm_world *w, unsigned client, uint64_t job)
{
	const Farm__Envelope *m = farm_world_make_submission(job);
	farm_world_send_message(w, client, m, NULL, 0);
	const Farm__SubmitAnswer *a = receive_kind(w, client, FARM__ENVELOPE__BODY_SUBMIT_ANSWER)->submit_answer;
	require(!*a->refusal, a->refusal);
	if (a->n_missing) {
		Farm__BlobChunk c;
		Farm__Envelope chunk;
		farm__blob_chunk__init(&c);
		farm__envelope__init(&chunk);
		c.hash = m->submit->files[0]->hash;
		c.size = m->submit->files[0]->size;
		chunk.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
		chunk.blob_chunk = &c;
		farm_world_send_message(w, client, &chunk, farm_world_scene, strlen(farm_world_scene));
		a = receive_kind(w, client, FARM__ENVELOPE__BODY_SUBMIT_ANSWER)->submit_answer;
	}
	require(a->job == job, "another number of a job");
}

static void request_job(struct farm_world *w, unsigned worker, uint64_t job)
{
	Farm__JobGet get;
	Farm__Envelope m;
	farm__job_get__init(&get);
	farm__envelope__init(&m);
	get.job = job;
	m.body_case = FARM__ENVELOPE__BODY_JOB_GET;
	m.job_get = &get;
	farm_world_send_message(w, worker, &m, NULL, 0);
	receive_kind(w, worker, FARM__ENVELOPE__BODY_JOB_INFO);
}

static void send_result(struct farm_world *w, unsigned worker, struct lease_key k)
{
	struct plan plan = farm_world_make_plan(k.job);
	struct batch b = farm_world_make_batch(&k, &plan);
	unsigned char *frame;
	size_t size;
	struct error e;
	require(batch_pack(&b, &plan, &frame, &size, &e) == 0, e.text);
	size_t n;
	unsigned char *checked = checksummed_frame(frame, size, &n);
	farm_world_send_bytes(w, worker, checked, n);
	free(checked);
	const Farm__LeaseAck *a = receive_kind(w, worker, FARM__ENVELOPE__BODY_LEASE_ACK)->lease_ack;
	bool noted = a->verdict == FARM__VERDICT__VERDICT_NOTED;
	require(noted || a->verdict == FARM__VERDICT__VERDICT_MERGED, a->text);
	mem_free(frame);
	batch_fini(&b);
	if (noted) /* now it is the other job's */
		send_result(w, worker + 1, k);
}

static void send_bootstrap_results(struct farm_world *w, unsigned worker, uint64_t job)
{
	struct plan p = farm_world_make_plan(job);
	for (uint32_t g = 0; g < p.groups; g++)
		for (uint32_t part = 0; part < p.parts; part++)
			send_result(w, worker,
				    (struct lease_key){.job = job, .kind = LEASE_BOOTSTRAP, .group = g, .part = part});
}

static void send_round_results(struct farm_world *w, unsigned worker, uint64_t job, uint32_t slots)
{
	struct plan p = farm_world_make_plan(job);
	for (uint64_t epoch = 0; epoch < p.rounds; epoch++)
		for (uint32_t i = 0; i < slots; i++)
			send_result(w, worker,
				    (struct lease_key){.job = job,
						       .kind = LEASE_RENDER,
						       .group = i / p.parts,
						       .part = i % p.parts,
						       .epoch = epoch});
}

static void make_first_spool(void)
{
	enum { CLIENT, WORKER, SECOND_WORKER };
	struct farm_world w = {0};
	struct error e;
	template_path(w.spool);
	int rc = farm_world_open(&w, &e);
	require(rc == 0, e.text);
	farm_world_connect(&w, CLIENT, false);
	farm_world_send_hello(&w, CLIENT, FARM__ROLE__ROLE_CLIENT);
	farm_world_connect(&w, WORKER, false);
	farm_world_send_hello(&w, WORKER, FARM__ROLE__ROLE_WORKER);
	farm_world_connect(&w, SECOND_WORKER, false);
	farm_world_send_hello(&w, SECOND_WORKER, FARM__ROLE__ROLE_WORKER);
	for (uint64_t job = FARM_JOB_DONE; job <= FARM_JOB_EXTENDABLE; job++) {
		struct plan p = farm_world_make_plan(job);
		submit_job(&w, CLIENT, job);
		request_job(&w, WORKER, job);
		request_job(&w, SECOND_WORKER, job);
		if (job != FARM_JOB_BOOTSTRAP)
			send_bootstrap_results(&w, WORKER, job);
		if (job == FARM_JOB_CHAINS || job == FARM_JOB_EXTENDABLE)
			send_round_results(&w, WORKER, job, p.groups * p.parts - (job == FARM_JOB_CHAINS));
		if (job == FARM_JOB_BOOTSTRAP)
			send_result(&w, WORKER, (struct lease_key){.job = job, .kind = LEASE_BOOTSTRAP});
	}
	farm_world_settle(&w);
	farm_world_close(&w);
}
