/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A scene of many small files: the loop's thread flushes none of them, the job is acknowledged once all are flushed,
 * and what a client that disconnects midway has sent is removed. Room for files goes to the clients that send them:
 * neither an announcement nor a part of a file keeps others waiting for long.
 */
#include "common/base/disk.h"
#include "coordinator/jobs/storage.h"
#include "tests/support/child_server.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { FILES = 400 };

/* Shared with the server. */
static struct disk_control {
	_Atomic unsigned loop_flushes, pool_flushes;
	_Atomic unsigned max_looks_per_turn; /* most file accesses in one turn of the loop */
	_Atomic unsigned max_touches_per_turn, max_removals_per_turn, removal_count;
	_Atomic bool hold_flushes;	   /* flushes of files wait */
	_Atomic unsigned first_held_flush; /* flushes from this number on wait; 0: none */
	_Atomic uint64_t available_bytes;  /* free bytes that the disk reports; 0: those of the real disk */
} * disk_control;

static int counted_fsync(int fd)
{
	if (gettid() == getpid())
		disk_control->loop_flushes++;
	else
		disk_control->pool_flushes++;
	while ((disk_control->hold_flushes ||
		(disk_control->first_held_flush && disk_control->pool_flushes >= disk_control->first_held_flush)) &&
	       gettid() != getpid())
		usleep(1000);
	return fsync(fd);
}

static int counted_stat(const char *path, struct stat *st)
{
	static unsigned turn, looks;
	looks = turn == child_server_turn_count() ? looks + 1 : 1;
	turn = child_server_turn_count();
	if (looks > disk_control->max_looks_per_turn)
		disk_control->max_looks_per_turn = looks;
	return disk_system.stat(path, st);
}

/* Counts one more call of a kind of which one turn of the loop may make only a few. */
static void count_in_turn(unsigned *turn, unsigned *count, _Atomic unsigned *max)
{
	*count = *turn == child_server_turn_count() ? *count + 1 : 1;
	*turn = child_server_turn_count();
	if (*count > *max)
		*max = *count;
}

static int counted_touch(const char *path)
{
	static unsigned turn, count;
	count_in_turn(&turn, &count, &disk_control->max_touches_per_turn);
	return disk_system.touch(path);
}

static int counted_unlink(const char *path)
{
	static unsigned turn, count;
	if (strstr(path, "/blobs/") && gettid() == getpid()) {
		count_in_turn(&turn, &count, &disk_control->max_removals_per_turn);
		disk_control->removal_count++;
	}
	return unlink(path);
}

static uint64_t reported_available(const char *path)
{
	return disk_control->available_bytes ? disk_control->available_bytes : disk_system.available(path);
}

static void use_counting_disk(const char *spool)
{
	(void)spool;
	static struct disk counted;
	counted = disk_system;
	counted.fsync = counted_fsync;
	counted.stat = counted_stat;
	counted.touch = counted_touch;
	counted.unlink = counted_unlink;
	counted.available = reported_available;
	disk_set_calls(&counted);
}

/* Files from before a restart, when the limit was higher: all but 64 of them exceed the new limit. */
enum { STORED = 500, STORED_BYTES = 1 << 14, STORED_REMAINING = (1 << 20) / STORED_BYTES };
static void store_excess_files(const char *spool)
{
	char path[256];
	mkdir(spool, 0700);
	snprintf(path, sizeof path, "%s/blobs", spool);
	mkdir(path, 0700);
	for (int i = 0; i < STORED; i++) {
		snprintf(path, sizeof path, "%s/blobs/%064x", spool, i);
		FILE *f = fopen(path, "w");
		if (!f || ftruncate(fileno(f), STORED_BYTES) || fclose(f))
			_exit(1);
	}
	use_counting_disk(spool);
}

