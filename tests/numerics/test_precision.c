/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Acceptance ratios of walks from the camera to the light, computed from the positions of the vertices: those of the
 * program against an independent implementation in long double (weight.inc), and the results of the same formulas in
 * double and in float. Densities of the steps are left out (test_stepsize.c has them).
 */
#include "tests/numerics/rows.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/chain/path_state.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/mutation/mutation.h"
#include "worker/render/path/integrator.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <tgmath.h>

#include <cmocka.h>

enum { WEIGHT_MOST = 8 };

#define REAL float
#define N(name) in_float_##name
#include "tests/numerics/weight.inc"
#undef REAL
#undef N
#define REAL double
#define N(name) in_double_##name
#include "tests/numerics/weight.inc"
#undef REAL
#undef N
#define REAL long double
#define N(name) in_long_##name
#include "tests/numerics/weight.inc"
#undef REAL
#undef N

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
/* clang-format off */
#define SCENE                                                                                                                   \
	SENSOR("0,0.2,1.9", "0,-0.3,-1")                                                                                        \
	"<shape type='cube'>" AT("<scale value='2'/>") "<bsdf type='diffuse'><float name='reflectance' value='0.5'/></bsdf></shape>"  \
	"<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>")                         \
	"<emitter type='area'><float name='radiance' value='3'/></emitter></shape>"                                               \
	"<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>"                         \
	"<bsdf type='roughdielectric'><float name='int_ior' value='%.17g'/><float name='ext_ior' value='1'/><float name='alpha' "   \
	"value='%.17g'/></bsdf></shape>"
/* clang-format on */

struct precision_case {
	const char *name;
	double index, alpha;
	unsigned edges;
	double max_error; /* of the program, in the logarithm of the acceptance ratio */
};

static const struct precision_case cases[] = {
	{"roughness 0.3", 1.5, 0.3, 4, 2e-11},
	{"roughness 0.01", 1.5, 0.01, 4, 2e-11},
	{"roughness 1e-4", 1.5, 1e-4, 4, 1e-9},
	{"roughness 1e-6", 1.5, 1e-6, 4, 1e-7},
	{"index 1.01", 1.01, 0.1, 4, 2e-11},
	{"index 1 + 1e-4, roughness 0.3", 1.0001, 0.3, 4, 2e-9},
	{"index 1 + 1e-6, roughness 0.5", 1.000001, 0.5, 4, 3e-7},
	{"7 edges, roughness 0.1", 1.5, 0.1, 7, 2e-11},
};

struct errors {
	unsigned count, wrong_in_float; /* wrong_in_float: cases in which float's acceptance is off by more than 1 % */
	double max_program_error, max_double_error, in_float, *float_errors;
};

static int compare_errors(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

static void record_errors(struct errors *e, double program, const struct world *w, const struct full_path *x,
			  const struct full_path *y)
{
	long double truth = in_long_log_weight(w, y) - in_long_log_weight(w, x);
	double double_value = in_double_log_weight(w, y) - in_double_log_weight(w, x);
	double float_value = (double)(in_float_log_weight(w, y) - in_float_log_weight(w, x));
	double accept = (double)exp(fmin(truth, 0.0L)), float_error = fabs((double)(float_value - truth));
	/* A NaN counts as infinite. */
	double program_error = (double)fabs(program - truth);
	e->max_program_error = fmax(e->max_program_error, isfinite(program_error) ? program_error : INFINITY);
	e->max_double_error = fmax(e->max_double_error, (double)fabs(double_value - truth));
	e->float_errors[e->count++] = isfinite(float_error) ? float_error : INFINITY;
	e->wrong_in_float += !(fabs(exp(fmin(float_value, 0.0)) - accept) <= 0.01);
}

static void run_case(const struct precision_case *p, unsigned max_proposals, struct errors *e)
{
	static struct path_context c;
	static struct mutation_ctx m;
	static struct full_path x, y;
	static uint64_t counters[BATCH_COUNTERS], strategy[STRATEGY_COUNTERS];
	const struct mutation_ops *ops = mutation_find("hslt", 4);
	const struct mutation_forced_choice setting = {(int)p->edges, 0};
	struct world *w = world_from_text(32, 32, SCENE, p->index, p->alpha);
	uint64_t seed = stats_seed(p->name);
	c = (struct path_context){
		.w = w, .window = {0, 0, 32, 32}, .min_depth = p->edges, .max_depth = p->edges, .counters = counters};
	m = (struct mutation_ctx){
		.path = &c, .seed = seed, .counters = strategy, .limits = walk_limits_of(&accuracy_settings_default)};
	for (uint64_t i = 0; e->count < max_proposals && i < 400 * max_proposals; i++) {
		struct proposal_move move = {0};
		bool is_refracted = false;
		if (!path_choose_seed(&c, seed, i, &x) || x.edges == 0)
			continue;
		for (unsigned j = 1; j < p->edges; j++)
			is_refracted |= x.v[j].bsdf->eta != 1;
		if (!is_refracted)
			continue;
		full_path_copy(&y, &x, 0, x.edges);
		m.chain = i;
		if (ops->propose(ops, &m, &setting, &x, &y, &move))
			continue;
		double to_y = ops->log_weight(&m, &y, &move, MUTATION_FORWARD),
		       to_x = ops->log_weight(&m, &x, &move, MUTATION_REVERSE);
		double program = to_y - to_x + move.log_density[MUTATION_FORWARD] - move.log_density[MUTATION_REVERSE];
		if (isfinite(program))
			record_errors(e, program, w, &x, &y);
	}
	world_free(w);
}

static void test_precision(void **state)
{
	(void)state;
	struct rows rows = {0, 0};
	unsigned max_proposals = (test_is_full() ? 20000 : 1000) / test_scale();
	double *float_errors = calloc(max_proposals, sizeof *float_errors);
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct errors e = {.float_errors = float_errors};
		char measured[300], bound[64];
		run_case(&cases[i], max_proposals, &e);
		qsort(float_errors, e.count, sizeof *float_errors, compare_errors);
		snprintf(
			measured, sizeof measured,
			"%u proposals: log acceptance is off by at most %.1e (these formulas in double %.1e); in float "
			"by %.1e in the median, at most %.1e, acceptance wrong by more than 1 %% in %.1f %%",
			e.count, e.max_program_error, e.max_double_error, e.count ? float_errors[e.count / 2] : 0,
			e.count ? float_errors[e.count - 1] : 0, 100.0 * e.wrong_in_float / (e.count ? e.count : 1));
		snprintf(bound, sizeof bound, "%.0e", cases[i].max_error);
		rows_add(&rows, "precision", cases[i].name, measured, bound,
			 e.count > max_proposals / 4 && e.max_program_error <= cases[i].max_error);
	}
	free(float_errors);
	printf("precision: %u cases, %u failed\n", rows.cases, rows.failed);
	assert_int_equal(rows.failed, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_precision)};
	return cmocka_run_group_tests_name("precision", tests, NULL, NULL);
}
