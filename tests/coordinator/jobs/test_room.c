/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which jobs may go on when the disk or memory has not enough room for all: at least one always does, and the jobs that
 * go on have room together.
 */
#include "coordinator/jobs/room.h"

#include "common/base/disk.h"
#include "tests/support/folder.h"
#include "tests/support/staged.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { JOBS = 4 };

/* Bytes and priorities of jobs 1 to 4; `going`: those that go on, in order. */
static const struct {
	uint64_t bytes[JOBS];
	int priority[JOBS];
	uint64_t available;
	const char *going;
} cases[] = {
	{{25, 25, 25, 25}, {0}, 100, "1234"},
	{{60, 60, 60, 60}, {0}, 100, "1"},
	{{60, 60, 40, 1}, {0}, 100, "13"},
	{{60, 60, 60, 40}, {0, 0, 5, -5}, 100, "34"},
	{{60, 30, 60, 20}, {0, 5, 5, 5}, 100, "23"},
	/* the first job does not fit beside what others have written: one of them must end first */
	{{60, 30, 60, 60}, {9, 0, 0, 0}, 40, "2"},
	/* the room stays unused: the first job must see whether it needs all that it claims */
	{{60, 50, 41, 90}, {0, 0, 1, 1}, 40, "3"},
	{{0, 0, 1, 0}, {0}, 0, "124"},
	{{UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX}, {0}, UINT64_MAX - 1, "1"},
};

static void some_go_on(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct room_claim claims[JOBS];
		char going[JOBS + 1] = "";
		for (size_t k = 0; k < JOBS; k++) /* in any order */
			claims[(k + i) % JOBS] =
				(struct room_claim){k + 1, cases[i].bytes[k], cases[i].priority[k], k % 2};
		room_share(claims, JOBS, cases[i].available);
		for (int k = 0; k < JOBS; k++)
			if (claims[k].goes)
				going[strlen(going)] = (char)('0' + claims[k].job);
		if (strcmp(going, cases[i].going) != 0)
			fail_msg("case %zu: '%s' go on, not '%s'", i, going, cases[i].going);
	}
	room_share(NULL, 0, 100);
}

/* Jobs of random sizes, each of which fits alone, write up to their claims and release all of it at their ends while
 * others arrive: all of them end. */
static void all_end(void **state)
{
	(void)state;
	uint64_t draw = 1;
	for (int trial = 0; trial < 1000; trial++) {
		uint64_t left[JOBS], has[JOBS] = {0}, free_bytes = 100;
		int priority[JOBS], ended = 0, steps = 0;
		for (int k = 0; k < JOBS; k++) {
			draw = draw * 6364136223846793005 + 1442695040888963407;
			left[k] = 30 + (draw >> 33) % 71;
			priority[k] = (int)(draw >> 60) % 3;
		}
		for (; ended < JOBS && steps < 1000; steps++) {
			struct room_claim claims[JOBS];
			size_t count = 0;
			for (int k = 0; k < JOBS && k <= steps / 5; k++) /* jobs arrive one after the other */
				if (left[k])
					claims[count++] = (struct room_claim){(uint64_t)k, left[k], priority[k], false};
			room_share(claims, count, free_bytes);
			for (size_t i = 0; i < count; i++) {
				uint64_t k = claims[i].job;
				if (!claims[i].goes || free_bytes == 0)
					continue;
				free_bytes--;
				has[k]++;
				if (--left[k])
					continue;
				free_bytes += has[k];
				ended++;
			}
		}
		if (ended < JOBS)
			fail_msg("trial %d: %d jobs hold each other up", trial, JOBS - ended);
		assert_int_equal(free_bytes, 100);
	}
}

static uint64_t next_draw(uint64_t *draw)
{
	*draw = *draw * 6364136223846793005 + 1442695040888963407;
	return *draw >> 33;
}

/* Jobs whose chain states grow to their limit end and are followed by others: memory is bounded, and the states of at
 * least one job may always grow. */
