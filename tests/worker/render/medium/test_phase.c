/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Every phase function of the list, over its range of parameters. By quadrature, the integral over the sphere is 1, and
 * that of the cosine is g (0 for Rayleigh's; for a table by Simpson's rule, which is exact for it; for several
 * functions their mean). The cosine sampled for a number is that at which the cumulative distribution, again by
 * quadrature, has this value; directions lie at this angle to the incident direction, all around it, and have the
 * density that is returned.
 *
 * For mixtures of functions and equidistant numbers, the share of cosines below each of some bounds is the cumulative
 * distribution there, up to one number per part.
 */
#include "worker/render/medium/phase.h"
#include "worker/render/math/frame.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const double g_values[] = {-0.999, -0.9, -0.3, -1e-9, 0, 1e-9, 0.5, 0.8, 0.999};
enum { GS = sizeof g_values / sizeof *g_values };

static const vec3 any_point = {0, 0, 0};

typedef double integrand(const struct phase *p, double cosine);

static double density(const struct phase *p, double cosine)
{
	return 2 * M_PI * p->ops->eval(p, any_point, cosine);
}

static double density_times_cosine(const struct phase *p, double cosine)
{
	return cosine * density(p, cosine);
}

/* Integrates from -1 to `end`, with finer steps near the poles, where narrow functions have their peak: c = sin t. */
static double integral(const struct phase *p, integrand *f, double end)
{
	enum { STEPS = 1 << 17 };
	double from = -M_PI / 2, to = asin(end), h = (to - from) / STEPS, sum = 0;
	for (int i = 0; i < STEPS; i++) { /* Gauss's rule with two points */
		double middle = from + (i + 0.5) * h, off = h / (2 * sqrt(3));
		sum += f(p, sin(middle - off)) * cos(middle - off) + f(p, sin(middle + off)) * cos(middle + off);
	}
	return sum * h / 2;
}

static void check_directions(const struct phase *p)
{
	enum { NUMBERS = 64 };
	vec3 wo = vec3_normalize((vec3){0.3, -0.5, 0.7});
	struct frame straight = frame_around(vec3_neg(wo));
	for (int i = 0; i < NUMBERS; i++) {
		vec3 sum = {0, 0, 0};
		double u = (i + 0.5) / NUMBERS, cosine = p->ops->sample(p, any_point, u), pdf;
		for (int k = 0; k < NUMBERS; k++) {
			const double numbers[] = {u, (k + 0.5) / NUMBERS};
			vec3 wi = phase_sample(p, any_point, wo, numbers, &pdf), local = frame_to_local(&straight, wi);
			assert_true(fabs(vec3_length(wi) - 1) < 1e-12);
			assert_true(fabs(local.z - cosine) < 1e-12);
			sum = vec3_madd(sum, 1, local);
			/* the cosine is rounded near 1 */
			assert_true(fabs(phase_eval(p, any_point, wo, wi) / pdf - 1) < 1e-8);
			assert_true(phase_eval(p, any_point, wi, wo) == phase_eval(p, any_point, wo, wi));
		}
		assert_true(fabs(sum.x) + fabs(sum.y) < 1e-9);
	}
}

static void check_share(const struct phase *p, double bound, unsigned parts)
{
	enum { NUMBERS = 1 << 12 };
	unsigned below = 0;
	for (int i = 0; i < NUMBERS; i++)
		below += p->ops->sample(p, any_point, (i + 0.5) / NUMBERS) < bound;
	assert_true(fabs(integral(p, density, bound) - (double)below / NUMBERS) < 1e-6 + (double)parts / NUMBERS);
}

