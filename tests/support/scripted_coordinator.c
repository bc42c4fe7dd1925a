/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Sends and receives the messages of a coordinator, one at a time. While nothing has arrived, coord_receive runs the
 * worker's loop, for a minute at most. Any message other than the expected one fails the test at the line that expected
 * it.
 */
#include "tests/support/scripted_coordinator.h"

#include "common/base/mem.h"
#include "worker/daemon/agent.h"
#include "tests/support/checksummed_frame.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { TIMEOUT_MS = 60000 };

struct coord_state coord;

void coord_make_file(struct coord_file *f, const void *bytes, size_t size)
{
	struct error e;
	*f = (struct coord_file){.bytes = bytes, .size = size};
	assert_int_equal(blob_hash_bytes(bytes, size, &f->hash, &e), 0);
}

const Farm__Envelope *coord_receive(void)
{
	for (int i = 0; !scripted_peer_is_readable(coord.connection, 1); i++) {
		assert_true(i < TIMEOUT_MS);
		uv_run(&coord.agent->loop, UV_RUN_NOWAIT);
	}
	return scripted_peer_receive(coord.connection);
}

static void send_message(Farm__Envelope *m, Farm__Envelope__BodyCase what, const void *payload, size_t size)
{
	m->body_case = what;
	assert_true(scripted_peer_send(coord.connection, m, payload, size));
}

void coord_accept_worker(void)
{
	Farm__HelloAck ack;
	Farm__Envelope m;
	const struct timeval timeout = {.tv_sec = 0, .tv_usec = 1000};
	coord.connection = calloc(1, sizeof *coord.connection);
	assert_non_null(coord.connection);
	setsockopt(coord.listener, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
	for (int i = 0; (coord.connection->fd = accept(coord.listener, NULL, NULL)) < 0; i++) {
		assert_true(i < TIMEOUT_MS);
		uv_run(&coord.agent->loop, UV_RUN_NOWAIT);
	}
	frame_reader_init(&coord.connection->reader, (struct frame_limits){1 << 22, 1 << 24});
	assert_int_equal(coord_receive()->body_case, FARM__ENVELOPE__BODY_HELLO);
	farm__hello_ack__init(&ack);
	farm__envelope__init(&m);
	ack.accepted = true;
	ack.version = FARM_VERSION;
	ack.heartbeat_ms = 600000;
	m.hello_ack = &ack;
	send_message(&m, FARM__ENVELOPE__BODY_HELLO_ACK, NULL, 0);
}

void coord_disconnect(void)
{
	scripted_peer_disconnect(coord.connection);
	coord.connection = NULL;
}

void coord_expect_job_get(uint64_t job)
{
	const Farm__Envelope *m = coord_receive();
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_JOB_GET);
	assert_int_equal(m->job_get->job, job);
}

void coord_send_grant(uint64_t job)
{
	const struct lease_key k = {.job = job, .kind = LEASE_RENDER};
	unsigned char *frame;
	size_t size;
	struct error e;
	assert_int_equal(grant_pack(&k, NULL, NULL, 0, &frame, &size, &e), 0);
	unsigned char *bytes = checksummed_frame(frame, size, &size);
	assert_int_equal(send(coord.connection->fd, bytes, size, MSG_NOSIGNAL), size);
	free(bytes);
	mem_free(frame);
}

void coord_grant_new_job(uint64_t job)
{
	coord_send_grant(job);
	coord_expect_job_get(job);
}

/* Describes a job by its own scene file, which contains no scene, and the common mesh. */
void coord_send_job_info(uint64_t job)
{
	struct coord_file *sent_files[2] = {&coord.scenes[job - 1], &coord.mesh};
	Farm__JobInfo info;
	Farm__Plan plan;
	Farm__Envelope m;
	Farm__File files[2], *list[2] = {&files[0], &files[1]};
	char names[2][16] = {"scene", "mesh"};
	struct plan p;
	struct error e;
	const struct plan_request r = {.integrator = "path", .width = 8, .height = 8, .spp = 1, .max_depth = 3};
	assert_int_equal(plan_make(&r, &p, &e), 0);
	plan_to_wire(&p, &plan);
	farm__job_info__init(&info);
	farm__envelope__init(&m);
	for (int i = 0; i < 2; i++) {
		farm__file__init(&files[i]);
		files[i].name = names[i];
		files[i].hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, sent_files[i]->hash.bytes};
		files[i].size = sent_files[i]->size;
	}
	info.job = job;
	info.scene = names[0];
	info.render_width = info.render_height = 8;
	info.plan = &plan;
	info.n_files = 2;
	info.files = list;
	m.job_info = &info;
	send_message(&m, FARM__ENVELOPE__BODY_JOB_INFO, NULL, 0);
}

void coord_expect_blob_get(const struct coord_file *f, uint64_t offset)
{
	const Farm__Envelope *m = coord_receive();
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_BLOB_GET);
	assert_int_equal(m->blob_get->hash.len, BLOB_HASH_SIZE);
	assert_memory_equal(m->blob_get->hash.data, f->hash.bytes, BLOB_HASH_SIZE);
	assert_int_equal(m->blob_get->offset, offset);
}

