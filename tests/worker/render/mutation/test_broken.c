/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Strategies broken on purpose, built from the real ones: the test of detailed balance must catch each of them, and
 * must pass the real strategy from the same starts. Level and power: tests/support/balance.h.
 */
#include "tests/support/balance.h"
#include "tests/support/dice.h"
#include "tests/support/rooms.h"
#include "worker/render/mutation/heuristic.h"
#include "worker/render/world/build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const struct mutation_ops *intact_ops;
static struct full_path *current_path; /* x of the current proposal */

static enum proposal_result propose(const struct mutation_ops *self, struct mutation_ctx *m,
				    const struct mutation_forced_choice *how, struct full_path *x, struct full_path *y,
				    struct proposal_move *move)
{
	(void)self;
	current_path = x;
	return intact_ops->propose(intact_ops, m, how, x, y, move);
}

static double log_weight(struct mutation_ctx *m, struct full_path *into, const struct proposal_move *move,
			 enum mutation_direction direction)
{
	return intact_ops->log_weight(m, into, move, direction);
}

/* Returns log P(b) P(c | b) by the heuristic. */
static double log_selection(struct mutation_ctx *m, const struct full_path *x, unsigned b, unsigned c)
{
	double weight[FULL_PATH_VERTICES_MAX], p;
	heuristic_roughness.weigh_b(m->path, x, weight);
	p = heuristic_probability(weight, x->edges + 1, b);
	if (b > 0) {
		heuristic_roughness.weigh_c(m->path, x, b, weight);
		p *= heuristic_probability(weight, b, c);
	}
	return log(p);
}

/* Leaves out the probability of choosing b and c: adds that of x for the direction to y, and that of y for the
 * direction to x. */
static double log_weight_without_selection(struct mutation_ctx *m, struct full_path *into,
					   const struct proposal_move *move, enum mutation_direction direction)
{
	static struct full_path *y;
	if (direction == MUTATION_FORWARD)
		y = into;
	return log_weight(m, into, move, direction) +
	       log_selection(m, direction == MUTATION_FORWARD ? current_path : y, move->b, move->c);
}

static double log_weight_denser_upwards(struct mutation_ctx *m, struct full_path *into,
					const struct proposal_move *move, enum mutation_direction direction)
{
	bool up =
		direction == MUTATION_FORWARD && sin(2 * M_PI * (into->wavelength_u - current_path->wavelength_u)) > 0;
	return log_weight(m, into, move, direction) - (up ? log(1.03) : 0);
}

/* A fault that is a function of the state: 10 % where the wavelength lies in the upper half. */
static double log_weight_denser_above(struct mutation_ctx *m, struct full_path *into, const struct proposal_move *move,
				      enum mutation_direction direction)
{
	return log_weight(m, into, move, direction) - (into->wavelength_u > 0.5 ? log(1.1) : 0);
}

static enum proposal_result propose_with_drift(const struct mutation_ops *self, struct mutation_ctx *m,
					       const struct mutation_forced_choice *how, struct full_path *x,
					       struct full_path *y, struct proposal_move *move)
{
	const double mean = 0.1; /* pixels; the deviation is 0.64 */
	x->film[0] += mean;
	enum proposal_result end = propose(self, m, how, x, y, move);
	x->film[0] -= mean;
	return end;
}

static void restore_stale_f(struct path_context *c, struct full_path *y, unsigned j)
{
	y->f[j] = full_path_eval_f(c, current_path, j);
	vertex_set_add(&y->cached_f, j);
}

static double log_weight_with_stale_fixed_part(struct mutation_ctx *m, struct full_path *into,
					       const struct proposal_move *move, enum mutation_direction direction)
{
	for (unsigned j = 0; direction == MUTATION_FORWARD && j < move->c; j++)
		restore_stale_f(m->path, into, j);
	return log_weight(m, into, move, direction);
}

static double log_weight_with_stale_f_c(struct mutation_ctx *m, struct full_path *into,
					const struct proposal_move *move, enum mutation_direction direction)
{
	if (direction == MUTATION_FORWARD)
		restore_stale_f(m->path, into, move->c);
	return log_weight(m, into, move, direction);
}

static double log_weight_with_stale_f_b(struct mutation_ctx *m, struct full_path *into,
					const struct proposal_move *move, enum mutation_direction direction)
{
	if (direction == MUTATION_FORWARD && move->b < into->edges)
		restore_stale_f(m->path, into, move->b);
	return log_weight(m, into, move, direction);
}

static double log_weight_without_transfer(struct mutation_ctx *m, struct full_path *into,
					  const struct proposal_move *move, enum mutation_direction direction)
{
	return log_weight(m, into, move, direction) - move->log_transfer[direction];
}

/* Uses the step sizes of x for the reverse direction from y as well. */
static enum proposal_result propose_with_steps_of_x(const struct mutation_ops *self, struct mutation_ctx *m,
						    const struct mutation_forced_choice *how, struct full_path *x,
						    struct full_path *y, struct proposal_move *move)
{
	enum proposal_result end = propose(self, m, how, x, y, move);
	for (unsigned j = move->c + 1; !end && j < move->b; j++) {
		vec2 back = vec2_scale(-1, m->scratch.dh[j]);
		if (!x->v[j].is_delta)
			move->log_density[MUTATION_REVERSE] +=
				halfvec_step_log_pdf(&m->scratch.step[MUTATION_FORWARD][j], back) -
				halfvec_step_log_pdf(&m->scratch.step[MUTATION_REVERSE][j], back);
	}
	return end;
}

