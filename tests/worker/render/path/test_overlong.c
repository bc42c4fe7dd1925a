/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The energy of paths that are too long to simulate, in a closed sphere whose wall emits light and reflects the share
 * r: paths of e edges contribute r^(e - 1) times the emission. Each estimate is compared with this geometric series,
 * at 4 standard errors (level 6e-5); an error of 1 % is found where the series is large.
 */
#include "tests/support/worlds.h"
#include "worker/render/path/integrate_path.h"
#include "worker/render/path/overlong.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

enum { SAMPLES = 1 << 13, SIZE = 32 };

static struct path_context context_of(struct world *w, uint64_t *counters, uint32_t max_depth)
{
	return (struct path_context){.w = w,
				     .window = {0, 0, SIZE, SIZE},
				     .min_depth = 1,
				     .max_depth = max_depth,
				     .skips_classes = true,
				     .counters = counters};
}

static struct world *make_room(const char *bsdf)
{
	return world_from_text(
		SIZE, SIZE,
		SENSOR("0,0,0", "0,0,1") "<shape type='sphere'><boolean name='flip_normals' value='true'/>%s"
					 "<emitter type='area'><spectrum name='radiance' value='1'/>"
					 "</emitter></shape>",
		bsdf);
}

/* Returns the estimated mean of all paths of more than `after` and up to `longest` edges; *error: its standard error.
 */
static double mean_of_longer_paths(struct world *w, uint32_t after, uint32_t longest, double *error)
{
	static struct path_context c;
	static struct path_sample sample;
	uint64_t counters[BATCH_COUNTERS] = {0};
	double sum = 0, square = 0;
	c = context_of(w, counters, after);
	for (uint64_t i = 0; i < SAMPLES; i++) {
		double x = overlong_paths_sample_energy(&c, 3, i, longest, &sample);
		assert_true(c.max_depth == after && c.max_survival == 0);
		sum += x / SAMPLES;
		square += x * x / SAMPLES;
	}
	*error = sqrt((square - sum * sum) / SAMPLES);
	return sum;
}

/* Returns the mean of an image that sees radiance 1 everywhere. */
static double mean_of_unit_light(void)
{
	static struct path_context c;
	static struct path_sample sample;
	uint64_t counters[BATCH_COUNTERS] = {0};
	double sum = 0;
	struct world *w = make_room("<bsdf type='diffuse'/>");
	c = context_of(w, counters, 1);
	for (uint64_t i = 0; i < SAMPLES; i++) {
		struct sampler_random s;
		sampler_random_init(&s, 3, RNG_TEST, i, 0);
		path_trace(&c, &s.base, &sample);
		sum += sample.intensity / SAMPLES;
	}
	world_free(w);
	return sum;
}

static void assert_mean_of_longer_paths(struct world *w, uint32_t after, uint32_t longest, double wanted,
					double most_error)
{
	double error, unit = mean_of_unit_light(), mean = mean_of_longer_paths(w, after, longest, &error) / unit;
	error /= unit;
	printf("%u to %u edges: %.5g +- %.2g, wanted %.5g\n", after + 1, longest, mean, error, wanted);
	if (!(fabs(mean - wanted) <= 4 * error) || error > most_error * wanted)
		fail_msg("off by %.2f standard errors", (mean - wanted) / error);
}

/* r^after + ... + r^(longest - 1) */
static double geometric_series(double r, uint32_t after, uint32_t longest)
{
	return (pow(r, after) - (longest == OVERLONG_EDGES_MAX ? 0 : pow(r, longest))) / (1 - r);
}

static void longer_paths_in_a_diffuse_sphere_sum_to_a_series(void **state)
{
	(void)state;
	struct world *w = make_room("<bsdf type='diffuse'><spectrum name='reflectance' value='0.99'/></bsdf>");
	assert_mean_of_longer_paths(w, 32, 64, geometric_series(0.99, 32, 64), 0.02);
	assert_mean_of_longer_paths(w, 126, 131, geometric_series(0.99, 126, 131),
				    0.03); /* across the border of two segments */
	assert_mean_of_longer_paths(w, 128, OVERLONG_EDGES_MAX, geometric_series(0.99, 128, OVERLONG_EDGES_MAX), 0.05);
	world_free(w);
	w = make_room("<bsdf type='diffuse'><spectrum name='reflectance' value='0.5'/></bsdf>");
	assert_mean_of_longer_paths(w, 4, OVERLONG_EDGES_MAX, geometric_series(0.5, 4, OVERLONG_EDGES_MAX), 0.05);
	world_free(w);
}

/* Like the shining sphere, but the wall scatters in one direction only. */
static void longer_paths_in_a_mirror_sphere_sum_to_a_series(void **state)
{
	(void)state;
	struct world *w = make_room("<bsdf type='conductor'><string name='material' value='none'/>"
				    "<spectrum name='specular_reflectance' value='0.99'/></bsdf>");
	assert_mean_of_longer_paths(w, 126, 131, geometric_series(0.99, 126, 131), 0.03);
	world_free(w);
}

/* Light travels diagonally between two plates, with hits one unit apart, to a lamp behind 300 hits. */
static struct world *make_corridor(const char *bsdf)
{
	return world_from_text(
		SIZE, SIZE,
		"<sensor type='perspective'><float name='fov' value='0.001'/><transform name='to_world'>"
		"<lookat origin='0,0.5,0' target='1,1.5,0' up='0,0,1'/></transform><film type='hdrfilm'>"
		"<rfilter type='box'/></film></sensor>"
		"<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><scale value='400'/>"
		"</transform>%s</shape>"
		"<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/><scale value='400'/>"
		"<translate y='1'/></transform>%s</shape>"
		"<shape type='rectangle'><transform name='to_world'><rotate y='1' angle='-90'/><translate x='300'/>"
		"</transform><emitter type='area'><spectrum name='radiance' value='1'/></emitter></shape>",
		bsdf, bsdf);
}

/* Mirrors: a segment of the continuation starts where the previous one ended, with its throughput. */
static void continuation_keeps_the_throughput_of_mirrors(void **state)
{
	(void)state;
	struct world *w =
		make_corridor("<bsdf type='twosided'><bsdf type='conductor'><string name='material' value='none'/>"
			      "<spectrum name='specular_reflectance' value='0.995'/></bsdf></bsdf>");
	assert_mean_of_longer_paths(w, 128, 300, 0, 0);
	assert_mean_of_longer_paths(w, 128, 301, pow(0.995, 300), 0.05);
	world_free(w);
}

/* Slabs of dispersive glass that reflect all of the light. One wavelength travels on, and its factor of four is
 * applied only once, whatever the number of segments. */
static void dispersion_factor_is_applied_once_over_all_segments(void **state)
{
	(void)state;
	struct world *w = make_corridor("<bsdf type='dielectric'><float name='int_ior' value='1.5'/>"
					"<float name='int_cauchy_b' value='0.01'/></bsdf>");
	assert_true(w->effects.dispersion);
	assert_mean_of_longer_paths(w, 128, 301, 1, 0.05);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(longer_paths_in_a_diffuse_sphere_sum_to_a_series),
		cmocka_unit_test(longer_paths_in_a_mirror_sphere_sum_to_a_series),
		cmocka_unit_test(continuation_keeps_the_throughput_of_mirrors),
		cmocka_unit_test(dispersion_factor_is_applied_once_over_all_segments),
	};
	return cmocka_run_group_tests_name("worker/render/path/longer", tests, NULL, NULL);
}
