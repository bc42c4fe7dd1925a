/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A worker's lease queue with a scripted coordinator: files that several jobs want come once, whatever
 * happens to the job that asked first, to the connection or to the disk. Both are in this thread, so nothing happens at
 * once by chance.
 */
#include "common/base/disk.h"
#include "common/base/log.h"
#include "common/base/mem.h"
#include "worker/daemon/agent.h"
#include "worker/daemon/agent_state.h"
#include "worker/daemon/work.h"
#include "tests/support/failing_memory.h"
#include "tests/support/folder.h"
#include "tests/support/scripted.h"
#include "tests/support/checksummed_frame.h"
#include "tests/support/worlds.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <arpa/inet.h>
#include <errno.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum { PIECE = 1000, MESH = 3500, PIECES = 4, WAIT_MS = 60000 };

struct file {
	const unsigned char *bytes;
	size_t size;
	struct blob_hash hash;
};

static struct lease_queue_test {
	struct agent *agent;
	int listener;
	char address[32];
	struct scripted *at; /* the connection, from the coordinator's side */
	struct file mesh, scenes[4];
	unsigned char mesh_bytes[MESH];
	bool own; /* what the last failure said */
} t;

static void make_file(struct file *f, const void *bytes, size_t size)
{
	struct error e;
	*f = (struct file){.bytes = bytes, .size = size};
	assert_int_equal(blob_hash_bytes(bytes, size, &f->hash, &e), 0);
}

/* ---- the coordinator ---- */

static const Farm__Envelope *hear(void)
{
	for (int i = 0; !scripted_has(t.at, 1); i++) {
		assert_true(i < WAIT_MS);
		uv_run(&t.agent->loop, UV_RUN_NOWAIT);
	}
	return scripted_hear(t.at);
}

static void send_message(Farm__Envelope *m, Farm__Envelope__BodyCase what, const void *payload, size_t size)
{
	m->body_case = what;
	assert_true(scripted_say(t.at, m, payload, size));
}

static void welcome(void)
{
	Farm__HelloAck ack;
	Farm__Envelope m;
	const struct timeval patience = {.tv_sec = 0, .tv_usec = 1000};
	t.at = calloc(1, sizeof *t.at);
	assert_non_null(t.at);
	setsockopt(t.listener, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
	for (int i = 0; (t.at->fd = accept(t.listener, NULL, NULL)) < 0; i++) {
		assert_true(i < WAIT_MS);
		uv_run(&t.agent->loop, UV_RUN_NOWAIT);
	}
	frame_reader_init(&t.at->reader, (struct frame_limits){1 << 22, 1 << 24});
	assert_int_equal(hear()->body_case, FARM__ENVELOPE__BODY_HELLO);
	farm__hello_ack__init(&ack);
	farm__envelope__init(&m);
	ack.accepted = true;
	ack.version = FARM_VERSION;
	ack.heartbeat_ms = 600000;
	m.hello_ack = &ack;
	send_message(&m, FARM__ENVELOPE__BODY_HELLO_ACK, NULL, 0);
}

static void hang_up(void)
{
	scripted_hang_up(t.at);
	t.at = NULL;
}

static void hear_job_get(uint64_t job)
{
	const Farm__Envelope *m = hear();
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_JOB_GET);
	assert_int_equal(m->job_get->job, job);
}

static void say_grant(uint64_t job)
{
	const struct lease_key k = {.job = job, .kind = LEASE_RENDER};
	unsigned char *frame;
	size_t size;
	struct error e;
	assert_int_equal(grant_pack(&k, NULL, NULL, 0, &frame, &size, &e), 0);
	unsigned char *bytes = checksummed_frame(frame, size, &size);
	assert_int_equal(send(t.at->fd, bytes, size, MSG_NOSIGNAL), size);
	free(bytes);
	mem_free(frame);
}

static void grant(uint64_t job)
{
	say_grant(job);
	hear_job_get(job);
}

/* A scene of its own, which is none, and the mesh that all have. */
static void describe(uint64_t job)
{
	struct file *all[2] = {&t.scenes[job - 1], &t.mesh};
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
		files[i].hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, all[i]->hash.bytes};
		files[i].size = all[i]->size;
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

static void hear_blob_get(const struct file *f, uint64_t offset)
{
	const Farm__Envelope *m = hear();
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_BLOB_GET);
	assert_int_equal(m->blob_get->hash.len, BLOB_HASH_SIZE);
	assert_memory_equal(m->blob_get->hash.data, f->hash.bytes, BLOB_HASH_SIZE);
	assert_int_equal(m->blob_get->offset, offset);
}