static void states_are_bounded(void **state)
{
	(void)state;
	enum { MOST = 320, COUNT = 24 };
	uint64_t draw = 1, largest = 0, waited = 0;
	for (int trial = 0; trial < 1000; trial++) {
		struct live_job live[COUNT] = {{.id = 0}};
		struct jobs jobs = {.live = live, .config.state_bytes = MOST};
		uint64_t final[COUNT], ended = 0, small = next_draw(&draw) % 100;
		for (int k = 0; k < COUNT; k++) {
			live[k] = (struct live_job){.next = k + 1 < COUNT ? &live[k + 1] : NULL, .id = (uint64_t)k + 1};
			final[k] = 1 + next_draw(&draw) % (next_draw(&draw) % 100 < small ? MOST / 32 : MOST);
		}
		for (int blocked = 0; ended < 20 && blocked < 1000;) {
			int k = (int)(next_draw(&draw) % COUNT);
			uint64_t room = final[k] - live[k].state_bytes, step = 1 + next_draw(&draw) % 10, total = 0;
			step = step < room ? step : room;
			uint64_t other = room_for_states(&jobs, &live[k], live[k].state_bytes + step);
			assert_true(other <= COUNT && other != live[k].id);
			waited += other != 0;
			blocked = other ? blocked + 1 : 0;
			if (!other)
				live[k].state_bytes += step;
			for (int i = 0; i < COUNT; i++)
				total += live[i].state_bytes;
			largest = total > largest ? total : largest;
			if (live[k].state_bytes >= final[k]) {
				live[k].state_bytes = 0;
				ended++;
			}
		}
		assert_int_equal(ended, 20);
	}
	assert_true(largest > MOST && largest <= MOST + MOST / 2 + MOST / 4 && waited);
}

/* One job has all the memory that it may have, and is held: other jobs that need little go on, and memory stays bounded
 * however many they are. A job that needs more waits for the large one. */
static void small_jobs_pass_a_large_one(void **state)
{
	(void)state;
	enum { MOST = 3200, SMALL = MOST / ROOM_SMALL_JOB, COUNT = 20 };
	struct live_job live[1 + COUNT] = {{.id = 1, .state_bytes = MOST}};
	struct jobs jobs = {.live = live, .config.state_bytes = MOST};
	uint64_t total = MOST;
	for (int k = 1; k <= COUNT; k++) {
		live[k].id = (uint64_t)k + 1;
		live[k - 1].next = &live[k];
	}
	assert_int_equal(room_for_states(&jobs, &live[1], SMALL + 1), 1);
	for (int k = 1; k <= COUNT; k++)
		while (live[k].state_bytes < SMALL && room_for_states(&jobs, &live[k], live[k].state_bytes + 1) == 0) {
			live[k].state_bytes++;
			total++;
		}
	assert_int_equal(total, MOST + MOST / ROOM_SMALL_JOBS);
	assert_int_equal(room_for_states(&jobs, &live[COUNT], 1), 1);
	assert_int_equal(room_for_states(&jobs, &live[0], MOST), 0); /* and the large job can end */
}

static unsigned sent, refused, ended; /* results, results refused for lack of memory, and jobs */

static void work_until(const unsigned *count, unsigned most)
{
	while (*count < most) {
		struct lease_key k;
		struct error e;
		const Farm__Envelope *m = scripted_hear(staged.worker);
		assert_non_null(m);
		ended += m->body_case == FARM__ENVELOPE__BODY_JOB_END;
		assert_true(!ended || count == &ended);
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK &&
		    m->lease_ack->verdict == FARM__VERDICT__VERDICT_REFUSED) {
			assert_non_null(strstr(m->lease_ack->text, "memory has no room for its chain states beside"));
			refused++;
		}
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_GRANT) {
			assert_int_equal(lease_key_from_wire(m->lease_grant->key, &k, &e), 0);
			assert_true(staged_answer(&k));
			sent++;
		}
	}
}

static uint64_t four_thousand(const char *path)
{
	(void)path;
	return 4000;
}

