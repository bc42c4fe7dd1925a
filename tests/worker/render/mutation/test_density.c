/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The ratio of f and T stated by mutations, against both multiplied out per area
 * (tests/worker/render/mutation/explicit.h). They agree to rounding.
 */
#include "tests/support/dice.h"
#include "tests/support/rooms.h"
#include "tests/support/starts.h"
#include "tests/support/stats.h"
#include "tests/worker/render/mutation/explicit.h"
#include "tests/worker/render/mutation/scenes.h"
#include "worker/render/path/full_path_density.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { EDGES = 8, TRIALS = 48 };

/* Tolerance of logarithms, relative where they are large. Measured: 2e-11. */
#define TOLERANCE 1e-9
/* Tolerance of steps recomputed from the half vectors of y; the error grows with their length. Measured: 7e-7 once,
 * else 3e-10. */
#define STEP_TOLERANCE 1e-4

struct trial {
	const struct mutation_ops *ops;
	struct mutation_forced_choice forced;
	unsigned long compared, mismatches;
	double max_error, max_choice_error;
};

static struct mutation_ctx m;
static struct path_context c;
static uint64_t counters[BATCH_COUNTERS], strategy_counters[STRATEGY_COUNTERS];

static size_t all_trials(struct trial *t)
{
	size_t n = 0;
	for (size_t i = 0; mutation_registry[i]; i++)
		if (!mutation_registry[i]->is_independent)
			t[n++] = (struct trial){.ops = mutation_registry[i], .forced = {-1, -1}};
	for (int b = 1; b <= EDGES; b++)
		for (int end = 0; end < b; end++)
			t[n++] = (struct trial){.ops = mutation_find("hslt", 4), .forced = {b, end}};
	return n;
}

static double log_t(const struct trial *t, const struct proposal_move *move, const struct full_path *x,
		    const struct full_path *y, double sign, double *log_choices)
{
	unsigned b = move->b, end = move->c;
	*log_choices = 0;
	if (b > 0 && b == end)
		return 0;
	bool steps = strcmp(t->ops->name, "hslt") == 0 || strcmp(t->ops->name, "halfvec") == 0;
	double sum = explicit_log_selection(&c, t->ops->name, &t->forced, x, b, end);
	sum += explicit_log_traced_part(&c, x, y, b, log_choices);
	sum += explicit_log_walked_part(&c, x, y, b, end, steps ? m.scratch.dh : NULL, sign);
	const struct emitter *em = &c.w->emitters[y->v[0].emitter];
	if (explicit_moves_emitter(t->ops->name, b, end) && em->ops->point_inverse)
		sum += log(path_pdf_emitter(&c, &y->v[0]));
	return sum;
}

static void compare_proposal(struct trial *t, struct full_path *x, struct full_path *y)
{
	struct proposal_move move = {0};
	m.step++;
	m.counters = strategy_counters;
	enum proposal_result end = t->ops->propose(t->ops, &m, &t->forced, x, y, &move);
	double to_y = end ? -INFINITY : t->ops->log_weight(&m, y, &move, MUTATION_FORWARD);
	if (to_y > -INFINITY) {
		double to_x = t->ops->log_weight(&m, x, &move, MUTATION_REVERSE), choices, back;
		double log_t_forward = log_t(t, &move, x, y, 1, &choices),
		       log_t_reverse = log_t(t, &move, y, x, -1, &back);
		double expected = full_path_log_f(&c, y) - full_path_log_f(&c, x) + log_t_reverse - log_t_forward;
		double error = fabs(to_y - to_x - expected) / fmax(1, fabs(expected));
		t->compared++;
		t->mismatches += !(error <= TOLERANCE);
		t->max_error = fmax(t->max_error, isnan(error) ? INFINITY : error);
		double symmetric = fmax(fabs(choices - back), fabs(choices - move.log_symmetric));
		t->max_choice_error = fmax(t->max_choice_error, symmetric / fmax(1, fabs(choices)));
	}
	bool all = y->edges != x->edges;
	full_path_copy(y, x, all ? 0 : move.first, all ? x->edges : move.last);
}

static void print_trial(const char *room, const struct trial *t)
{
	char forced[16] = "";
	if (t->forced.b >= 0)
		snprintf(forced, sizeof forced, "@b%dc%d", t->forced.b % 100, t->forced.c % 100);
	printf("%-14s %10s%-6s %7lu ratios, largest difference %.2g (%lu beyond), of symmetric choices %.2g\n", room,
	       t->ops->name, forced, t->compared, t->max_error, t->mismatches, t->max_choice_error);
}

static void ratio_of_f_and_t_is_the_explicit_one(void **state)
{
	const struct room *room = *state;
	static struct trial trials[TRIALS];
	static struct full_path x, y;
	struct world *w = room->build();
	struct starts s;
	size_t count = all_trials(trials), n = dice_scaled_count(400), bad = 0;
	starts_init_context(&c, w, 1, EDGES, counters);
	m = (struct mutation_ctx){
		.path = &c, .seed = stats_seed(room->name), .limits = walk_limits_of(&accuracy_settings_default)};
	starts_init(&s, &c, m.seed, 0, 2000);
	for (unsigned k = 1; k <= EDGES; k++)
		for (size_t i = 0; i < n; i++) {
			if (!starts_make_path(&s, k, ((double)i + 0.5) / (double)n, &x))
				continue;
			full_path_copy(&y, &x, 0, k);
			for (size_t j = 0; j < count; j++)
				if (trials[j].forced.b <= (int)k)
					compare_proposal(&trials[j], &x, &y);
		}
	for (size_t i = 0; i < count; i++) {
		print_trial(room->name, &trials[i]);
		bad += trials[i].mismatches + (trials[i].max_choice_error > STEP_TOLERANCE);
	}
	starts_fini(&s);
	world_free(w);
	assert_true(bad == 0);
}

/* Light passes between equal indices, through a narrow lobe and a wide one. */
static struct world *make_thin_sheet_world(void)
{
	return world_from_text(
		32, 32, "%s",
		VIEW WALLS LAMP BALL(
			"0,-0.6,-0.3", "0.8",
			"<bsdf type='principledthin'><float name='roughness' value='0.5'/>"
			"<float name='spec_trans' value='0.7'/><float name='diff_trans' value='1'/></bsdf>"));
}

int main(void)
{
	static const struct room sheet = {"thin sheet", make_thin_sheet_world};
	struct CMUnitTest tests[ROOMS_MAX] = {0};
	size_t n = 0;
	for (const struct room *r = rooms; r->name; r++)
		tests[n++] = (struct CMUnitTest){r->name, ratio_of_f_and_t_is_the_explicit_one, NULL, NULL,
						 (void *)(uintptr_t)r};
	tests[n++] = (struct CMUnitTest){sheet.name, ratio_of_f_and_t_is_the_explicit_one, NULL, NULL,
					 (void *)(uintptr_t)&sheet};
	return _cmocka_run_group_tests("density", tests, n, NULL, NULL);
}
