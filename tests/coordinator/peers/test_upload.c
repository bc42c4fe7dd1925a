/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A scene of many small files: the loop's thread flushes none of them, the job is acknowledged once all are flushed,
 * and what a client that disconnects midway has sent is removed. Room for files goes to the clients that send them:
 * neither an announcement nor a part of a file keeps others waiting for long.
 */
#include "common/base/disk.h"
#include "coordinator/jobs/room.h"
#include "tests/support/served.h"

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
static struct flushes {
	_Atomic unsigned on_loop, elsewhere;
	_Atomic unsigned looks_at_once; /* most file accesses in one turn of the loop */
	_Atomic unsigned touched_at_once, removed_at_once, removed;
	_Atomic bool hold;     /* flushes of files wait */
	_Atomic unsigned from; /* flushes from this number on wait; 0: none */
	_Atomic uint64_t room; /* free bytes that the disk reports; 0: those of the real disk */
} * flushes;

static int counted_fsync(int fd)
{
	if (gettid() == getpid())
		flushes->on_loop++;
	else
		flushes->elsewhere++;
	while ((flushes->hold || (flushes->from && flushes->elsewhere >= flushes->from)) && gettid() != getpid())
		usleep(1000);
	return fsync(fd);
}

static int counted_stat(const char *path, struct stat *st)
{
	static unsigned turn, looks;
	looks = turn == served_turn() ? looks + 1 : 1;
	turn = served_turn();
	if (looks > flushes->looks_at_once)
		flushes->looks_at_once = looks;
	return disk_system.stat(path, st);
}

/* Counts one more call of a kind of which one turn of the loop may make only a few. */
static void count_in_turn(unsigned *turn, unsigned *count, _Atomic unsigned *most)
{
	*count = *turn == served_turn() ? *count + 1 : 1;
	*turn = served_turn();
	if (*count > *most)
		*most = *count;
}

static int counted_touch(const char *path)
{
	static unsigned turn, count;
	count_in_turn(&turn, &count, &flushes->touched_at_once);
	return disk_system.touch(path);
}

static int counted_unlink(const char *path)
{
	static unsigned turn, count;
	if (strstr(path, "/blobs/") && gettid() == getpid()) {
		count_in_turn(&turn, &count, &flushes->removed_at_once);
		flushes->removed++;
	}
	return unlink(path);
}

static uint64_t set_room(const char *path)
{
	return flushes->room ? flushes->room : disk_system.available(path);
}

static void count_flushes(const char *spool)
{
	(void)spool;
	static struct disk counted;
	counted = disk_system;
	counted.fsync = counted_fsync;
	counted.stat = counted_stat;
	counted.touch = counted_touch;
	counted.unlink = counted_unlink;
	counted.available = set_room;
	disk_use(&counted);
}

/* Files from before a restart, when the limit was higher: all but 64 of them exceed the new limit. */
enum { STORED = 500, STORED_BYTES = 1 << 14, STORED_LEFT = (1 << 20) / STORED_BYTES };
static void store_too_much(const char *spool)
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
	count_flushes(spool);
}