/* parts: number of parts between which u chooses first; 0: none. */
static void check_phase(const struct phase *p, double mean, unsigned parts)
{
	enum { NUMBERS = 20 };
	assert_true(fabs(integral(p, density, 1) - 1) < 1e-6);
	assert_true(fabs(integral(p, density_times_cosine, 1) - mean) < 1e-6);
	for (int i = 0; i < NUMBERS; i++) {
		double u = (i + 0.5) / NUMBERS, cosine = p->ops->sample(p, any_point, u);
		assert_true(cosine >= -1 && cosine <= 1);
		if (parts)
			check_share(p, 2 * u - 1, parts);
		else
			assert_true(fabs(integral(p, density, cosine) - u) < 1e-6);
	}
	for (int end = -1; end <= 1; end += 2)
		assert_true(isfinite(p->ops->eval(p, any_point, end)) && p->ops->eval(p, any_point, end) >= 0);
	/* on the side without the peak, terms of size 1 cancel to (1 - g)^2 */
	assert_true(fabs(p->ops->sample(p, any_point, 0)) <= 1 + 1e-9 &&
		    fabs(p->ops->sample(p, any_point, 1 - 0x1p-53)) <= 1 + 1e-9);
	check_directions(p);
}

/* ---- the list ---- */

static void make_phase(struct phase *p, const struct scene_node *n)
{
	static struct arena arena;
	const struct volume_build build = {.arena = &arena, .is_dialect_3 = true, .world_scale = 1};
	struct error e;
	if (phase_create(p, n, &build, &e))
		fail_msg("%s", e.text);
}

/* A node with one property, and with nested functions. */
#define NODE(name_of_type, ...)                                        \
	(struct scene_node)                                            \
	{                                                              \
		.cls = PLUGIN_PHASE, .type = name_of_type, __VA_ARGS__ \
	}
#define WITH(...)                                                    \
	.property_count = 1, .properties = (const struct property[]) \
	{                                                            \
		__VA_ARGS__                                          \
	}
#define NUMBER(name, x) WITH({name, 1, {.type = VALUE_FLOAT, .as.number = x}})
#define TEXT(name, x) WITH({name, 1, {.type = VALUE_STRING, .as.string = x}})
#define INSIDE(count, ...)                                                   \
	.child_count = count, .children = (const struct scene_node *const[]) \
	{                                                                    \
		__VA_ARGS__                                                  \
	}

static void test_simple_functions_are_normalized(void **state)
{
	(void)state;
	struct phase p;
	make_phase(&p, &NODE("isotropic"));
	check_phase(&p, 0, 0);
	make_phase(&p, &NODE("rayleigh"));
	check_phase(&p, 0, 0);
	for (int k = 0; k < GS; k++) {
		make_phase(&p, &NODE("hg", NUMBER("g", g_values[k])));
		check_phase(&p, g_values[k], 0);
	}
}

/* Returns the mean cosine of a table with equidistant values. */
static double mean_cosine_of_table(const double *value, int count)
{
	double h = 2.0 / (count - 1), sum = 0, moment = 0;
	for (int i = 0; i + 1 < count; i++) {
		double from = -1 + i * h, middle = from + h / 2, between = (value[i] + value[i + 1]) / 2;
		sum += between;
		moment += (from * value[i] + 4 * middle * between + (from + h) * value[i + 1]) / 6;
	}
	return moment / sum;
}

static void test_tables_are_interpolated(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double value[5];
		int count;
	} tables[] = {{"1,1", {1, 1}, 2},
		      {"0 1", {0, 1}, 2},
		      {"3, 0", {3, 0}, 2},
		      {"2,5,.25,1e-9,7", {2, 5, 0.25, 1e-9, 7}, 5},
		      {"0,0,1e-20,3e-20,0", {0, 0, 1, 3, 0}, 5},
		      {"1e30,0,0,0,1e30", {1, 0, 0, 0, 1}, 5}};
	struct phase p;
	for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
		make_phase(&p, &NODE("tabphase", TEXT("values", tables[i].text)));
		check_phase(&p, mean_cosine_of_table(tables[i].value, tables[i].count), 0);
	}
	/* The order of values: the last one is for the cosine 1, forward scattering. */
	make_phase(&p, &NODE("tabphase", TEXT("values", "1,2,5")));
	assert_true(fabs(phase_eval(&p, any_point, (vec3){0, 0, -1}, (vec3){0, 0, 1}) * 2 * M_PI - 1) < 1e-15);
	assert_true(fabs(phase_eval(&p, any_point, (vec3){0, 0, 1}, (vec3){0, 0, 1}) * 2 * M_PI - 0.2) < 1e-15);
	assert_true(fabs(p.ops->eval(&p, any_point, -0.5) * 2 * M_PI - 0.3) < 1e-15);
}

