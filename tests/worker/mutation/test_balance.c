/*
 * Detailed balance of every strategy of the registry, and of the breakup with each b and c forced, in worlds that between them
 * have what paths can meet. How it is tested, level and power: tests/support/balance.h.
 */
#include "tests/support/balance.h"
#include "tests/support/dice.h"
#include "tests/support/rooms.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { TRIALS = 64 };

/* Strategies that choose for themselves get more proposals: their errors are seen by all they do. */
enum { REPEAT = 4 };

static size_t all_trials(struct balance_trial *t)
{
	size_t n = 0;
	for (size_t i = 0; mutation_registry[i]; i++)
		t[n++] = (struct balance_trial){.ops = mutation_registry[i], .how = {-1, -1}, .repeat = REPEAT};
	const struct mutation_ops *hslt = mutation_find("hslt", 4);
	t[n++] = (struct balance_trial){.ops = hslt, .how = {0, 0}, .repeat = 1};
	for (int b = 1; b <= BALANCE_EDGES; b++)
		for (int c = 0; c < b; c++)
			for (int side = BALANCE_CAMERA; side <= BALANCE_TRACED; side++)
				if (side == BALANCE_CAMERA || b < BALANCE_EDGES)
					t[n++] = (struct balance_trial){.ops = hslt, .how = {b, c}, .side = (enum balance_side)side, .repeat = 1};
	return n;
}

static void check_room(const struct room *room)
{
	static struct balance_trial trials[TRIALS];
	struct world *w = room->build();
	size_t count = all_trials(trials);
	unsigned faults = 0;
	balance_run(w, room->name, trials, count, dice_count(48), 800);
	for (size_t i = 0; i < count; i++) {
		if (trials[i].expected == 0)
			continue;
		struct balance_verdict v = balance_judge(&trials[i]);
		balance_print(room->name, &trials[i], &v);
		faults += !v.balanced;
	}
	world_free(w);
	assert_true(faults == 0);
}

static void test_room(void **state)
{
	check_room(*state);
}

int main(void)
{
	struct CMUnitTest tests[16] = {0};
	const char *only = getenv("ROOM");
	size_t n = 0;
	for (const struct room *r = rooms; r->name; r++)
		if (!only || strcmp(only, r->name) == 0)
			tests[n++] = (struct CMUnitTest){r->name, test_room, NULL, NULL, (void *)(uintptr_t)r};
	return _cmocka_run_group_tests("balance", tests, n, NULL, NULL);
}
