/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Detailed balance (balance.h): starts in proportion to f, a proposal from each, and sums of a phi(X, Y) per group for
 * all functions. balance_judge tests each sum against 0 by Student's t and computes the smallest fault that it would
 * find.
 */
#include "tests/support/balance.h"

#include "tests/support/stats.h"
#include "worker/render/mutation/heuristic.h"
#include "tests/support/path_check.h"
#include "worker/render/path/full_path_density.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Limit on the comparisons in the whole suite. */
#define COMPARISONS 16384
#define LEVEL (1e-4 / COMPARISONS)

enum {
	FUNCTION_INTENSITY = 4,
	FUNCTION_H_1 = 14,
	FUNCTION_H_K_1,
	FUNCTION_TURN = 20,
	/* The following depend on the move between x and y, not only on x and y. */
	FUNCTION_TRANSFER,
	FUNCTION_STEPS,
	FUNCTION_CHOICE,
	FUNCTION_F,
	FUNCTION_FIXED,
	FUNCTION_EMITTER,
	FUNCTION_BACK,
};

static const char *const function_names[BALANCE_FUNCTIONS] = {
	"film x",
	"film y",
	"film's centre",
	"even columns",
	"intensity",
	"wavelength",
	"x_k-1 x",
	"x_k-1 z",
	"x_1 y",
	"x_1 z",
	"x_0 x",
	"x_0 z",
	"lengths",
	"last length",
	"h_1",
	"h_k-1",
	"roughness",
	"edges",
	"aperture",
	"cosine at x_1",
	"wavelength's turn",
	"transfer",
	"steps",
	"choice",
	"f",
	"fixed part",
	"emitter",
	"way back",
};

/* The ray that found a vertex and the ray that tests its visibility end at points that differ by rounding, so at the
 * edge of a triangle the answers may differ. Allowed for about one in 100,000 accepted proposals. */
#define DOUBTS_MAX 2

/* The way back is tested for one in so many proposals. */
enum { WAY_BACK_INTERVAL = 4 };

/* Half vectors, and values derived from them, are as exact as walks are: smaller differences are meaningless. */
#define WALK_TOLERANCE 0.003
/* Rounding error of numbers that should be equal. */
#define ROUNDING 1e-9

/* Returns |h_j| and its accuracy; 0 at exactly specular vertices and events in a medium. */
static double half_vector_length(const struct full_path *x, unsigned j, double *tolerance)
{
	if (j == 0 || j >= x->edges || x->v[j].is_delta || x->v[j].kind == VERTEX_MEDIUM)
		return 0;
	vec2 h = halfvec_of(x, j);
	*tolerance = WALK_TOLERANCE * fmin(x->v[j].bsdf->min_alpha, 1);
	return hypot(h.x, h.y);
}

static void evaluate_functions(struct path_context *c, struct full_path *x, double *g, double *tolerance)
{
	unsigned k = x->edges;
	double lengths = 0, roughness = 0;
	for (unsigned e = 0; e < k; e++)
		lengths += log(x->edge[e].distance2);
	for (unsigned j = 1; j < k; j++)
		if (x->v[j].kind == VERTEX_SURFACE)
			roughness += x->v[j].is_delta ? 0 : fmin(x->v[j].bsdf->mean_alpha, 1);
	double first_tolerance = 0, last_tolerance = 0;
	double first = half_vector_length(x, 1, &first_tolerance), last = half_vector_length(x, k - 1, &last_tolerance);
	vec3 last_point = x->v[k - 1].x.p, first_point = x->v[k > 1 ? 1 : 0].x.p, light_point = x->v[0].x.p;
	const double values[BALANCE_FUNCTIONS] = {
		x->film[0],
		x->film[1],
		hypot(x->film[0] - 16, x->film[1] - 16),
		fmod(floor(x->film[0]), 2),
		full_path_log_f(c, x),
		x->wavelength_u,
		last_point.x,
		last_point.z,
		first_point.y,
		first_point.z,
		light_point.x,
		light_point.z,
		lengths,
		x->edge[k - 1].distance2,
		first,
		last,
		roughness,
		k,
		x->v[k].x.p.x,
		k > 1 ? fabs(vec3_dot(x->v[1].x.sh.n, x->edge[0].w)) : 0,
		x->wavelength_u,
	};
	for (int i = 0; i < FUNCTION_TRANSFER; i++) {
		g[i] = values[i];
		tolerance[i] = ROUNDING * fabs(values[i]);
	}
	tolerance[FUNCTION_H_1] += first_tolerance;
	tolerance[FUNCTION_H_K_1] += last_tolerance;
}

