/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which jobs may go on when the disk or memory has not enough room for all: at least one always does, and the jobs that
 * go on have room together.
 */
#include "coordinator/jobs/storage.h"

#include "common/base/disk.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/staged_server.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { JOBS = 4 };

/* Bytes and priorities of jobs 1 to 4; `expected`: those that go on, in order. */
static const struct {
	uint64_t bytes[JOBS];
	int priority[JOBS];
	uint64_t available;
	const char *expected;
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

static void jobs_that_fit_together_go_on(void **state)
{
	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct storage_claim claims[JOBS];
		char going[JOBS + 1] = "";
		for (size_t k = 0; k < JOBS; k++) /* in any order */
			claims[(k + i) % JOBS] =
				(struct storage_claim){k + 1, cases[i].bytes[k], cases[i].priority[k], k % 2};
		storage_grant_claims(claims, JOBS, cases[i].available);
		for (int k = 0; k < JOBS; k++)
			if (claims[k].may_write)
				going[strlen(going)] = (char)('0' + claims[k].job);
		if (strcmp(going, cases[i].expected) != 0)
			fail_msg("case %zu: '%s' go on, not '%s'", i, going, cases[i].expected);
	}
	storage_grant_claims(NULL, 0, 100);
}

/* Jobs of random sizes, each of which fits alone, write up to their claims and release all of it at their ends while
 * others arrive: all of them end. */
static void all_jobs_end_despite_little_room(void **state)
{
	(void)state;
	uint64_t draw = 1;
	for (int trial = 0; trial < 1000; trial++) {
		uint64_t remaining[JOBS], used_bytes[JOBS] = {0}, free_bytes = 100;
		int priority[JOBS], ended = 0, steps = 0;
		for (int k = 0; k < JOBS; k++) {
			draw = draw * 6364136223846793005 + 1442695040888963407;
			remaining[k] = 30 + (draw >> 33) % 71;
			priority[k] = (int)(draw >> 60) % 3;
		}
		for (; ended < JOBS && steps < 1000; steps++) {
			struct storage_claim claims[JOBS];
			size_t count = 0;
			for (int k = 0; k < JOBS && k <= steps / 5; k++) /* jobs arrive one after the other */
				if (remaining[k])
					claims[count++] =
						(struct storage_claim){(uint64_t)k, remaining[k], priority[k], false};
			storage_grant_claims(claims, count, free_bytes);
			for (size_t i = 0; i < count; i++) {
				uint64_t k = claims[i].job;
				if (!claims[i].may_write || free_bytes == 0)
					continue;
				free_bytes--;
				used_bytes[k]++;
				if (--remaining[k])
					continue;
				free_bytes += used_bytes[k];
				ended++;
			}
		}
		if (ended < JOBS)
			fail_msg("trial %d: %d jobs hold each other up", trial, JOBS - ended);
		assert_int_equal(free_bytes, 100);
	}
}

static uint64_t next_random(uint64_t *draw)
{
	*draw = *draw * 6364136223846793005 + 1442695040888963407;
	return *draw >> 33;
}

/* Jobs whose chain states grow to their limit end and are followed by others: memory is bounded, and the states of at
 * least one job may always grow. */
