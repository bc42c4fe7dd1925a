/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The status of a farm that keeps many ended jobs: snapshots stay small, and what they leave out can be asked for; a
 * slow reader misses snapshots but is not cut off; the loop does not wait while they are made; and changes are not
 * delayed by clients that reconnect again and again. One server serves all tests.
 */
#include "coordinator/store/ledger.h"
#include "tests/support/child_server.h"

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
	record_init(r, id, "finished", "");
	strcpy(r->state, "done");
	r->submitted = r->ended = (double)id;
	r->ended_seen = 0;
	for (int i = 0; i < 24; i++)
		json_array_append_new(effects, json_pack("{s:s s:b s:s s:s}", "name", "an effect", "on", 1, "why",
							 "it takes a long sentence to say why", "saves",
							 "and another one to say what leaving it out would save"));
	record_set_effects(r, effects);
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
		assert_int_equal(ledger_end_job(l, r, false, &e), 0);
	}
	ledger_close(l);
	free(r);
}

/* Shared with the server: the JSON values made by the thread of its loop, and by other threads. */
static struct json_counts {
	_Atomic unsigned made_on_loop, made_elsewhere;
	_Atomic bool is_slow; /* those of one snapshot take more than two ticks */
} * json_counts;

static void *counted_malloc(size_t size)
{
	if (gettid() == getpid())
		json_counts->made_on_loop++;
	else if (json_counts->made_elsewhere++ % (40 * LISTED) == 0 && json_counts->is_slow)
		usleep(250000);
	return malloc(size);
}