void coord_send_piece(struct coord_file *f, uint64_t offset)
{
	Farm__BlobChunk c;
	Farm__Envelope m;
	size_t remaining = f->size - offset;
	farm__blob_chunk__init(&c);
	farm__envelope__init(&m);
	c.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, f->hash.bytes};
	c.offset = offset;
	c.size = f->size;
	m.blob_chunk = &c;
	send_message(&m, FARM__ENVELOPE__BODY_BLOB_CHUNK, f->bytes + offset,
		     remaining < COORD_PIECE_BYTES ? remaining : COORD_PIECE_BYTES);
}

/* Each piece is requested once, from the given one on, including the last one. */
void coord_serve_mesh(int first, int end)
{
	for (int i = first; i < end; i++) {
		coord_expect_blob_get(&coord.mesh, (uint64_t)i * COORD_PIECE_BYTES);
		coord_send_piece(&coord.mesh, (uint64_t)i * COORD_PIECE_BYTES);
	}
}

void coord_send_job_end(uint64_t job)
{
	Farm__JobEnd end;
	Farm__Envelope m;
	farm__job_end__init(&end);
	farm__envelope__init(&m);
	end.job = job;
	m.job_end = &end;
	send_message(&m, FARM__ENVELOPE__BODY_JOB_END, NULL, 0);
}

/* The lease of a job that could be fetched fails, because its file contains no scene. */
uint64_t coord_expect_lease_failed(const char *why)
{
	const Farm__Envelope *m = coord_receive();
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_LEASE_FAILED);
	if (!strstr(m->lease_failed->text, why))
		fail_msg("it says: %s", m->lease_failed->text);
	coord.worker_at_fault = m->lease_failed->own;
	return m->lease_failed->key->job;
}

void coord_expect_built_jobs(int count)
{
	unsigned jobs = 0;
	for (int i = 0; i < count; i++) {
		jobs |= 1u << coord_expect_lease_failed("scene");
		assert_false(coord.worker_at_fault);
	}
	assert_int_equal(__builtin_popcount(jobs), count);
}

/* Checks that the worker sends nothing more: the answer to another message comes next. */
void coord_expect_silence(void)
{
	coord_grant_new_job(4);
	coord_send_job_end(4);
}

void coord_start(uint64_t cache_bytes)
{
	struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
	socklen_t length = sizeof a;
	struct error e;
	coord.listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	assert_int_equal(bind(coord.listener, (struct sockaddr *)&a, sizeof a), 0);
	assert_int_equal(listen(coord.listener, 4), 0);
	getsockname(coord.listener, (struct sockaddr *)&a, &length);
	snprintf(coord.address, sizeof coord.address, "127.0.0.1:%d", ntohs(a.sin_port));
	const struct agent_config c = {.coordinator_address = coord.address,
				       .name = "w",
				       .cache_folder = temporary_folder,
				       .max_cache_bytes = cache_bytes,
				       .threads = 1};
	for (size_t i = 0; i < COORD_MESH_BYTES; i++)
		coord.mesh_bytes[i] = (unsigned char)(i * 7 + i / COORD_PIECE_BYTES);
	coord_make_file(&coord.mesh, coord.mesh_bytes, COORD_MESH_BYTES);
	static const char *const scenes[] = {"one", "two", "three", "four"};
	for (int i = 0; i < 4; i++)
		coord_make_file(&coord.scenes[i], scenes[i], strlen(scenes[i]));
	assert_int_equal(agent_open(&coord.agent, &c, &e), 0);
	coord_accept_worker();
	assert_int_equal(coord_receive()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
}

void coord_stop(void)
{
	coord_disconnect();
	agent_close(coord.agent);
	close(coord.listener);
}

/* Jobs 1 to count have their own files; the first one to need the mesh asks for it. */
void coord_begin_jobs(uint64_t count)
{
	for (uint64_t j = 1; j <= count; j++)
		coord_grant_new_job(j);
	for (uint64_t j = 1; j <= count; j++) {
		coord_send_job_info(j);
		coord_expect_blob_get(&coord.scenes[j - 1], 0);
	}
	for (uint64_t j = 1; j <= count; j++)
		coord_send_piece(&coord.scenes[j - 1], 0);
}

void coord_send_revoke(uint64_t job)
{
	const struct lease_key k = {.job = job, .kind = LEASE_RENDER};
	Farm__LeaseRevoke revoked;
	Farm__LeaseKey key;
	Farm__Envelope m;
	farm__lease_revoke__init(&revoked);
	farm__envelope__init(&m);
	lease_key_to_wire(&k, &key);
	revoked.key = &key;
	m.lease_revoke = &revoked;
	send_message(&m, FARM__ENVELOPE__BODY_LEASE_REVOKE, NULL, 0);
}