static void memory_of_chain_states_is_bounded(void **state)
{
	(void)state;
	enum { MOST = 320, COUNT = 24 };
	uint64_t draw = 1, largest = 0, waited = 0;
	for (int trial = 0; trial < 1000; trial++) {
		struct live_job live[COUNT] = {{.id = 0}};
		struct jobs jobs = {.live_jobs = live, .config.max_state_bytes = MOST};
		uint64_t final[COUNT], ended = 0, small = next_random(&draw) % 100;
		for (int k = 0; k < COUNT; k++) {
			live[k] = (struct live_job){.next = k + 1 < COUNT ? &live[k + 1] : NULL, .id = (uint64_t)k + 1};
			final[k] = 1 + next_random(&draw) % (next_random(&draw) % 100 < small ? MOST / 32 : MOST);
		}
		for (int blocked = 0; ended < 20 && blocked < 1000;) {
			int k = (int)(next_random(&draw) % COUNT);
			uint64_t room = final[k] - live[k].state_bytes, step = 1 + next_random(&draw) % 10, total = 0;
			step = step < room ? step : room;
			uint64_t other = storage_find_states_blocker(&jobs, &live[k], live[k].state_bytes + step);
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
	enum { MOST = 3200, SMALL = MOST / STORAGE_SMALL_JOB_DIVISOR, COUNT = 20 };
	struct live_job live[1 + COUNT] = {{.id = 1, .state_bytes = MOST}};
	struct jobs jobs = {.live_jobs = live, .config.max_state_bytes = MOST};
	uint64_t total = MOST;
	for (int k = 1; k <= COUNT; k++) {
		live[k].id = (uint64_t)k + 1;
		live[k - 1].next = &live[k];
	}
	assert_int_equal(storage_find_states_blocker(&jobs, &live[1], SMALL + 1), 1);
	for (int k = 1; k <= COUNT; k++)
		while (live[k].state_bytes < SMALL &&
		       storage_find_states_blocker(&jobs, &live[k], live[k].state_bytes + 1) == 0) {
			live[k].state_bytes++;
			total++;
		}
	assert_int_equal(total, MOST + MOST / STORAGE_SMALL_RESERVE_DIVISOR);
	assert_int_equal(storage_find_states_blocker(&jobs, &live[COUNT], 1), 1);
	assert_int_equal(storage_find_states_blocker(&jobs, &live[0], MOST), 0); /* and the large job can end */
}

static unsigned sent_count, refused_count, ended_job_count; /* results, results refused for lack of memory, and jobs */

static void work_until(const unsigned *count, unsigned target)
{
	while (*count < target) {
		struct lease_key k;
		struct error e;
		const Farm__Envelope *m = scripted_peer_receive(staged_server.worker);
		assert_non_null(m);
		ended_job_count += m->body_case == FARM__ENVELOPE__BODY_JOB_END;
		assert_true(!ended_job_count || count == &ended_job_count);
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_ACK &&
		    m->lease_ack->verdict == FARM__VERDICT__VERDICT_REFUSED) {
			assert_non_null(strstr(m->lease_ack->text, "memory has no room for its chain states beside"));
			refused_count++;
		}
		if (m->body_case == FARM__ENVELOPE__BODY_LEASE_GRANT) {
			assert_int_equal(lease_key_from_wire(m->lease_grant->key, &k, &e), 0);
			assert_true(staged_server_answer_lease(&k));
			sent_count++;
		}
	}
}

static uint64_t four_thousand_bytes(const char *path)
{
	(void)path;
	return 4000;
}

/* Space that will become free counts: films of jobs that ended, and files of scenes. */
static void job_that_never_fits_is_refused(void **state)
{
	(void)state;
	static const char bytes[3000];
	struct jobs jobs = {0};
	struct job_record over = {.id = 7};
	struct blob_hash h;
	struct blob_writer *w;
	struct error e;
	struct disk small = disk_system;
	char job_folder[SPOOL_PATH_MAX];
	assert_int_equal(spool_open(&jobs.spool, temporary_folder, &e), 0);
	assert_int_equal(blob_store_open(&jobs.blobs, spool_blob_folder(jobs.spool), 0, &e), 0);
	small.available = four_thousand_bytes;
	disk_set_calls(&small);
	assert_int_equal(storage_check_fits(&jobs, 4000, &e), 0);
	assert_int_equal(storage_check_fits(&jobs, 4001, &e), -ENOSPC);
	assert_non_null(strstr(e.text, "may need 4001 bytes"));
	assert_non_null(strstr(e.text, "has 4000: 4000 are free, 0 belong"));
	assert_int_equal(blob_hash_bytes(bytes, 300, &h, &e), 0);
	assert_int_equal(blob_write_begin(&w, jobs.blobs, &h, 300, &e), 0);
	assert_int_equal(blob_write_append(w, bytes, 300, &e), 0);
	assert_int_equal(storage_check_fits(&jobs, 4301, &e), -ENOSPC);
	assert_int_equal(blob_write_commit(w, &e), 0);
	assert_int_equal(storage_check_fits(&jobs, 4300, &e), 0);
	spool_job_path(jobs.spool, over.id, NULL, job_folder);
	assert_int_equal(disk_make_folder(job_folder, &e), 0);
	assert_int_equal(spool_write_job_file(jobs.spool, over.id, "checkpoint", bytes, sizeof bytes, &e), 0);
	assert_int_equal(storage_check_fits(&jobs, 4301, &e), -ENOSPC);
	jobs.ended_jobs = &over;
	jobs.ended_job_count = 1;
	assert_int_equal(storage_check_fits(&jobs, 7300, &e), 0);
	assert_int_equal(storage_check_fits(&jobs, 7301, &e), -ENOSPC);
	jobs.recovering_jobs = (struct recovering_job *)&jobs; /* free space is unknown: jobs from before the restart
								* are still being read */
	assert_int_equal(storage_check_fits(&jobs, 7301, &e), 0);
	disk_set_calls(NULL);
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
	staged_server_request(&m);
}

/* One job finishes its bootstrap and first round, then a second one gets the worker to itself. Each job may take all
 * the memory there is, so both together may not: the second waits until the first has ended. */
static void jobs_with_many_chains_take_turns(void **state)
{
	(void)state;
	const unsigned round = staged_server.plan.groups * staged_server.plan.parts, jobs = 2;
	for (unsigned times = 1; times <= 4; times += 3) {
		sent_count = refused_count = ended_job_count = 0;
		staged_server.state_bytes = times * chain_states_max_bytes(&staged_server.plan);
		staged_server_start();
		uint64_t first = staged_server_submit();
		work_until(&sent_count, 2 * round);
		send_order(first, FARM__VERB__VERB_HOLD);
		staged_server_submit();
		if (times == 1)
			work_until(&refused_count, 1);
		send_order(first, FARM__VERB__VERB_RELEASE);
		work_until(&ended_job_count, jobs);
		assert_true((refused_count > 0) == (times == 1));
		staged_server_end(SIGTERM, true);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(jobs_that_fit_together_go_on),
		cmocka_unit_test(all_jobs_end_despite_little_room),
		cmocka_unit_test(memory_of_chain_states_is_bounded),
		cmocka_unit_test(small_jobs_pass_a_large_one),
		cmocka_unit_test_setup_teardown(job_that_never_fits_is_refused, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(jobs_with_many_chains_take_turns, staged_server_set_up,
						temporary_folder_tear_down),
	};
	log_set_level(LOG_LEVEL_ERROR);
	return staged_server_map_disk() ? 1 : cmocka_run_group_tests(tests, NULL, NULL);
}
