/* SPDX-License-Identifier: Apache-2.0 */
/*
 * roughplastic is compared with a simulation: light is followed through a rough boundary (roughdielectric) to a diffuse
 * base and back, one reflection at a time. The model counts light that facets hide from each other as transmitted. With
 * facets of roughness 0.05 this is below 1.5 %, except for cosines below 1/8, which are left out.
 *
 * Level: five standard errors per bin, 21 bins: below 1e-4. Power: the test itself shows that a base that is 5 %
 * brighter, 10 % of the light, is found.
 */
#include "tests/support/dice.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

#include <math.h>

#define PI 3.14159265358979323846
#define MASKING_TOLERANCE 0.015

enum { BINS = 8, PATHS = 200000 };

static const struct wavelengths wavelengths = {.nm = {400, 500, 600, 700}};
static const struct bsdf_point point = {.wavelengths = &wavelengths, .transport = TRANSPORT_IMPORTANCE};

struct bins {
	double sum[BINS], sum_of_squares[BINS];
};

static vec3 cosine_upwards(struct dice *d)
{
	double r = sqrt(dice_uniform(d)), phi = 2 * PI * dice_uniform(d);
	return (vec3){r * cos(phi), r * sin(phi), sqrt(fmax(0, 1 - r * r))};
}

/* Scatters v at the boundary, from either side. Returns false if other facets hide it. */
static bool scatter_at_boundary(const struct bsdf *boundary, struct dice *d, vec3 v, vec3 *next, double *weight)
{
	struct bsdf_sample s;
	const double u[3] = {dice_uniform(d), dice_uniform(d), dice_uniform(d)};
	if (!boundary->ops->sample(boundary, &point, v, u, &s))
		return false;
	*weight *= s.f.v[0] * fabs(s.wi.z) / s.pdf;
	*next = s.wi;
	return *weight > 0;
}

static void trace_photon(const struct bsdf *boundary, double base, vec3 wo, struct dice *d, struct bins *b)
{
	double weight = 1;
	vec3 v = wo;
	while (scatter_at_boundary(boundary, d, v, &v, &weight)) {
		if (v.z > 0) { /* the light leaves */
			int i = (int)fmin(v.z * BINS, BINS - 1);
			b->sum[i] += weight;
			b->sum_of_squares[i] += weight * weight;
			return;
		}
		weight *= base;
		v = vec3_neg(cosine_upwards(d)); /* the direction from the boundary back to the base */
	}
}

/* Integrates f over a bin of cosines by the midpoint rule. */
static double integral_over_bin(const struct bsdf *plastic, vec3 wo, int bin)
{
	enum { POLAR = 300, AZIMUTH = 600 };
	double sum = 0;
	for (int i = 0; i < POLAR * AZIMUTH; i++) {
		double z = (bin + (i / AZIMUTH + 0.5) / POLAR) / BINS, s = sqrt(1 - z * z),
		       phi = 2 * PI * (i % AZIMUTH + 0.5) / AZIMUTH;
		vec3 wi = {s * cos(phi), s * sin(phi), z};
		sum += plastic->ops->eval(plastic, &point, wo, wi).v[0] * z;
	}
	return sum * 2 * PI / (BINS * POLAR * AZIMUTH);
}

/* Returns the largest difference, beyond the allowed one, in standard errors. */
static double max_excess_deviation(const struct bsdf *plastic, const struct bins *b, vec3 wo, double *off)
{
	double worst = 0;
	for (int i = 1; i < BINS; i++) {
		double mean = b->sum[i] / PATHS, error = sqrt((b->sum_of_squares[i] / PATHS - mean * mean) / PATHS);
		double model = integral_over_bin(plastic, wo, i),
		       beyond = fabs(model - mean) - MASKING_TOLERANCE * model;
		*off = fmax(*off, fabs(model / mean - 1));
		worst = fmax(worst, beyond / error);
	}
	return worst;
}

#define COAT "roughplastic int_ior=1.6 ext_ior=1 alpha=0.05 nonlinear=true "

static void test_roughplastic_is_its_layers(void **state)
{
	(void)state;
	struct arena a = {0};
	struct dice d = dice_for_test("light in layers");
	struct bsdf boundary, plastic, brighter;
	bsdf_make_or_fail(&a, "roughdielectric int_ior=1.6 ext_ior=1 alpha=0.05", &boundary);
	bsdf_make_or_fail(&a, COAT "diffuse_reflectance=0.7", &plastic);
	bsdf_make_or_fail(&a, COAT "diffuse_reflectance=0.735", &brighter);
	for (int k = 0; k < 3; k++) {
		double z = (double[]){0.95, 0.6, 0.3}[k], off = 0, ignored = 0;
		vec3 wo = {sqrt(1 - z * z), 0, z};
		struct bins b = {{0}, {0}};
		for (int i = 0; i < PATHS; i++)
			trace_photon(&boundary, 0.7, wo, &d, &b);
		double worst = max_excess_deviation(&plastic, &b, wo, &off);
		print_message("from z = %g: largest difference %.2f %%, %.1f standard errors beyond %g %%\n", z,
			      100 * off, worst, 100 * MASKING_TOLERANCE);
		assert_true(worst < 5);
		assert_true(max_excess_deviation(&brighter, &b, wo, &ignored) > 5);
	}
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_roughplastic_is_its_layers)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
