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

enum { SAMPLES = 150, PLACES = 512 };

/* A sample's random numbers, with a fixed value for the number that decides about faint connections. */
struct placed {
	struct sampler base;
	struct sampler_random random;
	double place, value[SAMPLER_BLOCK_SIZE];
};

static const double *placed_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct placed *p = (struct placed *)(void *)base;
	const double *u = p->random.base.block(&p->random.base, side, vertex);
	if (side != SIDE_CAMERA || vertex != 0)
		return u;
	memcpy(p->value, u, sizeof p->value);
	p->value[DIM_FAINT] = p->place;
	return p->value;
}

static struct placed placed_at(uint64_t index, double place)
{
	struct placed p = {.base = {placed_block}, .place = place};
	sampler_random_init(&p.random, 7, RNG_TEST, index, 0);
	return p;
}

/* Returns the contribution (X + Y + Z) of a pair of sub-paths to its own film point with every connection made, and
 * counts the shadow rays traced for it. */
static double by_every_connection(struct path_context *c, uint64_t index)
{
	double film[2], xyz[3];
	struct placed p = placed_at(index, 0);
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

/* Like by_every_connection(), but as bdpt computes it, with the roulette's number set to `place`. */
static double by_chance(struct path_context *c, uint64_t index, double place)
{
	static struct path_sample out;
	struct placed p = placed_at(index, place);
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

static void test_mean(void **state)
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
		double expected = by_every_connection(&c, i), sum = 0;
		rays_all += counters[COUNT_RAYS_SHADOW] * PLACES;
		counters[COUNT_RAYS_SHADOW] = 0;
		for (int k = 0; k < PLACES; k++)
			sum += by_chance(&c, i, (k + 0.5) / PLACES);
		rays += counters[COUNT_RAYS_SHADOW];
		/* Each connection's probability is off by at most one of PLACES values; one connection counts at most
		 * 12 tenths of the sum, and there are some tens of connections. */
		if (fabs(sum / PLACES - expected) > 0.02 * expected) {
			print_message("sample %d: %g, by every connection %g\n", (int)i, sum / PLACES, expected);
			differ++;
		}
		all += expected;
		mean += sum / PLACES;
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
static void test_without_roulette(void **state)
{
	(void)state;
	static uint64_t counters[BATCH_COUNTERS];
	struct world *w = make_room();
	struct path_context c = context_of(w, counters);
	for (uint64_t i = 0; i < SAMPLES; i++) {
		double expected = by_every_connection(&c, i);
		assert_true(fabs(by_chance(&c, i, 0.5) - expected) <= 1e-12 * expected);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_mean),
		cmocka_unit_test(test_without_roulette),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
