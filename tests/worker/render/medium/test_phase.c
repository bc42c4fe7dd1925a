/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Every phase function of the list, over its range of parameters: the integral over the sphere is 1 and that of the
 * cosine g (0 for Rayleigh's), by quadrature; the cosine drawn for a number is where the distribution function, again
 * by quadrature, has that number; directions lie at that angle to the one that light came in, all around it, and have
 * the density that they claim.
 */
#include "worker/render/medium/phase.h"
#include "worker/render/math/frame.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const double gs[] = {-0.999, -0.9, -0.3, -1e-9, 0, 1e-9, 0.5, 0.8, 0.999};
enum { GS = sizeof gs / sizeof *gs };

typedef double integrand(const struct phase *p, double cosine);

static double density(const struct phase *p, double cosine)
{
	return 2 * M_PI * p->ops->eval(p, cosine);
}

static double density_times_cosine(const struct phase *p, double cosine)
{
	return cosine * density(p, cosine);
}

/* From -1 to `end`, with finer steps near the poles, where narrow functions have their peak: c = sin t. */
static double integral(const struct phase *p, integrand *f, double end)
{
	enum { STEPS = 1 << 17 };
	double from = -M_PI / 2, to = asin(end), h = (to - from) / STEPS, sum = 0;
	for (int i = 0; i < STEPS; i++) { /* Gauss's rule of two points */
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
		double u = (i + 0.5) / NUMBERS, cosine = p->ops->sample(p, u), pdf;
		for (int k = 0; k < NUMBERS; k++) {
			const double numbers[] = {u, (k + 0.5) / NUMBERS};
			vec3 wi = phase_sample(p, wo, numbers, &pdf), local = frame_to_local(&straight, wi);
			assert_true(fabs(vec3_length(wi) - 1) < 1e-12);
			assert_true(fabs(local.z - cosine) < 1e-12);
			sum = vec3_madd(sum, 1, local);
			/* of a cosine that is rounded, near 1 */
			assert_true(fabs(phase_eval(p, wo, wi) / pdf - 1) < 1e-8);
			assert_true(phase_eval(p, wi, wo) == phase_eval(p, wo, wi));
		}
		assert_true(fabs(sum.x) + fabs(sum.y) < 1e-9);
	}
}

static void check(const struct phase *p, double mean)
{
	enum { NUMBERS = 20 };
	assert_true(fabs(integral(p, density, 1) - 1) < 1e-6);
	assert_true(fabs(integral(p, density_times_cosine, 1) - mean) < 1e-6);
	for (int i = 0; i < NUMBERS; i++) {
		double u = (i + 0.5) / NUMBERS, cosine = p->ops->sample(p, u);
		assert_true(cosine >= -1 && cosine <= 1);
		assert_true(fabs(integral(p, density, cosine) - u) < 1e-6);
	}
	for (int end = -1; end <= 1; end += 2)
		assert_true(isfinite(p->ops->eval(p, end)) && p->ops->eval(p, end) > 0);
	/* terms of 1 cancel down to (1 - g)^2 on the side without the peak */
	assert_true(fabs(p->ops->sample(p, 0)) <= 1 + 1e-9 && fabs(p->ops->sample(p, 1 - 0x1p-53)) <= 1 + 1e-9);
	check_directions(p);
}

static void test_phases(void **state)
{
	(void)state;
	for (size_t i = 0; phase_registry[i]; i++)
		for (int k = 0; k < GS; k++) {
			bool takes_g = phase_registry[i]->decl.params->name != NULL;
			struct phase p = {phase_registry[i], takes_g ? gs[k] : 0};
			check(&p, p.g);
		}
}

/* Of a node that says nothing, and of none. */
static void test_defaults(void **state)
{
	(void)state;
	struct phase p;
	phase_create(&p, NULL);
	assert_string_equal(p.ops->decl.type, "isotropic");
	phase_create(&p, &(struct scene_node){.cls = PLUGIN_PHASE, .type = "hg"});
	assert_string_equal(p.ops->decl.type, "hg");
	assert_true(p.g == 0.8);
	phase_create(&p, &(struct scene_node){.cls = PLUGIN_PHASE, .type = "rayleigh"});
	assert_true(fabs(p.ops->eval(&p, 1) / p.ops->eval(&p, 0) - 2) < 1e-15);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_phases),
		cmocka_unit_test(test_defaults),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