/* Space that will become free counts: films of jobs that ended, and files of scenes. */
static void what_no_end_makes_room_for(void **state)
{
	(void)state;
	static const char bytes[3000];
	struct jobs jobs = {0};
	struct job_record over = {.id = 7};
	struct blob_hash h;
	struct blob_writer *w;
	struct error e;
	struct disk small = disk_system;
	char folder_of[SPOOL_PATH_MAX];
	assert_int_equal(spool_open(&jobs.spool, folder, &e), 0);
	assert_int_equal(blob_store_open(&jobs.blobs, spool_blobs(jobs.spool), 0, &e), 0);
	small.available = four_thousand;
	disk_use(&small);
	assert_int_equal(room_could_hold(&jobs, 4000, &e), 0);
	assert_int_equal(room_could_hold(&jobs, 4001, &e), -ENOSPC);
	assert_non_null(strstr(e.text, "may need 4001 bytes"));
	assert_non_null(strstr(e.text, "has 4000: 4000 are free, 0 belong"));
	assert_int_equal(blob_hash_bytes(bytes, 300, &h, &e), 0);
	assert_int_equal(blob_write_begin(&w, jobs.blobs, &h, 300, &e), 0);
	assert_int_equal(blob_write_add(w, bytes, 300, &e), 0);
	assert_int_equal(room_could_hold(&jobs, 4301, &e), -ENOSPC);
	assert_int_equal(blob_write_commit(w, &e), 0);
	assert_int_equal(room_could_hold(&jobs, 4300, &e), 0);
	spool_job_path(jobs.spool, over.id, NULL, folder_of);
	assert_int_equal(disk_make_folder(folder_of, &e), 0);
	assert_int_equal(spool_write(jobs.spool, over.id, "checkpoint", bytes, sizeof bytes, &e), 0);
	assert_int_equal(room_could_hold(&jobs, 4301, &e), -ENOSPC);
	jobs.ended = &over;
	jobs.ended_count = 1;
	assert_int_equal(room_could_hold(&jobs, 7300, &e), 0);
	assert_int_equal(room_could_hold(&jobs, 7301, &e), -ENOSPC);
	jobs.found = (struct recovering_job *)&jobs; /* free space is unknown: jobs from before the restart are still
						      * being read */
	assert_int_equal(room_could_hold(&jobs, 7301, &e), 0);
	disk_use(NULL);
	blob_store_close(jobs.blobs);
	spool_close(jobs.spool);
}

static void send_order(uint64_t job, Farm__Verb verb)
{
	Farm__Control c;
	Farm__Envelope m;
	farm__control__init(&c);
	farm__envelope__init(&m);
	c.job = job;
	c.verb = verb;
	m.body_case = FARM__ENVELOPE__BODY_CONTROL;
	m.control = &c;
	staged_order(&m);
}

/* One job finishes its bootstrap and first round, then a second one gets the worker to itself. Each job may take all
 * the memory there is, so both together may not: the second waits until the first has ended. */
static void jobs_with_many_chains_take_turns(void **state)
{
	(void)state;
	const unsigned round = staged.plan.groups * staged.plan.parts, jobs = 2;
	for (unsigned times = 1; times <= 4; times += 3) {
		sent = refused = ended = 0;
		staged.state_bytes = times * chain_states_max(&staged.plan);
		staged_start();
		uint64_t first = staged_submit();
		work_until(&sent, 2 * round);
		send_order(first, FARM__VERB__VERB_HOLD);
		staged_submit();
		if (times == 1)
			work_until(&refused, 1);
		send_order(first, FARM__VERB__VERB_RELEASE);
		work_until(&ended, jobs);
		assert_true((refused > 0) == (times == 1));
		staged_end(SIGTERM, true);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(some_go_on),
		cmocka_unit_test(all_end),
		cmocka_unit_test(states_are_bounded),
		cmocka_unit_test(small_jobs_pass_a_large_one),
		cmocka_unit_test_setup_teardown(what_no_end_makes_room_for, folder_set_up, folder_tear_down),
		cmocka_unit_test_setup_teardown(jobs_with_many_chains_take_turns, staged_set_up, folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return staged_open() ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