/* Proposes y even if the walk back was refused; only with forced b and c, whose choice has no density. */
static enum proposal_result propose_without_reverse_walk(const struct mutation_ops *self, struct mutation_ctx *m,
							 const struct mutation_forced_choice *how, struct full_path *x,
							 struct full_path *y, struct proposal_move *move)
{
	enum proposal_result end = propose(self, m, how, x, y, move);
	if (end != PROPOSAL_IRREVERSIBLE)
		return end;
	unsigned ends[2] = {move->b, move->c};
	full_path_invalidate(y, move->c + 1, y->edges);
	for (int i = 0; i < 2; i++) {
		if (ends[i] == 0 || ends[i] == y->edges)
			continue;
		y->v[ends[i]].mode = full_path_mode(y, ends[i]);
		if (!y->v[ends[i]].mode)
			return PROPOSAL_MODE_CHANGED;
	}
	return move->b < y->edges || full_path_project(m->path, y) ? PROPOSAL_MADE : PROPOSAL_OUTSIDE;
}

/* Treats the point on the emitter as if all points had the same density. */
static double log_weight_of_flat_emitter(struct mutation_ctx *m, struct full_path *into,
					 const struct proposal_move *move, enum mutation_direction direction)
{
	const struct path_vertex *v = &into->v[0];
	const struct emitter *em = &m->path->w->emitters[v->emitter];
	struct emitter_point p = world_emitter_point(&v->x);
	p.is_infinite = v->kind == VERTEX_INFINITE;
	bool moves = move->b > 0 && move->c == 0 && em->ops->point_inverse;
	return log_weight(m, into, move, direction) + (moves ? log(em->ops->pdf_point(em, &p)) : 0);
}

struct fault {
	const char *name, *room, *strategy;
	struct mutation_forced_choice forced;
	enum balance_side side;
	unsigned starts, repeat;
	enum proposal_result (*propose)(const struct mutation_ops *self, struct mutation_ctx *m,
					const struct mutation_forced_choice *how, struct full_path *x,
					struct full_path *y, struct proposal_move *move);
	double (*log_weight)(struct mutation_ctx *m, struct full_path *into, const struct proposal_move *move,
			     enum mutation_direction direction);
};

static const struct fault faults[] = {
	{"no P(b) P(c)", "gold", "hslt", {-1, -1}, BALANCE_ANY, 64, 2, propose, log_weight_without_selection},
	{"3 % one way", "gold", "wavelength", {-1, -1}, BALANCE_ANY, 64, 64, propose, log_weight_denser_upwards},
	{"10 % in half of the states",
	 "gold",
	 "wavelength",
	 {-1, -1},
	 BALANCE_ANY,
	 256,
	 8,
	 propose,
	 log_weight_denser_above},
	{"film step with a mean", "mirror", "multichain", {-1, -1}, BALANCE_ANY, 64, 2, propose_with_drift, log_weight},
	{"fixed part not evaluated again",
	 "gold",
	 "hslt",
	 {-1, -1},
	 BALANCE_ANY,
	 256,
	 8,
	 propose,
	 log_weight_with_stale_fixed_part},
	{"f_c not evaluated again",
	 "bent normals",
	 "hslt",
	 {-1, -1},
	 BALANCE_ANY,
	 128,
	 8,
	 propose,
	 log_weight_with_stale_f_c},
	{"f_b not evaluated again",
	 "bent normals",
	 "hslt",
	 {-1, -1},
	 BALANCE_ANY,
	 64,
	 2,
	 propose,
	 log_weight_with_stale_f_b},
	{"no transfer determinant",
	 "rough glass",
	 "halfvec",
	 {-1, -1},
	 BALANCE_ANY,
	 64,
	 2,
	 propose,
	 log_weight_without_transfer},
	{"steps of x both ways",
	 "rough glass",
	 "halfvec",
	 {-1, -1},
	 BALANCE_ANY,
	 64,
	 2,
	 propose_with_steps_of_x,
	 log_weight},
	{"no way back", "sky", "hslt", {4, 2}, BALANCE_TRACED, 64, 32, propose_without_reverse_walk, log_weight},
	{"emitter's density", "picture", "light", {-1, -1}, BALANCE_ANY, 64, 2, propose, log_weight_of_flat_emitter},
};

static void fault_is_found_and_intact_strategy_passes(void **state)
{
	const struct fault *f = *state;
	static struct balance_trial t[2];
	struct mutation_ops broken = {.name = f->name, .propose = f->propose, .log_weight = f->log_weight};
	intact_ops = mutation_find(f->strategy, strlen(f->strategy));
	t[0] = (struct balance_trial){
		.ops = intact_ops, .setting = f->forced, .side = f->side, .proposals_per_start = f->repeat};
	t[1] = t[0];
	t[1].ops = &broken;
	t[1].is_broken = true;
	struct world *w = room_build_named(f->room);
	balance_run(w, f->name, t, 2, dice_scaled_count(f->starts), 1000);
	world_free(w);
	struct balance_verdict v[2];
	for (int i = 0; i < 2; i++) {
		v[i] = balance_judge(&t[i]);
		balance_print(f->room, &t[i], &v[i]);
	}
	assert_true(v[0].is_balanced);
	if (dice_scaled_count(16) >= 16)
		assert_false(v[1].is_balanced);
}

int main(void)
{
	enum { FAULTS = sizeof faults / sizeof *faults };
	struct CMUnitTest tests[FAULTS];
	for (size_t i = 0; i < FAULTS; i++)
		tests[i] = (struct CMUnitTest){faults[i].name, fault_is_found_and_intact_strategy_passes, NULL, NULL,
					       (void *)(uintptr_t)&faults[i]};
	return _cmocka_run_group_tests("broken", tests, FAULTS, NULL, NULL);
}