/* The Henyey-Greenstein function as a fine table. */
static void test_fine_table_matches_henyey_greenstein(void **state)
{
	(void)state;
	enum { VALUES = 4097 };
	static char text[VALUES * 26];
	size_t length = 0;
	struct phase hg, table;
	make_phase(&hg, &NODE("hg", NUMBER("g", 0.6)));
	for (int i = 0; i < VALUES; i++)
		length += (size_t)snprintf(text + length, sizeof text - length, "%.17g ",
					   hg.ops->eval(&hg, any_point, -1 + i * (2.0 / (VALUES - 1))));
	make_phase(&table, &NODE("tabphase", TEXT("values", text)));
	for (int i = 0; i < 1000; i++) {
		double u = (i + 0.5) / 1000, cosine = 2 * u - 1;
		double wanted = hg.ops->eval(&hg, any_point, cosine), drawn = hg.ops->sample(&hg, any_point, u);
		/* The error is an eighth of the squared width times the second derivative over the value, which is at
		 * most 211. */
		assert_true(fabs(table.ops->eval(&table, any_point, cosine) / wanted - 1) < 8e-6);
		assert_true(fabs(table.ops->sample(&table, any_point, u) - drawn) < 2e-6);
	}
}

static void test_mixtures_are_sums_of_their_parts(void **state)
{
	(void)state;
	struct phase p;
	const struct scene_node forwards = NODE("hg", NUMBER("g", 0.8)), backwards = NODE("hg", NUMBER("g", -0.5)),
				table = NODE("tabphase", TEXT("values", "0,1,0")), even = NODE("isotropic");
	for (int k = 0; k <= 4; k++) {
		make_phase(&p, &NODE("blendphase", NUMBER("weight", k / 4.0), INSIDE(2, &forwards, &backwards)));
		check_phase(&p, 0.8 * (1 - k / 4.0) - 0.5 * k / 4.0, 2);
		assert_true(p.absorbed_share == 0);
	}
	const struct scene_node blend = NODE("blendphase", INSIDE(2, &forwards, &table));
	make_phase(&p, &blend);
	check_phase(&p, 0.4, 2);
	static const struct {
		const char *weights;
		double mean, absorbed;
	} mixtures[] = {{".1,.2,.7", 0.7 * 0.4 - 0.1 * 0.5, 0},
			{"0,.1,.4", 0.8 * 0.4, 0.5},
			{".25,.25 0", -0.25, 0.5},
			{"1,1,2", 0.5 * 0.4 - 0.25 * 0.5, 0}};
	for (size_t i = 0; i < sizeof mixtures / sizeof *mixtures; i++) {
		make_phase(&p, &NODE("mixturephase", TEXT("weights", mixtures[i].weights),
				     INSIDE(3, &backwards, &even, &blend)));
		check_phase(&p, mixtures[i].mean, 4);
		assert_true(fabs(p.absorbed_share - mixtures[i].absorbed) < 1e-15);
	}
}

/* The defaults of a node without properties, and without a node. */
static void test_missing_properties_have_defaults(void **state)
{
	(void)state;
	struct phase p;
	make_phase(&p, NULL);
	assert_string_equal(p.ops->decl.type, "isotropic");
	make_phase(&p, &NODE("hg"));
	assert_string_equal(p.ops->decl.type, "hg");
	assert_true(p.g == 0.8);
	make_phase(&p, &NODE("rayleigh"));
	assert_true(fabs(p.ops->eval(&p, any_point, 1) / p.ops->eval(&p, any_point, 0) - 2) < 1e-15);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_simple_functions_are_normalized),
		cmocka_unit_test(test_tables_are_interpolated),
		cmocka_unit_test(test_fine_table_matches_henyey_greenstein),
		cmocka_unit_test(test_mixtures_are_sums_of_their_parts),
		cmocka_unit_test(test_missing_properties_have_defaults),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