struct trial_run {
	const char *test;
	struct path_context *c;
	struct mutation_ctx *m;
	struct full_path *x, *y;
	double weight, strict_weight; /* weight: of strategies that keep the number of edges; strict_weight: of all */
	double values[BALANCE_FUNCTIONS], tolerance[BALANCE_FUNCTIONS]; /* values for x */
	uint64_t checked, doubts;
};

static bool trial_applies(const struct balance_trial *t, unsigned k)
{
	int b = t->setting.b, c = t->setting.c;
	if (b > (int)k || (b > 0 && c >= b) || (t->side == BALANCE_CAMERA && b != (int)k))
		return false;
	return !(t->side == BALANCE_TRACED && b == (int)k);
}

static bool is_positive_weight(const struct balance_trial *t, double log_weight)
{
	if (isnan(log_weight) || log_weight == INFINITY)
		fail_msg("%s: a weight of %g", t->ops->name, log_weight);
	return log_weight > -INFINITY;
}

/* Computes the acceptance probability as the chain does. */
static double acceptance_probability(struct trial_run *r, struct balance_trial *t, struct proposal_move *move)
{
	enum proposal_result end = t->ops->propose(t->ops, r->m, &t->setting, r->x, r->y, move);
	double to_y = end ? -INFINITY : t->ops->log_weight(r->m, r->y, move, MUTATION_FORWARD);
	if (!end && !is_positive_weight(t, to_y))
		end = PROPOSAL_BLACK;
	t->counters[proposal_counter(end)]++;
	if (end)
		return 0;
	double to_x = t->ops->log_weight(r->m, r->x, move, MUTATION_REVERSE);
	if (!is_positive_weight(t, to_x))
		fail_msg("%s: from y the path x is black", t->ops->name);
	return exp(fmin(to_y - to_x, 0));
}

static void check_accepted(struct trial_run *r, struct balance_trial *t)
{
	char text[200], name[48];
	t->accepted++;
	if (t->is_broken)
		return;
	r->checked++;
	if (path_check(r->c, r->y, text, sizeof text))
		return;
	if (strstr(text, "occluded")) {
		r->doubts++;
		return;
	}
	balance_format_name(t, name);
	fail_msg("%s, %s: %s", r->test, name, text);
}

static bool is_same_media(const struct path_edge *a, const struct path_edge *b)
{
	return a->medium == b->medium && a->previous_medium == b->previous_medium &&
	       a->has_matching_media == b->has_matching_media &&
	       memcmp(&a->scattering_transmittance, &b->scattering_transmittance, sizeof a->scattering_transmittance) ==
		       0;
}

/* Turns y back into x, by the vertices that the move names. */
static void restore_path(struct trial_run *r, const struct balance_trial *t, const struct proposal_move *move)
{
	const struct full_path *x = r->x;
	struct full_path *y = r->y;
	bool all = t->ops->is_independent || y->edges != x->edges;
	full_path_copy(y, x, all ? 0 : move->first, all ? x->edges : move->last);
	for (unsigned i = 0; i <= x->edges; i++) {
		const struct path_vertex *a = &x->v[i], *b = &y->v[i];
		bool same = memcmp(&a->x.p, &b->x.p, sizeof a->x.p) == 0 && a->kind == b->kind && a->mode == b->mode &&
			    a->is_delta == b->is_delta && a->bsdf == b->bsdf && a->emitter == b->emitter &&
			    (i == x->edges || (memcmp(&x->edge[i], &y->edge[i], sizeof x->edge[i]) == 0 &&
					       is_same_media(&a->edge, &b->edge)));
		if (!same)
			fail_msg("%s, %s: vertex %u of %u is not what it was", r->test, t->ops->name, i, x->edges);
	}
	assert_true(y->edges == x->edges && y->film[0] == x->film[0] && y->film[1] == x->film[1] &&
		    y->wavelength_u == x->wavelength_u);
}

