/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Peers of a coordinator (scripted_peer.h): frames over a blocking socket, and messages with the minimum that each
 * needs. Results are computed from the lease's tag, so that a test can tell from an image which leases it contains, and
 * how often.
 */
#include "tests/support/scripted_peer.h"

#include "common/base/mem.h"
#include "common/blob/blob.h"
#include "tests/support/black_batch.h"
#include "tests/support/checksummed_frame.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { TIMEOUT_MS = 60000 };

const struct plan_request scripted_peer_plan_request = {.integrator = "pssmlt",
							.kind = PLAN_CHAINS,
							.width = 20,
							.height = 10,
							.mutations = 3200,
							.max_depth = 24,
							.groups = 2,
							.chains = 8,
							.epoch = 100,
							.bootstrap = 64};

uint16_t scripted_peer_read_port(const char *port_file)
{
	unsigned port = 0;
	for (int i = 0; i < TIMEOUT_MS && !port; i++) {
		FILE *f = fopen(port_file, "r");
		if (f && fscanf(f, "%u", &port) != 1)
			port = 0;
		if (f)
			fclose(f);
		usleep(1000);
	}
	return (uint16_t)port;
}

/* Sends the bytes and frees them. */
static bool send_all(const struct scripted_peer *p, unsigned char *bytes, size_t size)
{
	size_t done = 0;
	while (done < size) {
		ssize_t n = send(p->fd, bytes + done, size - done, MSG_NOSIGNAL);
		if (n <= 0)
			break;
		done += (size_t)n;
	}
	free(bytes);
	return done == size;
}

bool scripted_peer_send(const struct scripted_peer *p, const Farm__Envelope *m, const void *payload,
			size_t payload_size)
{
	size_t size;
	unsigned char *bytes = checksummed_frame_from_message(m, payload, payload_size, &size);
	return send_all(p, bytes, size);
}

bool scripted_peer_is_readable(struct scripted_peer *p, int milliseconds)
{
	struct pollfd ready = {p->fd, POLLIN, 0};
	return p->offset < p->size || poll(&ready, 1, milliseconds) == 1;
}

bool scripted_peer_is_merge_ack(const Farm__Envelope *m)
{
	return m && m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK &&
	       m->lease_ack->verdict == FARM__VERDICT__VERDICT_MERGED;
}

const Farm__Envelope *scripted_peer_receive(struct scripted_peer *p)
{
	for (;;) {
		struct error e;
		if (p->offset == p->size) {
			assert_true(scripted_peer_is_readable(p, TIMEOUT_MS));
			ssize_t n = read(p->fd, p->bytes, sizeof p->bytes);
			if (n <= 0)
				return NULL;
			p->offset = 0;
			p->size = (size_t)n;
		}
		size_t used;
		int rc = frame_reader_feed(&p->reader, p->bytes + p->offset, p->size - p->offset, &used, &e);
		assert_true(rc >= 0);
		p->offset += used;
		if (!rc)
			continue;
		envelope_fini(&p->env);
		assert_int_equal(envelope_unpack(&p->env, p->reader.header.bytes, p->reader.header.size, &e), 0);
		if (p->env.message->body_case != FARM__ENVELOPE__BODY_HEARTBEAT)
			return p->env.message;
		p->heartbeats++;
	}
}

const Farm__HelloAck *scripted_peer_exchange_hello(struct scripted_peer *p, uint32_t version, Farm__Role role)
{
	Farm__Hello h;
	Farm__Envelope m;
	char name[] = "scripted", fingerprint[] = "p1";
	farm__hello__init(&h);
	farm__envelope__init(&m);
	h.version = version;
	h.role = role;
	h.name = name;
	h.fingerprint = fingerprint;
	h.threads = 1;
	m.body_case = FARM__ENVELOPE__BODY_HELLO;
	m.hello = &h;
	const Farm__Envelope *answer = scripted_peer_send(p, &m, NULL, 0) ? scripted_peer_receive(p) : NULL;
	return answer && answer->body_case == FARM__ENVELOPE__BODY_HELLO_ACK ? answer->hello_ack : NULL;
}

