/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Detailed balance of every strategy of the registry, and of the breakup with each b and c forced, in worlds that
 * together contain every kind of vertex. Method, level and power: tests/support/balance.h. A fault of 2 % in the
 * ratio of a strategy in default use is found by all rooms together; with FULL=1 by each room.
 */
#include "tests/support/balance.h"
#include "tests/support/dice.h"
#include "tests/support/test_length.h"
#include "tests/support/rooms.h"
#include "worker/render/world/build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { TRIALS = 64 };

/* Proposals from each start. Strategies that choose b and c for themselves get more than forced ones; strategies that
 * the room uses by default get so many that all rooms together find a fault of 2 %. */
enum { REPEAT = 2, REPEAT_DEFAULT = 8, REPEAT_MORE = 14, REPEAT_RARE = 25, STARTS_MAX = 256 };
/* Starting paths of the proposals: in each room, and for a strategy that only a single room uses. */
enum { STARTS = 32, STARTS_RARE = 240 };
#define FAULT_TO_FIND 0.02

/* Results of the strategies in default use, pooled over all rooms. */
static struct balance_pool pooled_results[BATCH_STRATEGIES * 2];

static bool is_default(const struct world *w, const struct mutation_ops *ops)
{
	struct render_summary summary;
	world_summary(w, &summary);
	return ops->default_weight && ops->default_weight(&summary) > 0;
}

static unsigned repeats_of(const struct world *w, const struct mutation_ops *ops)
{
	if (!is_default(w, ops))
		return REPEAT;
	bool noisy =
		ops->is_independent || strcmp(ops->name, "light") == 0; /* few rooms have a lamp that can be moved */
	return noisy ? REPEAT_MORE : REPEAT_DEFAULT;
}

/* Repeats the trial with so many more starts that the room alone finds a fault of 2 %, estimated from the power of a
 * short trial; takes a minute per room. */
static void check_room_alone(const struct world *w, const struct room *room, const struct balance_trial *short_trial)
{
	static struct balance_trial t;
	struct balance_verdict v = balance_judge(short_trial);
	double times = pow(v.power / FAULT_TO_FIND, 2) * short_trial->proposals_per_start / REPEAT_MORE;
	size_t start_count = (size_t)fmin(ceil(1.2 * times), STARTS_MAX);
	do {
		t = (struct balance_trial){
			.ops = short_trial->ops, .setting = {-1, -1}, .proposals_per_start = REPEAT_MORE};
		balance_run(w, room->name, &t, 1, dice_scaled_count(STARTS) * start_count, 800 * start_count);
		v = balance_judge(&t);
		start_count *= 2;
	} while (start_count <= STARTS_MAX && v.power > FAULT_TO_FIND && v.is_balanced);
	balance_print(room->name, &t, &v);
	assert_true(v.is_balanced && (v.power <= FAULT_TO_FIND || dice_scaled_count(STARTS) < STARTS));
}

/* Only one room has an aperture: it must find alone what for other strategies all rooms find together. */
static void pool_rare(const struct world *w, const struct room *room, const struct mutation_ops *ops,
		      struct balance_pool *p)
{
	static struct balance_trial t;
	t = (struct balance_trial){.ops = ops, .setting = {-1, -1}, .proposals_per_start = REPEAT_RARE};
	balance_run(w, room->name, &t, 1, dice_scaled_count(STARTS_RARE), 4000);
	balance_pool_add(p, &t);
}

/* Each b and c is forced in three rooms; with FULL=1 in all, and in a room selected by ROOM. */
static bool is_forced_in_room(const char *room)
{
	return test_is_full() || getenv("ROOM") || strcmp(room, "rough glass") == 0 ||
	       strcmp(room, "bent normals") == 0 || strcmp(room, "prism") == 0;
}

static size_t all_trials(const struct world *w, const char *room, struct balance_trial *t)
{
	size_t n = 0;
	for (size_t i = 0; mutation_registry[i]; i++)
		t[n++] = (struct balance_trial){.ops = mutation_registry[i],
						.setting = {-1, -1},
						.proposals_per_start = repeats_of(w, mutation_registry[i])};
	if (!is_forced_in_room(room))
		return n;
	const struct mutation_ops *hslt = mutation_find("hslt", 4);
	t[n++] = (struct balance_trial){.ops = hslt, .setting = {0, 0}, .proposals_per_start = 1};
	for (int b = 1; b <= BALANCE_EDGES_MAX; b++)
		for (int c = 0; c < b; c++)
			for (int side = BALANCE_CAMERA; side <= BALANCE_TRACED; side++)
				if (side == BALANCE_CAMERA || b < BALANCE_EDGES_MAX)
					t[n++] = (struct balance_trial){.ops = hslt,
									.setting = {b, c},
									.side = (enum balance_side)side,
									.proposals_per_start = 1};
	return n;
}

static void check_room(const struct room *room)
{
	static struct balance_trial trials[TRIALS];
	struct world *w = room->build();
	size_t count = all_trials(w, room->name, trials);
	unsigned faults = 0;
	balance_run(w, room->name, trials, count, dice_scaled_count(STARTS), 800);
	for (size_t i = 0; i < count; i++) {
		if (trials[i].acceptance_sum == 0)
			continue;
		struct balance_verdict v = balance_judge(&trials[i]);
		balance_print(room->name, &trials[i], &v);
		faults += !v.is_balanced;
	}
	for (size_t i = 0; mutation_registry[i]; i++) {
		if (is_default(w, mutation_registry[i])) {
			if (strcmp(mutation_registry[i]->name, "lens") == 0)
				pool_rare(w, room, mutation_registry[i], &pooled_results[i]);
			else
				balance_pool_add(&pooled_results[i], &trials[i]);
			if (test_is_full())
				check_room_alone(w, room, &trials[i]);
		}
	}
	world_free(w);
	assert_true(faults == 0);
}

static void proposals_are_balanced_in_the_room(void **state)
{
	check_room(*state);
}

/* Finds a fault that a strategy has in every room. */
static void proposals_are_balanced_over_all_rooms(void **state)
{
	(void)state;
	unsigned faults = 0, weak = 0;
	for (size_t i = 0; mutation_registry[i]; i++) {
		struct balance_verdict v = balance_pool_judge(&pooled_results[i]);
		if (!(v.power < INFINITY))
			continue;
		printf("all rooms      %-22s worst t %+6.2f (%s), finds %5.2f %%%s\n", mutation_registry[i]->name, v.t,
		       v.function_name, 100 * v.power, v.is_balanced ? "" : " NOT BALANCED");
		faults += !v.is_balanced;
		weak += !(v.power <= FAULT_TO_FIND) && dice_scaled_count(STARTS) >= STARTS && !getenv("ROOM");
	}
	assert_int_equal(faults, 0);
	assert_int_equal(weak, 0);
}

int main(void)
{
	struct CMUnitTest tests[ROOMS_MAX] = {0};
	const char *only = getenv("ROOM");
	size_t n = 0;
	for (const struct room *r = rooms; r->name; r++)
		if (!only || strcmp(only, r->name) == 0)
			tests[n++] = (struct CMUnitTest){r->name, proposals_are_balanced_in_the_room, NULL, NULL,
							 (void *)(uintptr_t)r};
	tests[n++] = (struct CMUnitTest){"all rooms", proposals_are_balanced_over_all_rooms, NULL, NULL, NULL};
	return _cmocka_run_group_tests("balance", tests, n, NULL, NULL);
}