static double clamp_to_unit(double d)
{
	return isnan(d) ? 0 : fmin(fmax(d, -1), 1);
}

static void compare_functions(const struct trial_run *r, const double *g, const double *tolerance, double *phi)
{
	for (int i = 0; i < FUNCTION_TRANSFER; i++) {
		double d = g[i] - r->values[i];
		/* An angle enters by its sine, so that about half of the pairs from each x have either sign. */
		if (i == FUNCTION_TURN)
			d = sin(2 * M_PI * d);
		phi[i] = fabs(d) > tolerance[i] + r->tolerance[i] ? copysign(1, d) : 0;
	}
}

/* Returns log P(b) P(c | b) by the heuristic. */
static double log_choice_probability(struct trial_run *r, const struct full_path *x, const struct proposal_move *move)
{
	double weight[FULL_PATH_VERTICES_MAX], p;
	heuristic_roughness.weigh_b(r->c, x, weight);
	p = heuristic_probability(weight, x->edges + 1, move->b);
	if (move->b > 0) {
		heuristic_roughness.weigh_c(r->c, x, move->b, weight);
		p *= heuristic_probability(weight, move->b, move->c);
	}
	return log(p);
}

static double log_fixed_part(struct trial_run *r, struct full_path *x, const struct proposal_move *move)
{
	double sum = 0;
	for (unsigned j = 0; j < move->c; j++)
		sum += log(spectrum_max(full_path_eval_f(r->c, x, j)));
	return sum;
}

/* Returns whether a walk from y towards the half vectors of x fails to lead to x: there is no way back. */
static bool has_no_way_back(struct trial_run *r, const struct proposal_move *move)
{
	static struct full_path back;
	static struct walk_scratch scratch;
	struct walk_target target[FULL_PATH_VERTICES_MAX];
	const struct full_path *x = r->x, *y = r->y;
	unsigned b = move->b, c = move->c;
	full_path_copy(&back, y, 0, y->edges);
	back.v[b] = x->v[b];
	back.v[c] = x->v[c];
	back.wl = x->wl;
	back.wavelength_u = x->wavelength_u;
	double max_distance = 0;
	for (unsigned j = c + 1; j < b; j++) {
		max_distance = fmax(max_distance, vec3_length(vec3_sub(y->v[j].x.p, x->v[j].x.p)));
		bool delta = x->v[j].is_delta;
		target[j].h = delta ? (vec2){0, 0} : halfvec_of(x, j);
		const double *sigma = r->m->scratch.step[MUTATION_FORWARD][j].sigma;
		target[j].tolerance =
			delta ? 1e-9 : 1e-3 * fmin(fmin(x->v[j].bsdf->min_alpha, 1), fmin(sigma[0], sigma[1]));
	}
	if (halfvec_walk(r->c, &back, b, c, target, true, &r->m->limits, WALK_STALE_ALL, &scratch) != WALK_OK)
		return true;
	for (unsigned j = c + 1; j < b; j++)
		if (vec3_length(vec3_sub(back.v[j].x.p, x->v[j].x.p)) > 0.01 * max_distance + 1e-9)
			return true;
	return false;
}

/* Adds the differences of the parts of the densities, in which an omission from the ratio shows first, and whether
 * there is a way back: if there is none phi is 1, and the pair for which it is -1 is never proposed. */