struct scripted_peer *scripted_peer_connect(uint16_t port)
{
	struct sockaddr_in a = {.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
	struct scripted_peer *p = calloc(1, sizeof *p);
	assert_non_null(p);
	p->fd = socket(AF_INET, SOCK_STREAM, 0);
	setsockopt(p->fd, IPPROTO_TCP, TCP_NODELAY, &(int){1}, sizeof(int));
	frame_reader_init(&p->reader, (struct frame_limits){1 << 22, 1 << 24});
	if (connect(p->fd, (struct sockaddr *)&a, sizeof a) == 0)
		return p;
	scripted_peer_disconnect(p);
	return NULL;
}

struct scripted_peer *scripted_peer_connect_as(uint16_t port, Farm__Role role)
{
	struct scripted_peer *p = scripted_peer_connect(port);
	const Farm__HelloAck *ack = p ? scripted_peer_exchange_hello(p, FARM_VERSION, role) : NULL;
	if (ack && ack->accepted)
		return p;
	scripted_peer_disconnect(p);
	return NULL;
}

void scripted_peer_disconnect(struct scripted_peer *p)
{
	if (!p)
		return;
	close(p->fd);
	frame_reader_fini(&p->reader);
	envelope_fini(&p->env);
	free(p);
}

/* ---- the messages of a client */

static ProtobufCBinaryData hash_text(const char *text, struct blob_hash *h)
{
	struct error e;
	assert_int_equal(blob_hash_bytes(text, strlen(text), h, &e), 0);
	return (ProtobufCBinaryData){BLOB_HASH_SIZE, h->bytes};
}

bool scripted_peer_submit(const struct scripted_peer *p, const struct plan_request *r, const char *scene)
{
	Farm__Submit s;
	Farm__PlanRequest plan;
	Farm__File file, *files[1] = {&file};
	Farm__Envelope m;
	struct blob_hash hash;
	char name[] = "scripted", path[] = "s.xml";
	plan_request_to_wire(r, &plan);
	farm__submit__init(&s);
	farm__file__init(&file);
	farm__envelope__init(&m);
	file.name = s.scene = path;
	file.hash = hash_text(scene, &hash);
	file.size = strlen(scene);
	s.name = name;
	s.plan = &plan;
	s.n_files = 1;
	s.files = files;
	m.body_case = FARM__ENVELOPE__BODY_SUBMIT;
	m.submit = &s;
	return scripted_peer_send(p, &m, NULL, 0);
}

bool scripted_peer_send_scene(const struct scripted_peer *p, const char *scene)
{
	Farm__BlobChunk c;
	Farm__Envelope m;
	struct blob_hash hash;
	farm__blob_chunk__init(&c);
	farm__envelope__init(&m);
	c.hash = hash_text(scene, &hash);
	c.size = strlen(scene);
	m.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
	m.blob_chunk = &c;
	return scripted_peer_send(p, &m, scene, strlen(scene));
}

bool scripted_peer_request_leases(const struct scripted_peer *p, uint32_t leases)
{
	Farm__LeaseRequest request;
	Farm__Envelope m;
	farm__lease_request__init(&request);
	farm__envelope__init(&m);
	request.want = leases;
	m.body_case = FARM__ENVELOPE__BODY_LEASE_REQUEST;
	m.lease_request = &request;
	return scripted_peer_send(p, &m, NULL, 0);
}

bool scripted_peer_request_job_list(const struct scripted_peer *p)
{
	Farm__JobList list;
	Farm__Envelope m;
	farm__job_list__init(&list);
	farm__envelope__init(&m);
	m.body_case = FARM__ENVELOPE__BODY_JOB_LIST;
	m.job_list = &list;
	return scripted_peer_send(p, &m, NULL, 0);
}

bool scripted_peer_fetch(const struct scripted_peer *p, uint64_t job, Farm__What what, uint64_t offset)
{
	Farm__Fetch f;
	Farm__Envelope m;
	farm__fetch__init(&f);
	farm__envelope__init(&m);
	f.job = job;
	f.what = what;
	f.offset = offset;
	m.body_case = FARM__ENVELOPE__BODY_FETCH;
	m.fetch = &f;
	return scripted_peer_send(p, &m, NULL, 0);
}

/* ---- the results of a worker */

uint64_t scripted_peer_lease_tag(const struct lease_key *k)
{
	uint64_t z = ((uint64_t)k->kind << 60 ^ (uint64_t)k->group << 48 ^ (uint64_t)k->part << 36 ^ k->epoch) +
		     UINT64_C(0x9e3779b97f4a7c15);
	z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
	return z ^ z >> 31;
}

static float random_value(uint64_t *tag)
{
	*tag = *tag * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
	return 0.5f + (float)(*tag >> 40) * 0x1p-24f;
}

static void fill_weights(struct batch *b, uint64_t tag)
{
	for (uint64_t i = 0; i < b->weight_count; i++) {
		b->weights[i] = random_value(&tag);
		b->independent_sum += b->weights[i];
		b->independent_square += (double)b->weights[i] * b->weights[i];
	}
}

static void add_tiles(struct batch *b, const struct plan *plan, uint64_t tag)
{
	uint32_t across = (plan->crop_width + TILE_SIZE - 1) / TILE_SIZE,
		 down = (plan->crop_height + TILE_SIZE - 1) / TILE_SIZE;
	b->tiles = mem_alloc((size_t)across * down, sizeof *b->tiles);
	for (uint32_t y = 0; y < plan->crop_height; y += TILE_SIZE)
		for (uint32_t x = 0; x < plan->crop_width; x += TILE_SIZE) {
			struct tile *t = &b->tiles[b->tile_count++];
			t->x = plan->crop_x + x;
			t->y = plan->crop_y + y;
			t->width = plan->crop_width - x < TILE_SIZE ? plan->crop_width - x : TILE_SIZE;
			t->height = plan->crop_height - y < TILE_SIZE ? plan->crop_height - y : TILE_SIZE;
			size_t count = (size_t)t->width * t->height * TILE_CHANNELS;
			t->xyz = mem_alloc(count, sizeof *t->xyz);
			for (size_t i = 0; i < count; i++)
				t->xyz[i] = random_value(&tag);
		}
}

struct batch scripted_peer_make_batch(const struct lease_key *k, const struct plan *plan, uint32_t state_bytes)
{
	struct batch b = black_batch(k, plan, state_bytes);
	uint64_t tag = scripted_peer_lease_tag(k);
	b.cpu_seconds = 1;
	if (k->kind == LEASE_BOOTSTRAP) {
		fill_weights(&b, tag);
		return b;
	}
	for (uint32_t i = 0; i < b.state_count; i++)
		memcpy(b.states[i].bytes, &tag, sizeof tag);
	b.counters[COUNT_ACCEPTED] = b.counters[COUNT_SAMPLES] / 2;
	add_tiles(&b, plan, tag);
	return b;
}

bool scripted_peer_send_batch(const struct scripted_peer *p, const struct batch *b, const struct plan *plan)
{
	unsigned char *frame;
	size_t size;
	struct error e;
	assert_int_equal(batch_pack(b, plan, &frame, &size, &e), 0);
	unsigned char *bytes = checksummed_frame(frame, size, &size);
	mem_free(frame);
	return send_all(p, bytes, size);
}

uint64_t scripted_peer_submit_with_scene(struct scripted_peer *p, const struct plan_request *r, const char *scene)
{
	assert_true(scripted_peer_submit(p, r, scene));
	const Farm__Envelope *m = scripted_peer_receive(p);
	if (m && m->body_case == FARM__ENVELOPE__BODY_SUBMIT_ANSWER && m->submit_answer->n_missing)
		m = scripted_peer_send_scene(p, scene) ? scripted_peer_receive(p) : NULL;
	assert_true(m && m->body_case == FARM__ENVELOPE__BODY_SUBMIT_ANSWER && m->submit_answer->job);
	return m->submit_answer->job;
}