static void send_piece(struct file *f, uint64_t offset)
{
	Farm__BlobChunk c;
	Farm__Envelope m;
	size_t left = f->size - offset;
	farm__blob_chunk__init(&c);
	farm__envelope__init(&m);
	c.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, f->hash.bytes};
	c.offset = offset;
	c.size = f->size;
	m.blob_chunk = &c;
	send_message(&m, FARM__ENVELOPE__BODY_BLOB_CHUNK, f->bytes + offset, left < PIECE ? left : PIECE);
}

/* Each piece is asked for once, from the given one on; the last one is asked for. */
static void serve_mesh(int from, int to)
{
	for (int i = from; i < to; i++) {
		hear_blob_get(&t.mesh, (uint64_t)i * PIECE);
		send_piece(&t.mesh, (uint64_t)i * PIECE);
	}
}

static void end_job(uint64_t job)
{
	Farm__JobEnd end;
	Farm__Envelope m;
	farm__job_end__init(&end);
	farm__envelope__init(&m);
	end.job = job;
	m.job_end = &end;
	send_message(&m, FARM__ENVELOPE__BODY_JOB_END, NULL, 0);
}

/* The lease of a job that could be fetched fails with its scene, which is none. */
static uint64_t hear_failed(const char *why)
{
	const Farm__Envelope *m = hear();
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_LEASE_FAILED);
	if (!strstr(m->lease_failed->text, why))
		fail_msg("it says: %s", m->lease_failed->text);
	t.own = m->lease_failed->own;
	return m->lease_failed->key->job;
}

static void hear_built(int count)
{
	unsigned jobs = 0;
	for (int i = 0; i < count; i++) {
		jobs |= 1u << hear_failed("scene");
		assert_false(t.own);
	}
	assert_int_equal(__builtin_popcount(jobs), count);
}

/* It says nothing more: the answer to something else comes next. */
static void hear_silence(void)
{
	grant(4);
	end_job(4);
}

/* ---- set-up ---- */