static void share_disk_control(void)
{
	disk_control = mmap(NULL, sizeof *disk_control, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	assert_true(disk_control != MAP_FAILED);
}

static int set_up_with_stall_limit(double stall_seconds)
{
	share_disk_control();
	child_server_set_spool_maker(use_counting_disk);
	return child_server_start(60, 60, stall_seconds);
}

static int set_up(void **state)
{
	(void)state;
	return set_up_with_stall_limit(60);
}

static int set_up_with_excess_files(void **state)
{
	(void)state;
	share_disk_control();
	child_server_set_spool_maker(store_excess_files);
	return child_server_start(60, 60, 60);
}

static int tear_down(void **state)
{
	disk_control->hold_flushes = false; /* a failed test would leave the server waiting for ever */
	disk_control->first_held_flush = 0;
	munmap(disk_control, sizeof *disk_control);
	return child_server_stop(state);
}

static bool files_are_alike; /* all files but the scene have the same content */

static void make_file_text(int i, char text[32])
{
	snprintf(text, 32, i ? "v %d 0 0\n" : "<scene/>", files_are_alike && i ? 7 : i);
}

/* Submits a scene file and FILES - 1 files of a few bytes. */
static void submit_scene(struct scripted_peer *client)
{
	static Farm__File files[FILES], *list[FILES];
	static struct blob_hash hashes[FILES];
	static char names[FILES][16];
	struct error e;
	char text[32], name[] = "many", scene[] = "0";
	Farm__Submit s;
	Farm__PlanRequest plan;
	Farm__Envelope m;
	struct plan_request r = child_server_plan_request(NULL);
	plan_request_to_wire(&r, &plan);
	farm__submit__init(&s);
	farm__envelope__init(&m);
	for (int i = 0; i < FILES; i++) {
		make_file_text(i, text);
		snprintf(names[i], sizeof names[i], "%d", i);
		assert_int_equal(blob_hash_bytes(text, strlen(text), &hashes[i], &e), 0);
		farm__file__init(&files[i]);
		files[i].name = names[i];
		files[i].hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hashes[i].bytes};
		files[i].size = strlen(text);
		list[i] = &files[i];
	}
	s.name = name;
	s.scene = scene;
	s.plan = &plan;
	s.n_files = FILES;
	s.files = list;
	m.body_case = FARM__ENVELOPE__BODY_SUBMIT;
	m.submit = &s;
	child_server_send(client, &m, NULL, 0);
}

static void send_files(struct scripted_peer *client, int begin, int end)
{
	for (int i = begin; i < end; i++) {
		char text[32];
		make_file_text(i, text);
		child_server_send_blob(client, text, text);
	}
}

static void send_missing(struct scripted_peer *client, const Farm__SubmitAnswer *a)
{
	bool missing[FILES] = {false};
	char text[32];
	struct blob_hash h;
	struct error e;
	for (int i = 0; i < FILES; i++) {
		make_file_text(i, text);
		assert_int_equal(blob_hash_bytes(text, strlen(text), &h, &e), 0);
		for (size_t k = 0; k < a->n_missing && !missing[i]; k++)
			missing[i] = memcmp(a->missing[k].data, h.bytes, BLOB_HASH_SIZE) == 0;
	}
	for (int i = 0; i < FILES; i++)
		if (missing[i])
			send_files(client, i, i + 1);
}

static struct scripted_peer *connect_client(void)
{
	struct scripted_peer *client = child_server_connect();
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	return client;
}

