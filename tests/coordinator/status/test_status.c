/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The status of a farm that keeps many ended jobs: snapshots stay small, and what they leave out can be asked for; a
 * slow reader misses snapshots but is not cut off; the loop does not wait while they are made; and changes are not
 * delayed by clients that reconnect again and again. One server serves all tests.
 */
#include "coordinator/store/ledger.h"
#include "tests/support/served.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

enum { ENDED = 300, LISTED = 50, SUBMITTED = 40 };

/* A record of the largest size in practice, with 24 effects. */
static void fill_record(struct job_record *r, uint64_t id)
{
	json_t *effects = json_array();
	record_begin(r, id, "finished", "");
	strcpy(r->state, "done");
	r->submitted = r->ended = (double)id;
	r->ended_seen = 0;
	for (int i = 0; i < 24; i++)
		json_array_append_new(effects, json_pack("{s:s s:b s:s s:s}", "name", "an effect", "on", 1, "why",
							 "it takes a long sentence to say why", "saves",
							 "and another one to say what leaving it out would save"));
	record_take_effects(r, effects);
}

static void make_spool(const char *path)
{
	struct ledger *l;
	struct error e;
	struct job_record *r = calloc(1, sizeof *r);
	assert_non_null(r);
	assert_int_equal(mkdir(path, 0700), 0);
	assert_int_equal(ledger_open(&l, path, &e), 0);
	for (uint64_t id = 1; id <= ENDED; id++) {
		struct ledger_job j = {.id = id, .owner = "", .name = "finished", .version = "1", .record = ""};
		fill_record(r, id);
		assert_int_equal(ledger_add(l, &j, &e), 0);
		assert_int_equal(ledger_end(l, r, false, &e), 0);
	}
	ledger_close(l);
	free(r);
}

/* Shared with the server: the JSON values made by the thread of its loop, and by other threads. */
static struct made {
	_Atomic unsigned on_loop, elsewhere;
	_Atomic bool slowly; /* those of one snapshot take more than two ticks */
} * made;

static void *counted_malloc(size_t size)
{
	if (gettid() == getpid())
		made->on_loop++;
	else if (made->elsewhere++ % (40 * LISTED) == 0 && made->slowly)
		usleep(250000);
	return malloc(size);
}

static int set_up(void **state)
{
	(void)state;
	made = mmap(NULL, sizeof *made, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	assert_true(made != MAP_FAILED);
	served_prepare(make_spool);
	json_set_alloc_funcs(counted_malloc, free);
	int rc = served_start(60, 60, 60);
	json_set_alloc_funcs(malloc, free);
	return rc;
}

static FILE *call_status(void)
{
	struct sockaddr_un a = {.sun_family = AF_UNIX};
	struct timeval minute = {.tv_sec = 60};
	snprintf(a.sun_path, sizeof a.sun_path, "%s/status", served_folder());
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	assert_int_equal(connect(fd, (const struct sockaddr *)&a, sizeof a), 0);
	assert_int_equal(setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &minute, sizeof minute), 0);
	FILE *f = fdopen(fd, "r");
	assert_non_null(f);
	return f;
}

static void send_line(FILE *f, const char *line)
{
	assert_int_equal(send(fileno(f), line, strlen(line), MSG_NOSIGNAL), strlen(line));
}

/* Returns the next line; size may be NULL. */
static json_t *read_line(FILE *f, size_t *size)
{
	static char *line;
	static size_t room;
	json_error_t fault;
	ssize_t n = getline(&line, &room, f);
	assert_true(n > 0);
	json_t *o = json_loadb(line, (size_t)n, 0, &fault);
	assert_non_null(o);
	if (size)
		*size = (size_t)n;
	return o;
}

static const char *text_of(const json_t *o, const char *key)
{
	const char *s = json_string_value(json_object_get(o, key));
	return s ? s : "";
}

static const json_t *job_of(const json_t *o, size_t i)
{
	return json_array_get(json_object_get(o, "jobs"), i);
}

static void a_snapshot_is_small(void **state)
{
	(void)state;
	size_t size;
	FILE *f = call_status();
	json_t *o = read_line(f, &size);
	assert_int_equal(json_array_size(json_object_get(o, "jobs")), LISTED);
	assert_int_equal(json_integer_value(json_object_get(o, "endedOthers")), ENDED - LISTED);
	assert_string_equal(text_of(job_of(o, 0), "id"), "j251");
	assert_string_equal(text_of(job_of(o, LISTED - 1), "id"), "j300");
	assert_null(json_object_get(job_of(o, 0), "effects"));
	assert_string_equal(text_of(job_of(o, 0), "state"), "done");
	assert_true(size < LISTED * 2000);
	json_decref(o);
	fclose(f);
}

/* Returns how many JSON values the loop makes for the jobs after its start. */
static unsigned made_at_rest(void)
{
	unsigned before;
	do {
		before = made->on_loop;
		usleep(300000);
	} while (made->on_loop != before);
	return before;
}

