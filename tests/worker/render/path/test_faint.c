/* SPDX-License-Identifier: Apache-2.0 */
/*
 * bdpt plays Russian roulette with faint connections, with one random number for all connections of a sample. The
 * mean of the sample over all values of this number equals its value with every connection made: an identity that
 * holds for each single sample, so that the test needs no statistics.
 */
#include "worker/render/path/connect.h"
#include "worker/render/path/integrate_bdpt.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { SAMPLES = 150, ROULETTE_NUMBERS = 512 };

/* A sample's random numbers, with a fixed value for the number that decides about faint connections. */
struct fixed_roulette_sampler {
	struct sampler base;
	struct sampler_random random;
	double roulette_number, value[SAMPLER_BLOCK_SIZE];
};

static const double *fixed_roulette_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct fixed_roulette_sampler *p = (struct fixed_roulette_sampler *)(void *)base;
	const double *u = p->random.base.block(&p->random.base, side, vertex);
	if (side != SIDE_CAMERA || vertex != 0)
		return u;
	memcpy(p->value, u, sizeof p->value);
	p->value[DIM_FAINT_CONNECTION] = p->roulette_number;
	return p->value;
}

static struct fixed_roulette_sampler make_fixed_roulette_sampler(uint64_t index, double place)
{
	struct fixed_roulette_sampler p = {.base = {fixed_roulette_block}, .roulette_number = place};
	sampler_random_init(&p.random, 7, RNG_TEST, index, 0);
	return p;
}

/* Returns the contribution (X + Y + Z) of a pair of sub-paths to its own film point with every connection made, and
 * counts the shadow rays traced for it. */
static double trace_all_connections(struct path_context *c, uint64_t index)
{
	double film[2], xyz[3];
	struct fixed_roulette_sampler p = make_fixed_roulette_sampler(index, 0);
	unsigned camera = path_walk_camera(c, &p.base, c->max_depth + 1, film);
	unsigned light = path_walk_light(c, &p.base, c->max_depth);
	spectrum sum = spectrum_constant(0);
	for (unsigned t = 2; t <= camera; t++)
		for (unsigned s = 0; s <= (light > 1 ? light : 1) && s + t - 1 <= c->max_depth; s++)
			sum = spectrum_add(sum, path_connect(c, s, t, PATH_EDGES_MAX, film));
	for (unsigned s = 2; s <= light && s <= c->max_depth; s++)
		path_connect(c, s, 1, PATH_EDGES_MAX, film);
	spectrum_to_xyz(sum, &c->wl, xyz);
	return xyz[0] + xyz[1] + xyz[2];
}

/* Like trace_all_connections(), but as bdpt computes it, with the roulette's number set to `roulette_number`. */
static double trace_with_roulette(struct path_context *c, uint64_t index, double place)
{
	static struct path_sample out;
	struct fixed_roulette_sampler p = make_fixed_roulette_sampler(index, place);
	path_trace_bidirectional(c, &p.base, &out);
	const struct splat *s = out.splats;
	return out.splat_count > 0 ? s->xyz[0] + s->xyz[1] + s->xyz[2] : 0;
}

static struct world *make_room(void)
{
	return world_from_text(
		16, 16,
		"<integrator type='path'><integer name='max_depth' value='12'/></integrator>" SENSOR(
			"0,0.2,1.9",
			"0,-0.3,-1") "<shape type='cube'><transform name='to_world'><scale value='2'/></transform><bsdf type='diffuse'>"
				     "<rgb name='reflectance' value='0.8,0.7,0.6'/></bsdf></shape>"
				     "<shape type='sphere'><point name='center' value='0.4,-1,-0.5'/><bsdf type='roughconductor'>"
				     "<float name='alpha' value='0.3'/></bsdf></shape>"
				     "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"
				     "<translate y='1.9'/></transform>"
				     "<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>");
}

static struct path_context context_of(const struct world *w, uint64_t *counters)
{
	return (struct path_context){.w = w,
				     .window = {0, 0, 16, 16},
				     .min_depth = 1,
				     .max_depth = 12,
				     .skips_classes = true,
				     .counters = counters};
}

static void mean_over_roulette_is_that_of_all_connections(void **state)
{
	(void)state;
	static uint64_t counters[BATCH_COUNTERS];
	struct world *w = make_room();
	struct path_context c = context_of(w, counters);
	c.max_survival = PATH_SURVIVAL_MAX;
	double all = 0, mean = 0;
	uint64_t rays_all = 0, rays = 0, differ = 0;
	for (uint64_t i = 0; i < SAMPLES; i++) {
		counters[COUNT_RAYS_SHADOW] = 0;
		double expected = trace_all_connections(&c, i), sum = 0;
		rays_all += counters[COUNT_RAYS_SHADOW] * ROULETTE_NUMBERS;
		counters[COUNT_RAYS_SHADOW] = 0;
		for (int k = 0; k < ROULETTE_NUMBERS; k++)
			sum += trace_with_roulette(&c, i, (k + 0.5) / ROULETTE_NUMBERS);
		rays += counters[COUNT_RAYS_SHADOW];
		/* Each connection's probability is off by at most one of ROULETTE_NUMBERS values; one connection counts
		 * at most 12 tenths of the sum, and there are some tens of connections. */
		if (fabs(sum / ROULETTE_NUMBERS - expected) > 0.02 * expected) {
			print_message("sample %d: %g, by every connection %g\n", (int)i, sum / ROULETTE_NUMBERS,
				      expected);
			differ++;
		}
		all += expected;
		mean += sum / ROULETTE_NUMBERS;
	}
	print_message("%d samples: mean off by %.1e, %.2f of the shadow rays\n", SAMPLES, mean / all - 1,
		      (double)rays / (double)rays_all);
	assert_int_equal(differ, 0);
	assert_true(fabs(mean / all - 1) < 5e-4);
	assert_true((double)rays < 0.6 * (double)rays_all);
	world_free(w);
}

/* Chains and the bootstrap need samples that are functions of their random numbers: without roulette, all connections
 * are made. */
static void chains_make_all_connections(void **state)
{
	(void)state;
	static uint64_t counters[BATCH_COUNTERS];
	struct world *w = make_room();
	struct path_context c = context_of(w, counters);
	for (uint64_t i = 0; i < SAMPLES; i++) {
		double expected = trace_all_connections(&c, i);
		assert_true(fabs(trace_with_roulette(&c, i, 0.5) - expected) <= 1e-12 * expected);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(mean_over_roulette_is_that_of_all_connections),
		cmocka_unit_test(chains_make_all_connections),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