static void loop_thread_flushes_no_file(void **state)
{
	(void)state;
	struct scripted_peer *client = connect_client();
	submit_scene(client);
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, FILES);
	unsigned before = disk_control->loop_flushes;
	send_files(client, 0, FILES - 1);
	child_server_send_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_peer_receive(client);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	assert_int_equal(m->job_list_answer->n_jobs, 0);
	send_files(client, FILES - 1, FILES);
	assert_int_equal(child_server_receive_submit_answer(client)->job, 1);
	assert_in_range(disk_control->loop_flushes - before, 0, 20); /* the files of the job itself */
	assert_in_range(disk_control->pool_flushes, FILES, 3 * FILES);
	submit_scene(client);
	assert_int_equal(child_server_receive_submit_answer(client)->job, 2); /* no file is missing */
	assert_in_range(disk_control->max_looks_per_turn, 1, FILES / 2);
	assert_in_range(disk_control->max_touches_per_turn, 0, FILES / 2);
	struct scripted_peer *other = connect_client(); /* and two clients at once, one of which gives up */
	submit_scene(client);
	submit_scene(other);
	scripted_peer_disconnect(other);
	assert_int_equal(child_server_receive_submit_answer(client)->job >= 3, true);
	scripted_peer_disconnect(client);
}

/* Files are deleted in pieces, and the loop answers peers between these. */
static void smaller_limit_is_reached_in_pieces(void **state)
{
	(void)state;
	child_server_check_answers();
	for (int i = 0; i < 6000 && disk_control->removal_count < STORED - STORED_REMAINING; i++)
		usleep(10000);
	child_server_check_answers();
	assert_int_equal(disk_control->removal_count, STORED - STORED_REMAINING);
	assert_in_range(disk_control->max_removals_per_turn, 1, STORED / 5);
}

static unsigned count_temporary_files(void)
{
	char command[128], line[32] = "";
	snprintf(command, sizeof command, "find %s/spool -name 'tmp.*' | wc -l", child_server_folder());
	FILE *f = popen(command, "r");
	assert_non_null(f);
	assert_non_null(fgets(line, sizeof line, f));
	pclose(f);
	return (unsigned)atoi(line);
}

static void client_that_leaves_midway_leaves_no_files(void **state)
{
	(void)state;
	struct scripted_peer *client = connect_client();
	submit_scene(client);
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, FILES);
	send_files(client, 0, FILES / 2);
	scripted_peer_disconnect(client);
	child_server_await_answers();
	for (int i = 0; i < 6000 && count_temporary_files(); i++)
		usleep(10000);
	assert_int_equal(count_temporary_files(), 0);
	client = connect_client();
	submit_scene(client);
	send_missing(client, child_server_receive_submit_answer(client));
	assert_int_equal(child_server_receive_submit_answer(client)->job, 1);
	scripted_peer_disconnect(client);
}

/* Returns a client that has sent half a scene, the first file of which is being flushed; nearly all other files will be
 * flushed together. */
static struct scripted_peer *send_half_a_scene(void)
{
	struct scripted_peer *client = connect_client();
	submit_scene(client);
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, FILES);
	disk_control->hold_flushes = true;
	send_files(client, 0, FILES / 2);
	child_server_send_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	assert_int_equal(scripted_peer_receive(client)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	return client;
}

/* While the first file is flushed, all other files of half a scene have arrived. */
static void loop_thread_removes_few_files(void **state)
{
	(void)state;
	struct scripted_peer *client = send_half_a_scene();
	scripted_peer_disconnect(client);
	child_server_await_answers();
	assert_in_range(count_temporary_files(), FILES / 2, FILES);
	disk_control->hold_flushes = false;
	for (int i = 0; i < 6000 && count_temporary_files(); i++)
		usleep(10000);
	assert_int_equal(count_temporary_files(), 0);
	child_server_check_answers();
	assert_in_range(disk_control->removal_count, 0, 10);
	/* The files whose client has gone are in the store. */
	client = connect_client();
	submit_scene(client);
	assert_in_range(child_server_receive_submit_answer(client)->n_missing, FILES / 2, FILES - 1);
	scripted_peer_disconnect(client);
}