static void compare_densities(struct trial_run *r, const struct balance_trial *t, double log_f,
			      const struct proposal_move *move, double *phi)
{
	for (int i = FUNCTION_TRANSFER; i < BALANCE_FUNCTIONS; i++)
		phi[i] = 0;
	phi[FUNCTION_F] = clamp_to_unit(log_f - r->values[FUNCTION_INTENSITY]);
	double emitter = log(path_pdf_emitter(r->c, &r->y->v[0]) / path_pdf_emitter(r->c, &r->x->v[0]));
	phi[FUNCTION_EMITTER] = fabs(emitter) > ROUNDING ? clamp_to_unit(emitter) : 0;
	if (t->ops->is_independent)
		return;
	phi[FUNCTION_TRANSFER] =
		clamp_to_unit(move->log_transfer[MUTATION_FORWARD] - move->log_transfer[MUTATION_REVERSE]);
	phi[FUNCTION_STEPS] = clamp_to_unit(move->log_density[MUTATION_FORWARD] - move->log_density[MUTATION_REVERSE]);
	phi[FUNCTION_CHOICE] =
		clamp_to_unit(log_choice_probability(r, r->y, move) - log_choice_probability(r, r->x, move));
	phi[FUNCTION_FIXED] = clamp_to_unit(log_fixed_part(r, r->y, move) - log_fixed_part(r, r->x, move));
	if (move->b > move->c + 1 && r->m->step % WAY_BACK_INTERVAL == 0)
		phi[FUNCTION_BACK] = has_no_way_back(r, move);
}

static void test_proposal(struct trial_run *r, struct balance_trial *t, unsigned group)
{
	struct proposal_move move = {0};
	double u[4], h[BALANCE_FUNCTIONS], tolerance[BALANCE_FUNCTIONS];
	r->m->counters = t->counters;
	r->m->step++;
	t->pairs++;
	double a = acceptance_probability(r, t, &move), w = a * (t->ops->is_independent ? r->strict_weight : r->weight);
	if (a > 0) {
		double phi[BALANCE_FUNCTIONS];
		t->acceptance_sum += a;
		evaluate_functions(r->c, r->y, h, tolerance);
		compare_functions(r, h, tolerance, phi);
		compare_densities(r, t, h[FUNCTION_INTENSITY], &move, phi);
		for (int i = 0; i < BALANCE_FUNCTIONS; i++) {
			t->phi_sum[group][i] += w * phi[i];
			t->abs_phi_sum[group][i] += w * fabs(phi[i]);
		}
		mutation_draw_uniforms(r->m, BLOCK_STRATEGY, u);
		if (u[1] < a)
			check_accepted(r, t);
	}
	restore_path(r, t, &move);
}

static void run_group(struct trial_run *r, unsigned group, struct starts *s, struct balance_trial *trials, size_t count,
		      size_t starts, const double *scale)
{
	for (unsigned k = 1; k <= BALANCE_EDGES_MAX; k++) {
		double u[4], weight = starts_contribution(s, k);
		rng_uniform4(r->m->seed, RNG_TEST, group, k, 0, u);
		for (size_t i = 0; i < starts && weight > 0; i++) {
			if (!starts_make_path(s, k, ((double)i + u[0]) / (double)starts, r->x))
				continue;
			full_path_copy(r->y, r->x, 0, k);
			r->strict_weight = weight;
			r->weight = weight / scale[k];
			evaluate_functions(r->c, r->x, r->values, r->tolerance);
			for (size_t j = 0; j < count; j++)
				for (unsigned n = 0; n < trials[j].proposals_per_start && trial_applies(&trials[j], k);
				     n++)
					test_proposal(r, &trials[j], group);
		}
	}
}

void balance_run(const struct world *w, const char *test, struct balance_trial *trials, size_t count, size_t starts,
		 size_t pairs)
{
	static struct path_context c;
	static struct mutation_ctx m;
	static struct full_path x, y;
	static uint64_t counters[BATCH_COUNTERS];
	starts_init_context(&c, w, 1, BALANCE_EDGES_MAX, counters);
	m.path = &c;
	m.seed = stats_seed(test);
	m.limits = walk_limits_of(&accuracy_settings_default);
	struct trial_run r = {.test = test, .c = &c, .m = &m, .x = &x, .y = &y};
	static struct starts s[BALANCE_GROUPS];
	double scale[BALANCE_EDGES_MAX + 1] = {0}; /* gives all lengths equal weight */
	for (unsigned g = 0; g < BALANCE_GROUPS; g++) {
		starts_init(&s[g], &c, m.seed, g, pairs);
		for (unsigned k = 1; k <= BALANCE_EDGES_MAX; k++)
			scale[k] += starts_contribution(&s[g], k) / BALANCE_GROUPS;
	}
	for (unsigned g = 0; g < BALANCE_GROUPS; g++) {
		m.chain = g;
		m.step = 0;
		run_group(&r, g, &s[g], trials, count, starts, scale);
		starts_fini(&s[g]);
	}
	if (r.doubts > DOUBTS_MAX + r.checked / 10000)
		fail_msg("%s: %llu of %llu accepted proposals have edges that are occluded", test,
			 (unsigned long long)r.doubts, (unsigned long long)r.checked);
}

