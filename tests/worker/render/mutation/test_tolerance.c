/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Halving the tolerances of the walks, in both directions, changes no image. From the same states and random numbers,
 * one proposal is made with the default tolerances and one with half of them. The expected contributions of the chain
 * to the film are compared block by block; differences of pairs leave hardly any noise, so that 0.4 % on a block is
 * found with 95 % probability. t between 16 groups, level 1e-6 per comparison. If both proposals arrive, their film
 * points agree to a fiftieth of a pixel.
 */
#include "tests/support/dice.h"
#include "tests/support/rooms.h"
#include "tests/support/starts.h"
#include "tests/support/stats.h"
#include "worker/render/math/rng.h"
#include "worker/render/mutation/mutation.h"
#include "worker/render/world/build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { GROUPS = 16, BLOCKS = 4, EDGES = 5, PAIRS = 2000, STARTS = 2000 };
#define LEVEL 1e-6

static struct path_context context;
static struct mutation_ctx mutation;
static struct full_path x, y[2];

struct tally {
	uint64_t proposals, only_one_arrived, both_arrived;
	double max_distance; /* pixels between the two proposals, if both arrived */
	double film[2][BLOCKS + 1][GROUPS];
};

static unsigned block_of(const double film[2])
{
	return (film[0] >= 16) + 2u * (film[1] >= 16);
}

static double propose_with_tolerance(const struct mutation_ops *ops, double scale, struct full_path *into)
{
	const struct mutation_forced_choice how = {-1, -1};
	struct proposal_move move = {0};
	full_path_copy(into, &x, 0, x.edges);
	mutation.limits = walk_limits_of(&accuracy_settings_default);
	mutation.limits.tolerance_scale = scale;
	if (ops->propose(ops, &mutation, &how, &x, into, &move))
		return 0;
	double to_y = ops->log_weight(&mutation, into, &move, MUTATION_FORWARD);
	return exp(fmin(to_y - ops->log_weight(&mutation, &x, &move, MUTATION_REVERSE), 0));
}

static void compare_one(const struct mutation_ops *ops, int group, struct tally *t)
{
	double a[2];
	for (int i = 0; i < 2; i++) {
		a[i] = propose_with_tolerance(ops, i ? 0.5 : 1, &y[i]);
		t->film[i][block_of(x.film)][group] += 1 - a[i];
		if (a[i] > 0)
			t->film[i][block_of(y[i].film)][group] += a[i];
		t->film[i][BLOCKS][group] += a[i];
	}
	t->proposals++;
	t->only_one_arrived += (a[0] > 0) != (a[1] > 0);
	if (!(a[0] > 0 && a[1] > 0))
		return;
	t->both_arrived++;
	t->max_distance = fmax(t->max_distance, hypot(y[0].film[0] - y[1].film[0], y[0].film[1] - y[1].film[1]));
}

enum { STRATEGIES = 2 };
static const char *const strategy_names[STRATEGIES] = {"hslt", "halfvec"};

/* Runs both strategies from the same starts, whose search takes a third of the time. */
static void run_group(const struct room *room, int group, struct tally t[STRATEGIES])
{
	struct starts s;
	char test[64];
	snprintf(test, sizeof test, "tolerance %s", room->name);
	uint64_t seed = stats_seed(test);
	starts_init(&s, &context, seed, (uint64_t)group, dice_scaled_count(PAIRS));
	for (unsigned k = 2; k <= EDGES; k++)
		for (uint64_t i = 0; i < dice_scaled_count(STARTS) / EDGES; i++) {
			double r[4];
			rng_uniform4(seed + 1, RNG_TEST, i, k, (uint64_t)group, r);
			if (!starts_make_path(&s, k, r[0], &x))
				continue;
			mutation.seed = seed;
			mutation.chain = (uint64_t)group;
			mutation.step = i * EDGES + k;
			for (int m = 0; m < STRATEGIES; m++)
				compare_one(mutation_find(strategy_names[m], strlen(strategy_names[m])), group, &t[m]);
		}
	starts_fini(&s);
}

static void assert_no_bias(const struct room *room, const char *name, const struct tally *t)
{
	char test[64];
	snprintf(test, sizeof test, "tolerance %s %s", room->name, name);
	double worst = 0, error = 0;
	for (int b = 0; b <= BLOCKS; b++) {
		double difference[GROUPS], sum = 0;
		for (int g = 0; g < GROUPS; g++)
			sum += t->film[0][b][g] / GROUPS;
		for (int g = 0; g < GROUPS; g++)
			difference[g] = (t->film[1][b][g] - t->film[0][b][g]) / sum;
		struct stats_mean m = stats_mean_test(difference, GROUPS, 0);
		if (m.error > 0 && m.p < LEVEL)
			fail_msg("%s: block %d changes by %.3g %% +- %.2g %%", test, b, 100 * m.mean, 100 * m.error);
		worst = fmax(worst, fabs(m.mean));
		error = fmax(error, m.error);
	}
	print_message(
		"%-32s %6llu pairs, %5.2f %% arrive with one tolerance only; film points differ by up to %.1e pixels; blocks by up to "
		"%.3f %%, finds %.3f %%\n",
		test, (unsigned long long)t->proposals, 100 * (double)t->only_one_arrived / (double)t->proposals,
		t->max_distance, 100 * worst, 100 * 9.4 * error);
	/* In fog, few paths have no scattering event between the camera and the light, and half-vector walks do not
	 * pass such events. */
	bool fog = strcmp(room->name, "fog") == 0 || strcmp(room->name, "misfit") == 0;
	unsigned rare = fog ? 50 : 5;
	assert_true(t->both_arrived * rare > t->proposals && t->max_distance < 0.02);
	assert_true(dice_scaled_count(STARTS) < STARTS || 9.4 * error < 0.004);
}

static void check_room(const struct room *room)
{
	static struct tally t[STRATEGIES];
	static uint64_t counters[BATCH_COUNTERS], counts[STRATEGY_COUNTERS];
	struct world *w = room->build();
	memset(t, 0, sizeof t);
	starts_init_context(&context, w, 2, EDGES, counters);
	mutation.path = &context;
	mutation.counters = counts;
	for (int g = 0; g < GROUPS; g++)
		run_group(room, g, t);
	world_free(w);
	for (int m = 0; m < STRATEGIES; m++)
		assert_no_bias(room, strategy_names[m], &t[m]);
}

static void halved_tolerances_change_no_image(void **state)
{
	(void)state;
	for (const struct room *r = rooms; r->name; r++)
		check_room(r);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(halved_tolerances_change_no_image)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