static void share_flushes(void)
{
	flushes = mmap(NULL, sizeof *flushes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	assert_true(flushes != MAP_FAILED);
}

static int set_up_for(double stall_seconds)
{
	share_flushes();
	served_prepare(count_flushes);
	return served_start(60, 60, stall_seconds);
}

static int set_up(void **state)
{
	(void)state;
	return set_up_for(60);
}

static int set_up_with_too_much(void **state)
{
	(void)state;
	share_flushes();
	served_prepare(store_too_much);
	return served_start(60, 60, 60);
}

static int tear_down(void **state)
{
	flushes->hold = false; /* a failed test would leave the server waiting for ever */
	flushes->from = 0;
	munmap(flushes, sizeof *flushes);
	return served_stop(state);
}

static bool alike; /* all files but the scene have the same content */

static void text_of(int i, char text[32])
{
	snprintf(text, 32, i ? "v %d 0 0\n" : "<scene/>", alike && i ? 7 : i);
}

/* Submits a scene file and FILES - 1 files of a few bytes. */
static void submit_many(struct scripted *client)
{
	static Farm__File files[FILES], *list[FILES];
	static struct blob_hash hashes[FILES];
	static char names[FILES][16];
	struct error e;
	char text[32], name[] = "many", scene[] = "0";
	Farm__Submit s;
	Farm__PlanRequest plan;
	Farm__Envelope m;
	struct plan_request r = peer_plan_request(NULL);
	plan_request_to_wire(&r, &plan);
	farm__submit__init(&s);
	farm__envelope__init(&m);
	for (int i = 0; i < FILES; i++) {
		text_of(i, text);
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
	peer_say(client, &m, NULL, 0);
}

static void send_files(struct scripted *client, int from, int end)
{
	for (int i = from; i < end; i++) {
		char text[32];
		text_of(i, text);
		peer_send_blob(client, text, text);
	}
}

static void send_missing(struct scripted *client, const Farm__SubmitAnswer *a)
{
	bool missing[FILES] = {false};
	char text[32];
	struct blob_hash h;
	struct error e;
	for (int i = 0; i < FILES; i++) {
		text_of(i, text);
		assert_int_equal(blob_hash_bytes(text, strlen(text), &h, &e), 0);
		for (size_t k = 0; k < a->n_missing && !missing[i]; k++)
			missing[i] = memcmp(a->missing[k].data, h.bytes, BLOB_HASH_SIZE) == 0;
	}
	for (int i = 0; i < FILES; i++)
		if (missing[i])
			send_files(client, i, i + 1);
}

static struct scripted *call_client(void)
{
	struct scripted *client = peer_call();
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	return client;
}

static void the_loop_flushes_no_file(void **state)
{
	(void)state;
	struct scripted *client = call_client();
	submit_many(client);
	assert_int_equal(peer_submit_answer(client)->n_missing, FILES);
	unsigned before = flushes->on_loop;
	send_files(client, 0, FILES - 1);
	peer_say_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	const Farm__Envelope *m = scripted_hear(client);
	assert_int_equal(m->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	assert_int_equal(m->job_list_answer->n_jobs, 0);
	send_files(client, FILES - 1, FILES);
	assert_int_equal(peer_submit_answer(client)->job, 1);
	assert_in_range(flushes->on_loop - before, 0, 20); /* the files of the job itself */
	assert_in_range(flushes->elsewhere, FILES, 3 * FILES);
	submit_many(client);
	assert_int_equal(peer_submit_answer(client)->job, 2); /* no file is missing */
	assert_in_range(flushes->looks_at_once, 1, FILES / 2);
	assert_in_range(flushes->touched_at_once, 0, FILES / 2);
	struct scripted *other = call_client(); /* and two clients at once, one of which gives up */
	submit_many(client);
	submit_many(other);
	scripted_hang_up(other);
	assert_int_equal(peer_submit_answer(client)->job >= 3, true);
	scripted_hang_up(client);
}

/* Files are deleted in pieces, and the loop answers peers between these. */
static void a_smaller_limit_is_reached_in_pieces(void **state)
{
	(void)state;
	served_still_works();
	for (int i = 0; i < 6000 && flushes->removed < STORED - STORED_LEFT; i++)
		usleep(10000);
	served_still_works();
	assert_int_equal(flushes->removed, STORED - STORED_LEFT);
	assert_in_range(flushes->removed_at_once, 1, STORED / 5);
}

static unsigned count_temporary_files(void)
{
	char command[128], line[32] = "";
	snprintf(command, sizeof command, "find %s/spool -name 'tmp.*' | wc -l", served_folder());
	FILE *f = popen(command, "r");
	assert_non_null(f);
	assert_non_null(fgets(line, sizeof line, f));
	pclose(f);
	return (unsigned)atoi(line);
}

static void who_goes_midway_leaves_nothing(void **state)
{
	(void)state;
	struct scripted *client = call_client();
	submit_many(client);
	assert_int_equal(peer_submit_answer(client)->n_missing, FILES);
	send_files(client, 0, FILES / 2);
	scripted_hang_up(client);
	served_works_again();
	for (int i = 0; i < 6000 && count_temporary_files(); i++)
		usleep(10000);
	assert_int_equal(count_temporary_files(), 0);
	client = call_client();
	submit_many(client);
	send_missing(client, peer_submit_answer(client));
	assert_int_equal(peer_submit_answer(client)->job, 1);
	scripted_hang_up(client);
}

/* Returns a client that has sent half a scene, the first file of which is being flushed; nearly all other files will be
 * flushed together. */
static struct scripted *sends_half(void)
{
	struct scripted *client = call_client();
	submit_many(client);
	assert_int_equal(peer_submit_answer(client)->n_missing, FILES);
	flushes->hold = true;
	send_files(client, 0, FILES / 2);
	peer_say_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
	assert_int_equal(scripted_hear(client)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	return client;
}

/* While the first file is flushed, all other files of half a scene have arrived. */
static void the_loop_removes_few_files(void **state)
{
	(void)state;
	struct scripted *client = sends_half();
	scripted_hang_up(client);
	served_works_again();
	assert_in_range(count_temporary_files(), FILES / 2, FILES);
	flushes->hold = false;
	for (int i = 0; i < 6000 && count_temporary_files(); i++)
		usleep(10000);
	assert_int_equal(count_temporary_files(), 0);
	served_still_works();
	assert_in_range(flushes->removed, 0, 10);
	/* The files whose client has gone are in the store. */
	client = call_client();
	submit_many(client);
	assert_in_range(peer_submit_answer(client)->n_missing, FILES / 2, FILES - 1);
	scripted_hang_up(client);
}

/* A client that hangs up does not keep a thread of the pool busy with the rest of thousands of files. */
static void nobody_flushes_for_nobody(void **state)
{
	(void)state;
	struct scripted *client = sends_half();
	flushes->from = flushes->elsewhere + 20;
	flushes->hold = false;
	for (int i = 0; i < 6000 && flushes->elsewhere < flushes->from; i++)
		usleep(10000);
	assert_int_equal(flushes->elsewhere, flushes->from);
	scripted_hang_up(client);
	served_works_again();
	unsigned before = flushes->elsewhere;
	flushes->from = 0;
	for (int i = 0; i < 6000 && count_temporary_files(); i++)
		usleep(10000);
	assert_int_equal(count_temporary_files(), 0);
	assert_in_range(flushes->elsewhere - before, 0, FILES / 10);
	served_still_works();
}

/* Each file is sent once. */
static void a_file_that_was_sent_is_not_taken_again(void **state)
{
	(void)state;
	struct scripted *client = call_client();
	submit_many(client);
	assert_int_equal(peer_submit_answer(client)->n_missing, FILES);
	send_files(client, 0, 1);
	send_files(client, 0, 1);
	const Farm__SubmitAnswer *a = peer_submit_answer(client);
	assert_int_equal(a->job, 0);
	assert_non_null(strstr(a->refusal, "not requested"));
	scripted_hang_up(client);
}

/* The disk has room for the films and for both files, or for one byte less. */
static void equal_files_need_room_once(void **state)
{
	(void)state;
	struct plan_request r = peer_plan_request(NULL);
	struct plan plan;
	struct error e;
	struct scripted *client = call_client();
	assert_int_equal(plan_make(&r, &plan, &e), 0);
	flushes->room = canvas_bytes(&plan) + strlen("<scene/>") + strlen("v 7 0 0\n");
	alike = true;
	submit_many(client);
	assert_int_equal(peer_submit_answer(client)->n_missing, 2);
	scripted_hang_up(client);
	flushes->room--;
	client = call_client();
	submit_many(client);
	assert_non_null(strstr(peer_submit_answer(client)->refusal, "it may need"));
	alike = false;
	scripted_hang_up(client);
}

static void send_part(struct scripted *p, const char *text, size_t from, size_t to)
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
	c.offset = from;
	m.body_case = FARM__ENVELOPE__BODY_BLOB_CHUNK;
	m.blob_chunk = &c;
	peer_say(p, &m, text + from, to - from);
}

/* Clients that stop midway hold no file descriptors, however many they are. */
static void half_a_file_is_not_open(void **state)
{
	(void)state;
	static const char text[] = "<scene version='3.0.0'/>";
	struct scripted *client = peer_call();
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	peer_submit(client, NULL, text, "s.xml", "s.xml");
	assert_int_equal(peer_submit_answer(client)->n_missing, 1);
	for (size_t i = 0; i < 5; i++) { /* the first client has sent no bytes */
		send_part(client, text, i ? i - 1 : 0, i);
		peer_say_empty(client, FARM__ENVELOPE__BODY_JOB_LIST);
		assert_int_equal(scripted_hear(client)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
		assert_int_equal(served_open_files("/blobs/"), 0);
	}
	send_part(client, text, 4, strlen(text));
	assert_true(peer_submit_answer(client)->job);
	scripted_hang_up(client);
}

/* Returns a file of more than half the free space; its first bytes depend on the letter. */
static const char *large_file(char letter)
{
	static char text[(600 << 10) + 1];
	memset(text, letter, sizeof text - 1);
	return text;
}

static const size_t LARGE = 600 << 10;

static struct scripted *submit_file(char letter)
{
	struct scripted *client = call_client();
	peer_submit(client, NULL, large_file(letter), "s.xml", "s.xml");
	assert_int_equal(peer_submit_answer(client)->n_missing, 1);
	return client;
}

static void is_refused(struct scripted *client, const char *why)
{
	const Farm__SubmitAnswer *a = peer_submit_answer(client);
	assert_int_equal(a->job, 0);
	assert_non_null(strstr(a->refusal, why));
}

static void announcements_take_no_room(void **state)
{
	(void)state;
	struct scripted *idle = submit_file('a'), *client = submit_file('b');
	send_part(idle, large_file('a'), 0, 0);
	peer_say_empty(idle, FARM__ENVELOPE__BODY_JOB_LIST);
	assert_int_equal(scripted_hear(idle)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	send_part(client, large_file('b'), 0, LARGE);
	assert_int_equal(peer_submit_answer(client)->job, 1);
	scripted_hang_up(client);
	scripted_hang_up(idle);
}

/* Both files are half sent, and there is room to complete only one. */
static void who_came_first_has_room(void **state)
{
	(void)state;
	struct scripted *first = submit_file('a');
	usleep(20000);
	struct scripted *second = submit_file('b');
	send_part(first, large_file('a'), 0, LARGE / 2);
	send_part(second, large_file('b'), 0, LARGE - 1);
	peer_say_empty(second, FARM__ENVELOPE__BODY_JOB_LIST);
	assert_int_equal(scripted_hear(second)->body_case, FARM__ENVELOPE__BODY_JOB_LIST_ANSWER);
	send_part(first, large_file('a'), LARGE / 2, LARGE);
	is_refused(second, "begun earlier");
	assert_int_equal(peer_submit_answer(first)->job, 1);
	peer_submit(second, NULL, large_file('b'), "s.xml", "s.xml"); /* the job has its file now */
	assert_int_equal(peer_submit_answer(second)->n_missing, 1);
	send_part(second, large_file('b'), 0, LARGE);
	is_refused(second, "limit");
	scripted_hang_up(second);
	scripted_hang_up(first);
}

static int set_up_impatient(void **state)
{
	(void)state;
	return set_up_for(0.5);
}

static void who_stands_still_has_none(void **state)
{
	(void)state;
	struct scripted *idle = submit_file('a'), *client = call_client();
	const Farm__SubmitAnswer *a = NULL;
	send_part(idle, large_file('a'), 0, LARGE - 1);
	for (int i = 0; i < 600 && !(a && a->job); i++) {
		usleep(100000);
		peer_submit(client, NULL, large_file('b'), "s.xml", "s.xml");
		assert_int_equal(peer_submit_answer(client)->n_missing, 1);
		send_part(client, large_file('b'), 0, LARGE);
		a = peer_submit_answer(client);
	}
	assert_int_equal(a->job, 1);
	is_refused(idle, "too slowly");
	scripted_hang_up(client);
	scripted_hang_up(idle);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(the_loop_flushes_no_file, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_smaller_limit_is_reached_in_pieces, set_up_with_too_much, tear_down),
		cmocka_unit_test_setup_teardown(who_goes_midway_leaves_nothing, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_loop_removes_few_files, set_up, tear_down),
		cmocka_unit_test_setup_teardown(nobody_flushes_for_nobody, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_file_that_was_sent_is_not_taken_again, set_up, tear_down),
		cmocka_unit_test_setup_teardown(equal_files_need_room_once, set_up, tear_down),
		cmocka_unit_test_setup_teardown(half_a_file_is_not_open, set_up, tear_down),
		cmocka_unit_test_setup_teardown(announcements_take_no_room, set_up, tear_down),
		cmocka_unit_test_setup_teardown(who_came_first_has_room, set_up, tear_down),
		cmocka_unit_test_setup_teardown(who_stands_still_has_none, set_up_impatient, tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