/* A client that hangs up does not keep a thread of the pool busy with the rest of thousands of files. */
static void files_of_a_client_that_left_are_not_flushed(void **state)
{
	(void)state;
	struct scripted_peer *client = send_half_a_scene();
	disk_control->first_held_flush = disk_control->pool_flushes + 20;
	disk_control->hold_flushes = false;
	for (int i = 0; i < 6000 && disk_control->pool_flushes < disk_control->first_held_flush; i++)
		usleep(10000);
	assert_int_equal(disk_control->pool_flushes, disk_control->first_held_flush);
	scripted_peer_disconnect(client);
	child_server_await_answers();
	unsigned before = disk_control->pool_flushes;
	disk_control->first_held_flush = 0;
	for (int i = 0; i < 6000 && count_temporary_files(); i++)
		usleep(10000);
	assert_int_equal(count_temporary_files(), 0);
	assert_in_range(disk_control->pool_flushes - before, 0, FILES / 10);
	child_server_check_answers();
}

/* Each file is sent once. */
static void file_sent_twice_is_refused(void **state)
{
	(void)state;
	struct scripted_peer *client = connect_client();
	submit_scene(client);
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, FILES);
	send_files(client, 0, 1);
	send_files(client, 0, 1);
	const Farm__SubmitAnswer *a = child_server_receive_submit_answer(client);
	assert_int_equal(a->job, 0);
	assert_non_null(strstr(a->refusal, "not requested"));
	scripted_peer_disconnect(client);
}

/* The disk has room for the films and for both files, or for one byte less. */
static void equal_files_need_room_once(void **state)
{
	(void)state;
	struct plan_request r = child_server_plan_request(NULL);
	struct plan plan;
	struct error e;
	struct scripted_peer *client = connect_client();
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	disk_control->available_bytes = canvas_bytes(&plan) + strlen("<scene/>") + strlen("v 7 0 0\n");
	files_are_alike = true;
	submit_scene(client);
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, 2);
	scripted_peer_disconnect(client);
	disk_control->available_bytes--;
	client = connect_client();
	submit_scene(client);
	assert_non_null(strstr(child_server_receive_submit_answer(client)->refusal, "it may need"));
	files_are_alike = false;
	scripted_peer_disconnect(client);
}

static void send_part(struct scripted_peer *p, const char *text, size_t begin, size_t end)
{
	Farm__BlobChunk c;
	Farm__Envelope m;
	struct blob_hash hash;
	struct error e;
	assert_int_equal(blob_hash_bytes(text, strlen(text), &hash, &e), 0);
	farm__blob_chunk__init(&c);
	farm__envelope__init(&m);
	c.hash = (ProtobufCBinaryData){BLOB_HASH_SIZE, hash.bytes};
	c.size = strlen(text);
	c.offset = begin;
	m.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
	m.blob_chunk = &c;
	child_server_send(p, &m, text + begin, end - begin);
}

/* Clients that stop midway hold no file descriptors, however many they are. */
static void incomplete_file_holds_no_descriptor(void **state)
{
	(void)state;
	static const char text[] = "<scene version='3.0.0'/>";
	struct scripted_peer *client = child_server_connect();
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	child_server_submit(client, NULL, text, "s.xml", "s.xml");
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, 1);
	for (size_t i = 0; i < 5; i++) { /* the first client has sent no bytes */
		send_part(client, text, i ? i - 1 : 0, i);
		child_server_send_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
		assert_int_equal(scripted_peer_receive(client)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
		assert_int_equal(child_server_open_file_count("/blobs/"), 0);
	}
	send_part(client, text, 4, strlen(text));
	assert_true(child_server_receive_submit_answer(client)->job);
	scripted_peer_disconnect(client);
}

/* Returns a file of more than half the free space; its first bytes depend on the letter. */
static const char *large_file_text(char letter)
{
	static char text[(600 << 10) + 1];
	memset(text, letter, sizeof text - 1);
	return text;
}

static const size_t LARGE = 600 << 10;

static struct scripted_peer *submit_file(char letter)
{
	struct scripted_peer *client = connect_client();
	child_server_submit(client, NULL, large_file_text(letter), "s.xml", "s.xml");
	assert_int_equal(child_server_receive_submit_answer(client)->n_missing, 1);
	return client;
}