/* The loop's thread makes no snapshot, even for a client that asks before it has received one. */
static void the_loop_makes_no_snapshot(void **state)
{
	(void)state;
	unsigned on_loop = made_at_rest(), elsewhere = made->elsewhere;
	FILE *f = call_status();
	send_line(f, "{\"job\":\"j301\"}\n");
	json_t *o = read_line(f, NULL);
	assert_string_equal(text_of(o, "type"), "snapshot");
	json_decref(o);
	o = read_line(f, NULL);
	assert_string_equal(text_of(o, "type"), "error");
	json_decref(o);
	fclose(f);
	assert_in_range(made->on_loop - on_loop, 1, 20 * LISTED); /* and those of the answer */
	assert_in_range(made->elsewhere - elsewhere, 40 * LISTED, UINT32_MAX);
}

static void one_job_has_its_details(void **state)
{
	(void)state;
	FILE *f = call_status();
	json_decref(read_line(f, NULL));
	send_line(f, "{\"job\":\"j7\"}\n{\"job\":\"j301\"}\n{\"job\":\"7\"}\n");
	json_t *o = read_line(f, NULL);
	const json_t *job = json_object_get(o, "job");
	assert_string_equal(text_of(o, "type"), "job");
	assert_string_equal(text_of(job, "id"), "j7");
	assert_int_equal(json_array_size(json_object_get(job, "effects")), 24);
	json_decref(o);
	o = read_line(f, NULL);
	assert_string_equal(text_of(o, "text"), "j301: no such job");
	json_decref(o);
	o = read_line(f, NULL);
	assert_string_equal(text_of(o, "text"), "7: no such job");
	json_decref(o);
	fclose(f);
}

static void pages_list_all_that_ended(void **state)
{
	(void)state;
	char question[64] = "{\"endedBefore\":null}\n";
	uint64_t next = ENDED;
	FILE *f = call_status();
	json_decref(read_line(f, NULL));
	for (size_t page = 0; page < ENDED / LISTED; page++) {
		send_line(f, question);
		json_t *o = read_line(f, NULL);
		size_t count = json_array_size(json_object_get(o, "jobs"));
		assert_int_equal(count, LISTED);
		for (size_t i = count; i-- > 0; next--)
			assert_int_equal(strtoull(text_of(job_of(o, i), "id") + 1, NULL, 10), next);
		snprintf(question, sizeof question, "{\"endedBefore\":\"%s\"}\n", text_of(o, "before"));
		assert_true(json_is_null(json_object_get(o, "before")) == (next == 0));
		json_decref(o);
	}
	assert_int_equal(next, 0);
	fclose(f);
}

static uint64_t newest_of(const json_t *snapshot)
{
	size_t count = json_array_size(json_object_get(snapshot, "jobs"));
	return strtoull(text_of(job_of(snapshot, count - 1), "id") + 1, NULL, 10);
}

static void submit(struct scripted *client, uint64_t id)
{
	peer_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	const Farm__SubmitAnswer *a = peer_submit_answer(client);
	if (a->n_missing) {
		peer_send_blob(client, "<scene/>", "<scene/>");
		a = peer_submit_answer(client);
	}
	assert_int_equal(a->job, id);
}

/* A second reader shows that there was a snapshot of each job. A client that has not read meanwhile gets the snapshots
 * that its socket held, those on their way, and the newest. */
static void a_slow_reader_gets_the_newest(void **state)
{
	(void)state;
	FILE *quick = call_status(), *slow = call_status();
	struct scripted *client = peer_call();
	uint64_t last = ENDED + SUBMITTED, newest = 0, lines = 0;
	json_decref(read_line(quick, NULL));
	send_line(quick, "{\"subscribe\":[\"snapshot\"]}\n");
	send_line(slow, "{\"subscribe\":[\"snapshot\"]}\n");
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	for (uint64_t id = ENDED + 1; id <= last; id++) {
		for (submit(client, id); newest < id;) {
			json_t *o = read_line(quick, NULL);
			newest = newest_of(o);
			json_decref(o);
		}
	}
	for (newest = 0; newest < last; lines++) {
		json_t *o = read_line(slow, NULL);
		newest = newest_of(o);
		json_decref(o);
	}
	assert_true(lines < SUBMITTED / 2);
	send_line(slow, "{\"job\":\"j340\"}\n");
	json_t *o = read_line(slow, NULL);
	while (strcmp(text_of(o, "type"), "snapshot") == 0) {
		json_decref(o);
		o = read_line(slow, NULL);
	}
	assert_string_equal(text_of(json_object_get(o, "job"), "id"), "j340");
	json_decref(o);
	fclose(quick);
	fclose(slow);
	scripted_hang_up(client);
}

/* Two readers that were behind get the same snapshot: it is made once for all. A tick may come between the two, so the
 * test tries several times; if each had its own, the clock would not show both the same nanosecond so often. */