static void start(uint64_t cache_bytes)
{
	struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
	socklen_t length = sizeof a;
	struct error e;
	t.listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
	assert_int_equal(bind(t.listener, (struct sockaddr *)&a, sizeof a), 0);
	assert_int_equal(listen(t.listener, 4), 0);
	getsockname(t.listener, (struct sockaddr *)&a, &length);
	snprintf(t.address, sizeof t.address, "127.0.0.1:%d", ntohs(a.sin_port));
	const struct agent_config c = {
		.coordinator = t.address, .name = "w", .cache = folder, .cache_bytes = cache_bytes, .threads = 1};
	for (size_t i = 0; i < MESH; i++)
		t.mesh_bytes[i] = (unsigned char)(i * 7 + i / PIECE);
	make_file(&t.mesh, t.mesh_bytes, MESH);
	static const char *const scenes[] = {"one", "two", "three", "four"};
	for (int i = 0; i < 4; i++)
		make_file(&t.scenes[i], scenes[i], strlen(scenes[i]));
	assert_int_equal(agent_open(&t.agent, &c, &e), 0);
	welcome();
	assert_int_equal(hear()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
}

static void finish(void)
{
	hang_up();
	agent_close(t.agent);
	close(t.listener);
}

/* Jobs 1 to count, with their own files; whoever asked first has asked for the mesh. */
static void begin_jobs(uint64_t count)
{
	for (uint64_t j = 1; j <= count; j++)
		grant(j);
	for (uint64_t j = 1; j <= count; j++) {
		describe(j);
		hear_blob_get(&t.scenes[j - 1], 0);
	}
	for (uint64_t j = 1; j <= count; j++)
		send_piece(&t.scenes[j - 1], 0);
}

/* ---- tests ---- */

static void a_shared_file_comes_once(void **state)
{
	(void)state;
	start(0);
	begin_jobs(3);
	serve_mesh(0, PIECES);
	hear_built(3);
	hear_silence();
	finish();
}

/* The job that asked ends, then the others do; what was under way is nobody's, and is asked for anew by the next one.
 */
static void whoever_asked_may_go(void **state)
{
	(void)state;
	start(0);
	begin_jobs(2);
	serve_mesh(0, 1);
	hear_blob_get(&t.mesh, PIECE);
	end_job(1);
	send_piece(&t.mesh, PIECE);
	hear_blob_get(&t.mesh, 2 * PIECE);
	end_job(2);
	grant(3);
	send_piece(&t.mesh, 2 * PIECE); /* nobody wants it now, but it was asked for */
	describe(3);
	hear_blob_get(&t.scenes[2], 0);
	send_piece(&t.scenes[2], 0);
	serve_mesh(0, PIECES);
	hear_built(1);
	finish();
}

/* A job that comes while the piece of one that has ended is under way goes on with that. */
static void a_late_job_takes_over(void **state)
{
	(void)state;
	start(0);
	begin_jobs(1);
	serve_mesh(0, 2);
	hear_blob_get(&t.mesh, 2 * PIECE);
	grant(2);
	end_job(1);
	describe(2);
	hear_blob_get(&t.scenes[1], 0);
	send_piece(&t.scenes[1], 0);
	grant(3); /* what came before has been handled by now */
	send_piece(&t.mesh, 2 * PIECE);
	serve_mesh(3, PIECES);
	hear_built(1);
	finish();
}

static void a_new_connection_goes_on(void **state)
{
	(void)state;
	start(0);
	begin_jobs(2);
	serve_mesh(0, 2);
	hear_blob_get(&t.mesh, 2 * PIECE);
	hang_up();
	welcome();
	hear_job_get(2);
	hear_job_get(1);
	assert_int_equal(hear()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	describe(2);
	describe(1);
	serve_mesh(2, PIECES);
	hear_built(2);
	hang_up();
	welcome(); /* the jobs have gone, and with them what was fetched of nothing */
	assert_int_equal(hear()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	assert_null(t.agent->fetches);
	finish();
}

/* The coordinator knows nothing of leases of earlier connections, and grants as many as were requested each time. */
static void old_leases_do_not_pile_up(void **state)
{
	(void)state;
	start(0);
	for (uint64_t job = 1; job <= 25; job++) {
		grant(job);
		hang_up();
		welcome();
		while (hear()->body_case == FARM__ENVELOPE__BODY_JOB_GET)
			continue;
	}
	finish();
}

/* A coordinator that has lost its spool, and grants a lease of another job 1 before the worker knows: it gets it back,
 * and can grant it again. */
static void another_job_of_that_number(void **state)
{
	(void)state;
	start(0);
	begin_jobs(1);
	hear_blob_get(&t.mesh, 0);
	hang_up();
	welcome();
	hear_job_get(1);
	assert_int_equal(hear()->body_case, FARM__ENVELOPE__BODY_LEASE_REQUEST);
	say_grant(1);
	make_file(&t.scenes[0], "another", 7);
	describe(1);
	assert_int_equal(hear_failed(""), 1);
	assert_string_equal(t.at->env.message->lease_failed->text, "");
	grant(1);
	describe(1);
	hear_blob_get(&t.scenes[0], 0);
	send_piece(&t.scenes[0], 0);
	serve_mesh(0, PIECES);
	hear_built(1);
	finish();
}

/* Pieces that nobody asked for, or not now, or not there. */
static void what_was_not_asked_for_is_refused(void **state)
{
	(void)state;
	for (int i = 0; i < 3; i++) {
		start(0);
		begin_jobs(1);
		hear_blob_get(&t.mesh, 0);
		if (i == 0)
			send_piece(&t.scenes[3], 0);
		if (i == 1)
			send_piece(&t.mesh, PIECE);
		if (i == 2) {
			send_piece(&t.mesh, 0);
			send_piece(&t.mesh, 0);
			hear_blob_get(&t.mesh, PIECE);
		}
		assert_null(hear());
		finish();
		folder_tear_down(NULL);
		folder_set_up(NULL);
	}
}

static void lies_are_noticed(void **state)
{
	(void)state;
	start(0);
	begin_jobs(2);
	serve_mesh(0, PIECES - 1);
	hear_blob_get(&t.mesh, (PIECES - 1) * PIECE);
	t.mesh_bytes[MESH - 1] ^= 1;
	send_piece(&t.mesh, (PIECES - 1) * PIECE);
	t.mesh_bytes[MESH - 1] ^= 1;
	const uint64_t first = hear_failed("do not match the blob");
	serve_mesh(0, PIECES); /* the other one tries for itself */
	assert_int_equal(hear_failed("scene"), 3 - first);
	finish();
}

static void a_store_without_room_fails_each_once(void **state)
{
	(void)state;
	start(MESH - 1);
	begin_jobs(2);
	serve_mesh(0, 1);
	const uint64_t first = hear_failed("exceeds its limit");
	assert_false(t.own); /* it was set up so: no worker may have room for such a file */
	serve_mesh(0, 1);
	assert_int_equal(hear_failed("exceeds its limit"), 3 - first);
	hear_silence();
	finish();
}

static ssize_t write_nothing(int fd, const struct iovec *parts, int count, off_t at)
{
	(void)fd, (void)parts, (void)count, (void)at;
	errno = ENOSPC;
	return -1;
}

static void a_full_disk_is_its_own_fault(void **state)
{
	(void)state;
	struct disk full = disk_system;
	full.pwritev = write_nothing;
	start(0);
	begin_jobs(1);
	hear_blob_get(&t.mesh, 0);
	disk_use(&full);
	send_piece(&t.mesh, 0);
	assert_int_equal(hear_failed("No space left on device"), 1);
	assert_true(t.own);
	disk_use(NULL);
	grant(1); /* with room again it works */
	describe(1);
	serve_mesh(0, PIECES);
	hear_built(1);
	finish();
}

/* What was in the cache is there no more. */
static void a_lost_file_is_its_own_fault(void **state)
{
	(void)state;
	char command[128];
	start(0);
	begin_jobs(1);
	serve_mesh(0, PIECES - 1);
	hear_blob_get(&t.mesh, (PIECES - 1) * PIECE);
	snprintf(command, sizeof command, "rm -f '%s'/slot-0/[0-9a-f]???????*", folder);
	assert_int_equal(system(command), 0);
	send_piece(&t.mesh, (PIECES - 1) * PIECE);
	hear_failed("No such file");
	assert_true(t.own);
	finish();
}

#define TEST(f) cmocka_unit_test_setup_teardown(f, folder_set_up, folder_tear_down)

static void say_revoke(uint64_t job)
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

/* Two scenes that fit into memory only one after the other would end each rendering process, and neither job would ever
 * be done. */
static void one_scene_at_a_time_where_memory_was_short(void **state)
{
	struct error e;
	(void)state;
	assert_int_equal(work_share(1, &e), 0);
	for (int i = 0; i < 2; i++) {
		start(0);
		grant(1);
		grant(2);
		finish();
		work_lose(i == 0 ? SIGSEGV : SIGKILL); /* a fault of a scene; of the machine */
	}
	start(0);
	grant(1);
	say_grant(2);
	assert_int_equal(hear_failed("memory has no room for its scene beside that of j1"), 2);
	assert_true(t.own); /* which counts against no job */
	say_revoke(1);
	grant(2); /* the scene of j1 may be wanted again, but it is used by nobody */
	say_grant(1);
	assert_int_equal(hear_failed("beside that of j2"), 1);
	end_job(2);
	grant(1);
	finish();
}

/* Keeps the pool's only thread busy. */
static atomic_bool gate_open;
static void wait_at_gate(struct task *task)
{
	(void)task;
	while (!atomic_load(&gate_open))
		usleep(100);
}

/* The job's world is being built, and one of its first allocations fails. The job is the latest. */
static void run_out_of_memory(uint64_t job)
{
	struct task gate = {.run = wait_at_gate, .done = wait_at_gate /* which is open by then */};
	atomic_store(&gate_open, false);
	thread_pool_add(t.agent->thread_pool, &gate);
	describe(job);
	if (!blob_has(t.agent->cache.blobs, &t.scenes[job - 1].hash, NULL)) {
		hear_blob_get(&t.scenes[job - 1], 0);
		send_piece(&t.scenes[job - 1], 0);
	}
	while (t.agent->job_caches->job != job || t.agent->job_caches->state != JOB_CACHE_BUILDING)
		uv_run(&t.agent->loop, UV_RUN_NOWAIT);
	mem_fail_after(20);
	atomic_store(&gate_open, true);
	hear_failed("memory");
	mem_fail_after(-1);
}

/* As above, where the system refuses memory instead: the job whose scene found none beside another's is not at fault,
 * and one whose scene found none alone is. */
static void memory_that_others_had_is_its_own_fault(void **state)
{
	static const char text[] = "<scene version='3.0.0'>" SENSOR(
		"0,0,5", "0,0,0") "<shape type='sphere'/><emitter type='constant'/></scene>\n";
	struct error e;
	(void)state;
	assert_int_equal(work_share(1, &e), 0);
	start(0);
	make_file(&t.scenes[0], text, sizeof text - 1);
	make_file(&t.scenes[1], text, sizeof text - 2);
	grant(1);
	describe(1);
	hear_blob_get(&t.scenes[0], 0);
	send_piece(&t.scenes[0], 0);
	serve_mesh(0, PIECES);
	assert_int_equal(hear()->body_case, FARM__ENVELOPE__BODY_LEASE_RESULT);
	grant(2);
	run_out_of_memory(2);
	assert_true(t.own);
	say_grant(3);
	assert_int_equal(hear_failed("memory has no room for its scene beside that of j1"), 3);
	end_job(1);
	grant(2);
	run_out_of_memory(2);
	assert_false(t.own);
	finish();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(a_shared_file_comes_once),
		TEST(whoever_asked_may_go),
		TEST(a_late_job_takes_over),
		TEST(a_new_connection_goes_on),
		TEST(old_leases_do_not_pile_up),
		TEST(another_job_of_that_number),
		TEST(what_was_not_asked_for_is_refused),
		TEST(lies_are_noticed),
		TEST(a_store_without_room_fails_each_once),
		TEST(a_full_disk_is_its_own_fault),
		TEST(a_lost_file_is_its_own_fault),
		TEST(one_scene_at_a_time_where_memory_was_short), /* from here on: what work_share knows stays known */
		TEST(memory_that_others_had_is_its_own_fault),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