static int set_up(void **state)
{
	(void)state;
	json_counts = mmap(NULL, sizeof *json_counts, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	assert_true(json_counts != MAP_FAILED);
	child_server_set_spool_maker(make_spool);
	json_set_alloc_funcs(counted_malloc, free);
	int rc = child_server_start(60, 60, 60);
	json_set_alloc_funcs(malloc, free);
	return rc;
}

static FILE *connect_to_status(void)
{
	struct sockaddr_un a = {.sun_family = AF_UNIX};
	struct timeval minute = {.tv_sec = 60};
	snprintf(a.sun_path, sizeof a.sun_path, "%s/status", child_server_folder());
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

static const char *get_text(const json_t *o, const char *key)
{
	const char *s = json_string_value(json_object_get(o, key));
	return s ? s : "";
}

static const json_t *get_job(const json_t *o, size_t i)
{
	return json_array_get(json_object_get(o, "jobs"), i);
}

static void snapshot_lists_only_the_latest_jobs(void **state)
{
	(void)state;
	size_t size;
	FILE *f = connect_to_status();
	json_t *o = read_line(f, &size);
	assert_int_equal(json_array_size(json_object_get(o, "jobs")), LISTED);
	assert_int_equal(json_integer_value(json_object_get(o, "endedOthers")), ENDED - LISTED);
	assert_string_equal(get_text(get_job(o, 0), "id"), "j251");
	assert_string_equal(get_text(get_job(o, LISTED - 1), "id"), "j300");
	assert_null(json_object_get(get_job(o, 0), "effects"));
	assert_string_equal(get_text(get_job(o, 0), "state"), "done");
	assert_true(size < LISTED * 2000);
	json_decref(o);
	fclose(f);
}

/* Returns how many JSON values the loop makes for the jobs after its start. */
static unsigned count_once_idle(void)
{
	unsigned before;
	do {
		before = json_counts->made_on_loop;
		usleep(300000);
	} while (json_counts->made_on_loop != before);
	return before;
}

/* The loop's thread makes no snapshot, even for a client that asks before it has received one. */
static void loop_thread_makes_no_snapshot(void **state)
{
	(void)state;
	unsigned on_loop = count_once_idle(), elsewhere = json_counts->made_elsewhere;
	FILE *f = connect_to_status();
	send_line(f, "{\"job\":\"j301\"}\n");
	json_t *o = read_line(f, NULL);
	assert_string_equal(get_text(o, "type"), "snapshot");
	json_decref(o);
	o = read_line(f, NULL);
	assert_string_equal(get_text(o, "type"), "error");
	json_decref(o);
	fclose(f);
	assert_in_range(json_counts->made_on_loop - on_loop, 1, 20 * LISTED); /* and those of the answer */
	assert_in_range(json_counts->made_elsewhere - elsewhere, 40 * LISTED, UINT32_MAX);
}

static void details_of_one_job_can_be_asked_for(void **state)
{
	(void)state;
	FILE *f = connect_to_status();
	json_decref(read_line(f, NULL));
	send_line(f, "{\"job\":\"j7\"}\n{\"job\":\"j301\"}\n{\"job\":\"7\"}\n");
	json_t *o = read_line(f, NULL);
	const json_t *job = json_object_get(o, "job");
	assert_string_equal(get_text(o, "type"), "job");
	assert_string_equal(get_text(job, "id"), "j7");
	assert_int_equal(json_array_size(json_object_get(job, "effects")), 24);
	json_decref(o);
	o = read_line(f, NULL);
	assert_string_equal(get_text(o, "text"), "j301: no such job");
	json_decref(o);
	o = read_line(f, NULL);
	assert_string_equal(get_text(o, "text"), "7: no such job");
	json_decref(o);
	fclose(f);
}

static void pages_list_all_ended_jobs(void **state)
{
	(void)state;
	char question[64] = "{\"endedBefore\":null}\n";
	uint64_t next = ENDED;
	FILE *f = connect_to_status();
	json_decref(read_line(f, NULL));
	for (size_t page = 0; page < ENDED / LISTED; page++) {
		send_line(f, question);
		json_t *o = read_line(f, NULL);
		size_t count = json_array_size(json_object_get(o, "jobs"));
		assert_int_equal(count, LISTED);
		for (size_t i = count; i-- > 0; next--)
			assert_int_equal(strtoull(get_text(get_job(o, i), "id") + 1, NULL, 10), next);
		snprintf(question, sizeof question, "{\"endedBefore\":\"%s\"}\n", get_text(o, "before"));
		assert_true(json_is_null(json_object_get(o, "before")) == (next == 0));
		json_decref(o);
	}
	assert_int_equal(next, 0);
	fclose(f);
}

static uint64_t newest_job_id(const json_t *snapshot)
{
	size_t count = json_array_size(json_object_get(snapshot, "jobs"));
	return strtoull(get_text(get_job(snapshot, count - 1), "id") + 1, NULL, 10);
}

static void submit_job(struct scripted_peer *client, uint64_t id)
{
	child_server_submit(client, NULL, "<scene/>", "s.xml", "s.xml");
	const Farm__SubmitAnswer *a = child_server_receive_submit_answer(client);
	if (a->n_missing) {
		child_server_send_blob(client, "<scene/>", "<scene/>");
		a = child_server_receive_submit_answer(client);
	}
	assert_int_equal(a->job, id);
}

/* A second reader shows that there was a snapshot of each job. A client that has not read meanwhile gets the snapshots
 * that its socket held, those on their way, and the newest. */
static void slow_reader_gets_the_newest_snapshot(void **state)
{
	(void)state;
	FILE *quick = connect_to_status(), *slow = connect_to_status();
	struct scripted_peer *client = child_server_connect();
	uint64_t last = ENDED + SUBMITTED, newest = 0, lines = 0;
	json_decref(read_line(quick, NULL));
	send_line(quick, "{\"subscribe\":[\"snapshot\"]}\n");
	send_line(slow, "{\"subscribe\":[\"snapshot\"]}\n");
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	for (uint64_t id = ENDED + 1; id <= last; id++) {
		for (submit_job(client, id); newest < id;) {
			json_t *o = read_line(quick, NULL);
			newest = newest_job_id(o);
			json_decref(o);
		}
	}
	for (newest = 0; newest < last; lines++) {
		json_t *o = read_line(slow, NULL);
		newest = newest_job_id(o);
		json_decref(o);
	}
	assert_true(lines < SUBMITTED / 2);
	send_line(slow, "{\"job\":\"j340\"}\n");
	json_t *o = read_line(slow, NULL);
	while (strcmp(get_text(o, "type"), "snapshot") == 0) {
		json_decref(o);
		o = read_line(slow, NULL);
	}
	assert_string_equal(get_text(json_object_get(o, "job"), "id"), "j340");
	json_decref(o);
	fclose(quick);
	fclose(slow);
	scripted_peer_disconnect(client);
}

/* Two readers that were behind get the same snapshot: it is made once for all. A tick may come between the two, so the
 * test tries several times; if each had its own, the clock would not show both the same nanosecond so often. */
static void snapshot_for_many_readers_is_made_once(void **state)
{
	(void)state;
	enum { TRIES = 5, EACH = 20 };
	FILE *quick = connect_to_status(), *slow[2] = {connect_to_status(), connect_to_status()};
	struct scripted_peer *client = child_server_connect();
	uint64_t last = ENDED + SUBMITTED, seen = 0;
	bool same = false;
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	json_decref(read_line(quick, NULL));
	send_line(quick, "{\"subscribe\":[\"snapshot\"]}\n");
	for (int i = 0; i < 2; i++)
		send_line(slow[i], "{\"subscribe\":[\"snapshot\"]}\n");
	for (int try = 0; try < TRIES && !same; try++) {
		uint64_t newest[2] = {0, 0}, lines = 0;
		double time[2] = {0, 0};
		for (int k = 0; k < EACH; k++)
			for (submit_job(client, ++last); seen < last;) {
				json_t *o = read_line(quick, NULL);
				seen = newest_job_id(o);
				json_decref(o);
			}
		for (int i = 0; newest[0] < last || newest[1] < last; i = !i) {
			if (newest[i] == last)
				continue;
			json_t *o = read_line(slow[i], NULL);
			newest[i] = newest_job_id(o);
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
	scripted_peer_disconnect(client);
}

/* Returns the number of remaining lines, at most `limit`. */
static int count_remaining_lines(FILE *f, int limit)
{
	static char *line;
	static size_t room;
	int n = 0;
	while (n < limit && getline(&line, &room, f) > 0)
		n++;
	return n;
}

/* The readers ask and do not read, each within what may wait for one reader. Some are cut off, since at most 16 MB may
 * wait for all peers and readers together. */
static void bytes_waiting_for_all_readers_are_bounded(void **state)
{
	(void)state;
	enum { READERS = 30, PAGES = 20 };
	FILE *quick = connect_to_status(), *slow[READERS];
	size_t size = 0, total_size = 0;
	int complete_count = 0;
	json_decref(read_line(quick, NULL));
	for (int i = 0; i < READERS; i++) {
		slow[i] = connect_to_status();
		json_decref(read_line(slow[i], NULL)); /* the reader does not listen before its first line */
		for (int k = 0; k < PAGES; k++)
			send_line(slow[i], "{\"endedBefore\":null}\n");
		send_line(quick, "{\"endedBefore\":null}\n");
		json_decref(read_line(quick, &size));
		total_size += PAGES * size;
	}
	assert_true(total_size > 24 << 20 && PAGES * size < 1 << 20);
	for (int i = 0; i < READERS; i++) {
		complete_count += count_remaining_lines(slow[i], PAGES) == PAGES;
		fclose(slow[i]);
	}
	assert_true(complete_count > 0 && complete_count < READERS);
	send_line(quick, "{\"job\":\"j7\"}\n");
	json_decref(read_line(quick, NULL));
	fclose(quick);
}

/* Reads lines of that type until this job comes; ready: only lines that are already there. */
static bool read_until_job(FILE *f, uint64_t id, bool ready)
{
	char name[32];
	struct pollfd p = {.fd = fileno(f), .events = POLLIN};
	snprintf(name, sizeof name, "j%llu", (unsigned long long)id);
	for (bool found = false; !found;) {
		if (ready && poll(&p, 1, 0) == 0)
			return false;
		json_t *o = read_line(f, NULL);
		found = strcmp(get_text(json_object_get(o, "job"), "id"), name) == 0;
		json_decref(o);
	}
	return true;
}

/* At any time some reader waits for a snapshot. */
static void reconnecting_clients_delay_no_changes(void **state)
{
	(void)state;
	FILE *watcher = connect_to_status(), *first = connect_to_status();
	struct scripted_peer *client = child_server_connect();
	unsigned calls = 0;
	json_t *o = read_line(watcher, NULL);
	uint64_t id = newest_job_id(o) + 1;
	json_decref(o);
	setvbuf(watcher, NULL, _IONBF, 0);
	assert_true(child_server_exchange_hello(client, FARM_VERSION, FARM__ROLE__ROLE_CLIENT)->accepted);
	send_line(watcher, "{\"subscribe\":[\"jobs\"]}\n");
	submit_job(client, id);
	read_until_job(watcher, id, false);
	json_counts->is_slow = true;
	submit_job(client, ++id);
	for (; !read_until_job(watcher, id, true) && calls < 20; calls++) {
		FILE *next = connect_to_status();
		json_decref(read_line(first, NULL));
		fclose(first);
		first = next;
	}
	json_counts->is_slow = false;
	assert_true(calls < 8);
	fclose(first);
	fclose(watcher);
	scripted_peer_disconnect(client);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(snapshot_lists_only_the_latest_jobs),
		cmocka_unit_test(loop_thread_makes_no_snapshot),
		cmocka_unit_test(details_of_one_job_can_be_asked_for),
		cmocka_unit_test(pages_list_all_ended_jobs),
		cmocka_unit_test(slow_reader_gets_the_newest_snapshot),
		cmocka_unit_test(snapshot_for_many_readers_is_made_once),
		cmocka_unit_test(bytes_waiting_for_all_readers_are_bounded),
		cmocka_unit_test(reconnecting_clients_delay_no_changes),
	};
	return cmocka_run_group_tests(tests, set_up, child_server_stop);
}