static void expect_refusal(struct scripted_peer *client, const char *why)
{
	const Farm__SubmitAnswer *a = child_server_receive_submit_answer(client);
	assert_int_equal(a->job, 0);
	assert_non_null(strstr(a->refusal, why));
}

static void announcements_take_no_room(void **state)
{
	(void)state;
	struct scripted_peer *idle = submit_file('a'), *client = submit_file('b');
	send_part(idle, large_file_text('a'), 0, 0);
	child_server_send_empty(idle, FARM__ENVELOPE__BODY_JOB_LIST);
	assert_int_equal(scripted_peer_receive(idle)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	send_part(client, large_file_text('b'), 0, LARGE);
	assert_int_equal(child_server_receive_submit_answer(client)->job, 1);
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(idle);
}

/* Both files are half sent, and there is room to complete only one. */
static void upload_begun_first_gets_the_room(void **state)
{
	(void)state;
	struct scripted_peer *first = submit_file('a');
	usleep(20000);
	struct scripted_peer *second = submit_file('b');
	send_part(first, large_file_text('a'), 0, LARGE / 2);
	send_part(second, large_file_text('b'), 0, LARGE - 1);
	child_server_send_empty(second, FARM__ENVELOPE__BODY_JOB_LIST);
	assert_int_equal(scripted_peer_receive(second)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	send_part(first, large_file_text('a'), LARGE / 2, LARGE);
	expect_refusal(second, "begun earlier");
	assert_int_equal(child_server_receive_submit_answer(first)->job, 1);
	child_server_submit(second, NULL, large_file_text('b'), "s.xml", "s.xml"); /* the job has its file now */
	assert_int_equal(child_server_receive_submit_answer(second)->n_missing, 1);
	send_part(second, large_file_text('b'), 0, LARGE);
	expect_refusal(second, "limit");
	scripted_peer_disconnect(second);
	scripted_peer_disconnect(first);
}

static int set_up_with_short_stall_limit(void **state)
{
	(void)state;
	return set_up_with_stall_limit(0.5);
}

static void stalled_upload_loses_its_room(void **state)
{
	(void)state;
	struct scripted_peer *idle = submit_file('a'), *client = connect_client();
	const Farm__SubmitAnswer *a = NULL;
	send_part(idle, large_file_text('a'), 0, LARGE - 1);
	for (int i = 0; i < 600 && !(a && a->job); i++) {
		usleep(100000);
		child_server_submit(client, NULL, large_file_text('b'), "s.xml", "s.xml");
		assert_int_equal(child_server_receive_submit_answer(client)->n_missing, 1);
		send_part(client, large_file_text('b'), 0, LARGE);
		a = child_server_receive_submit_answer(client);
	}
	assert_int_equal(a->job, 1);
	expect_refusal(idle, "too slowly");
	scripted_peer_disconnect(client);
	scripted_peer_disconnect(idle);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(loop_thread_flushes_no_file, set_up, tear_down),
		cmocka_unit_test_setup_teardown(smaller_limit_is_reached_in_pieces, set_up_with_excess_files,
						tear_down),
		cmocka_unit_test_setup_teardown(client_that_leaves_midway_leaves_no_files, set_up, tear_down),
		cmocka_unit_test_setup_teardown(loop_thread_removes_few_files, set_up, tear_down),
		cmocka_unit_test_setup_teardown(files_of_a_client_that_left_are_not_flushed, set_up, tear_down),
		cmocka_unit_test_setup_teardown(file_sent_twice_is_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(equal_files_need_room_once, set_up, tear_down),
		cmocka_unit_test_setup_teardown(incomplete_file_holds_no_descriptor, set_up, tear_down),
		cmocka_unit_test_setup_teardown(announcements_take_no_room, set_up, tear_down),
		cmocka_unit_test_setup_teardown(upload_begun_first_gets_the_room, set_up, tear_down),
		cmocka_unit_test_setup_teardown(stalled_upload_loses_its_room, set_up_with_short_stall_limit,
						tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