static void what_is_sent_to_many_is_made_once(void **state)
{
	(void)state;
	enum { TRIES = 5, EACH = 20 };
	FILE *quick = call_status(), *slow[2] = {call_status(), call_status()};
	struct scripted *client = peer_call();
	uint64_t last = ENDED + SUBMITTED, seen = 0;
	bool same = false;
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	json_decref(read_line(quick, NULL));
	send_line(quick, "{\"subscribe\":[\"snapshot\"]}\n");
	for (int i = 0; i < 2; i++)
		send_line(slow[i], "{\"subscribe\":[\"snapshot\"]}\n");
	for (int try = 0; try < TRIES && !same; try++) {
		uint64_t newest[2] = {0, 0}, lines = 0;
		double time[2] = {0, 0};
		for (int k = 0; k < EACH; k++)
			for (submit(client, ++last); seen < last;) {
				json_t *o = read_line(quick, NULL);
				seen = newest_of(o);
				json_decref(o);
			}
		for (int i = 0; newest[0] < last || newest[1] < last; i = !i) {
			if (newest[i] == last)
				continue;
			json_t *o = read_line(slow[i], NULL);
			newest[i] = newest_of(o);
			time[i] = json_real_value(json_object_get(o, "time"));
			json_decref(o);
			lines++;
		}
		assert_true(lines < EACH); /* lines of both: they were behind */
		same = time[0] == time[1];
	}
	assert_true(same);
	fclose(quick);
	fclose(slow[0]);
	fclose(slow[1]);
	scripted_hang_up(client);
}

/* Returns the number of remaining lines, at most `most`. */
static int lines_left(FILE *f, int most)
{
	static char *line;
	static size_t room;
	int n = 0;
	while (n < most && getline(&line, &room, f) > 0)
		n++;
	return n;
}

/* The readers ask and do not read, each within what may wait for one reader. Some are cut off, since at most 16 MB may
 * wait for all peers and readers together. */
static void what_waits_for_all_readers_is_bounded(void **state)
{
	(void)state;
	enum { READERS = 30, PAGES = 20 };
	FILE *quick = call_status(), *slow[READERS];
	size_t size = 0, all = 0;
	int whole = 0;
	json_decref(read_line(quick, NULL));
	for (int i = 0; i < READERS; i++) {
		slow[i] = call_status();
		json_decref(read_line(slow[i], NULL)); /* the reader does not listen before its first line */
		for (int k = 0; k < PAGES; k++)
			send_line(slow[i], "{\"endedBefore\":null}\n");
		send_line(quick, "{\"endedBefore\":null}\n");
		json_decref(read_line(quick, &size));
		all += PAGES * size;
	}
	assert_true(all > 24 << 20 && PAGES * size < 1 << 20);
	for (int i = 0; i < READERS; i++) {
		whole += lines_left(slow[i], PAGES) == PAGES;
		fclose(slow[i]);
	}
	assert_true(whole > 0 && whole < READERS);
	send_line(quick, "{\"job\":\"j7\"}\n");
	json_decref(read_line(quick, NULL));
	fclose(quick);
}

/* Reads lines of that type until this job comes; ready: only lines that are already there. */
static bool hears_job(FILE *f, uint64_t id, bool ready)
{
	char name[32];
	struct pollfd p = {.fd = fileno(f), .events = POLLIN};
	snprintf(name, sizeof name, "j%llu", (unsigned long long)id);
	for (bool found = false; !found;) {
		if (ready && poll(&p, 1, 0) == 0)
			return false;
		json_t *o = read_line(f, NULL);
		found = strcmp(text_of(json_object_get(o, "job"), "id"), name) == 0;
		json_decref(o);
	}
	return true;
}

/* At any time some reader waits for a snapshot. */
static void who_calls_again_and_again_stops_no_changes(void **state)
{
	(void)state;
	FILE *watcher = call_status(), *first = call_status();
	struct scripted *client = peer_call();
	unsigned calls = 0;
	json_t *o = read_line(watcher, NULL);
	uint64_t id = newest_of(o) + 1;
	json_decref(o);
	setvbuf(watcher, NULL, _IONBF, 0);
	assert_true(peer_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	send_line(watcher, "{\"subscribe\":[\"jobs\"]}\n");
	submit(client, id);
	hears_job(watcher, id, false);
	made->slowly = true;
	submit(client, ++id);
	for (; !hears_job(watcher, id, true) && calls < 20; calls++) {
		FILE *next = call_status();
		json_decref(read_line(first, NULL));
		fclose(first);
		first = next;
	}
	made->slowly = false;
	assert_true(calls < 8);
	fclose(first);
	fclose(watcher);
	scripted_hang_up(client);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_snapshot_is_small),
		cmocka_unit_test(the_loop_makes_no_snapshot),
		cmocka_unit_test(one_job_has_its_details),
		cmocka_unit_test(pages_list_all_that_ended),
		cmocka_unit_test(a_slow_reader_gets_the_newest),
		cmocka_unit_test(what_is_sent_to_many_is_made_once),
		cmocka_unit_test(what_waits_for_all_readers_is_bounded),
		cmocka_unit_test(who_calls_again_and_again_stops_no_changes),
	};
	return cmocka_run_group_tests(tests, set_up, served_stop);
}