static double critical_t(void)
{
	double low = 0, high = 100;
	for (int i = 0; i < 60; i++) {
		double t = 0.5 * (low + high);
		if (stats_student_t_p(t, BALANCE_GROUPS - 1) > LEVEL)
			low = t;
		else
			high = t;
	}
	return high;
}

/* Estimates the ratio's relative fault from function i, with its standard error. Returns false if that is
 * impossible. */
static bool estimate_fault(const struct balance_trial *t, int i, double *fault, double *error)
{
	double column[BALANCE_GROUPS], size = 0;
	for (int g = 0; g < BALANCE_GROUPS; g++) {
		column[g] = t->phi_sum[g][i];
		size += t->abs_phi_sum[g][i] / BALANCE_GROUPS;
	}
	struct stats_mean s = stats_mean_test(column, BALANCE_GROUPS, 0);
	if (!(s.error > 0) || !(size > 0))
		return false;
	/* A ratio that is wrong by the factor 1 + d in one direction shifts a phi by d / 2 of |a phi|. */
	*fault = 2 * s.mean / size;
	*error = 2 * s.error / size;
	return true;
}

static void add_verdict(struct balance_verdict *v, int i, double fault, double error)
{
	double p = stats_student_t_p(fault / error, BALANCE_GROUPS - 1);
	v->power = fmin(v->power, (critical_t() + 1.645) * error);
	if (p < v->p) {
		v->t = fault / error;
		v->p = p;
		v->fault = fault;
		v->function_name = function_names[i];
	}
	v->is_balanced = !(v->p < LEVEL);
}

static const struct balance_verdict initial_verdict = {
	.p = 1, .power = INFINITY, .function_name = "", .is_balanced = true};

struct balance_verdict balance_judge(const struct balance_trial *t)
{
	struct balance_verdict v = initial_verdict;
	double fault, error;
	for (int i = 0; i < BALANCE_FUNCTIONS; i++)
		if (estimate_fault(t, i, &fault, &error))
			add_verdict(&v, i, fault, error);
	return v;
}

void balance_pool_add(struct balance_pool *p, const struct balance_trial *t)
{
	double fault, error;
	for (int i = 0; i < BALANCE_FUNCTIONS; i++)
		if (estimate_fault(t, i, &fault, &error)) {
			p->precision[i] += 1 / (error * error);
			p->weighted_fault[i] += fault / (error * error);
		}
}

struct balance_verdict balance_pool_judge(const struct balance_pool *p)
{
	struct balance_verdict v = initial_verdict;
	for (int i = 0; i < BALANCE_FUNCTIONS; i++)
		if (p->precision[i] > 0)
			add_verdict(&v, i, p->weighted_fault[i] / p->precision[i], 1 / sqrt(p->precision[i]));
	return v;
}

void balance_format_name(const struct balance_trial *t, char text[48])
{
	static const char *const sides[] = {"", " (b = k)", " (b < k)"};
	char forced[16] = "";
	if (t->setting.b >= 0)
		snprintf(forced, sizeof forced, t->setting.b ? "@b%dc%d" : "@b%d", t->setting.b % 100,
			 t->setting.c % 100);
	snprintf(text, 48, "%.16s%s%s", t->ops->name, forced, sides[t->side]);
}

void balance_print(const char *test, const struct balance_trial *t, const struct balance_verdict *v)
{
	char name[48];
	balance_format_name(t, name);
	printf("%-14s %-22s %8llu pairs, accepted %.3f, reverse failed %.3f, worst t %+6.2f (%s), finds %5.1f %%%s\n",
	       test, name, (unsigned long long)t->pairs, t->acceptance_sum / (double)t->pairs,
	       (double)t->counters[STRATEGY_FAIL_REVERSE] / (double)t->pairs, v->t, v->function_name, 100 * v->power,
	       v->is_balanced ? "" : " NOT BALANCED");
}
