/* SPDX-License-Identifier: Apache-2.0 */
/* Which jobs go on where the disk has not room for all: some job always does, and those that do have room together. */
#include "coordinator/jobs/room.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { JOBS = 4 };

/* Of jobs 1 to 4, their bytes and priorities; `going`: those that go on, in order. */
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
	/* the first has too little room beside what others have written: one of them ends first */
	{{60, 30, 60, 60}, {9, 0, 0, 0}, 40, "2"},
	/* nobody's: the first must see whether it needs all that it claims */
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

/* Jobs of random sizes, each of which fits alone, write up to their claims and release all of it at their ends, and
 * others come meanwhile: all end. */
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
			for (int k = 0; k < JOBS && k <= steps / 5; k++) /* one after the other arrives */
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

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(some_go_on), cmocka_unit_test(all_end)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
