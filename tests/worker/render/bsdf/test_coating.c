/* SPDX-License-Identifier: Apache-2.0 */
/* plastic, roughplastic and thindielectric against what their formulas stand for. */
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/microfacet.h"

#include <math.h>

#define PI 3.14159265358979323846

static const struct wavelengths wavelengths = {.nm = {400, 500, 600, 700}};
static const struct bsdf_point point = {.u = 0.3, .v = 0.7, .w = &wavelengths, .transport = TRANSPORT_RADIANCE};

static vec3 direction(double z)
{
	return (vec3){sqrt((1 - z) * (1 + z)), 0, z};
}

/* All that comes back of light from wo: the specular lobe, and by the midpoint rule the others (cosine^2 times
 * azimuth). */
static double albedo(const struct bsdf *b, vec3 wo)
{
	enum { POLAR = 400, AZIMUTH = 200 };
	vec3 wi;
	double chance, sum = 0;
	for (int i = 0; i < POLAR * AZIMUTH; i++) {
		double c = sqrt((i / AZIMUTH + 0.5) / POLAR), s = sqrt((1 - c) * (1 + c)),
		       phi = 2 * PI * (i % AZIMUTH + 0.5) / AZIMUTH;
		sum += b->ops->eval(b, &point, wo, (vec3){s * cos(phi), s * sin(phi), c}).v[0];
	}
	return sum * PI / (POLAR * AZIMUTH) + bsdf_eval_delta(b, &point, wo, BSDF_REFLECT, &wi, &chance).v[0];
}

/* Over a base that absorbs nothing a smooth coating gives back everything. */
static void test_nothing_is_lost_under_a_smooth_coating(void **state)
{
	(void)state;
	static const char *const cases[] = {"plastic diffuse_reflectance=1",
					    "plastic diffuse_reflectance=1 nonlinear=true int_ior=2.4",
					    "plastic diffuse_reflectance=1 int_ior=1.2 ext_ior=1"};
	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make(&a, cases[k], &b);
		for (double z = 0.1; z < 1; z += 0.2)
			if (fabs(albedo(&b, direction(z)) - 1) > 1e-3)
				fail_msg("%s: gives back %g of light from z = %g", cases[k], albedo(&b, direction(z)),
					 z);
		arena_fini(&a);
	}
}

/* Light that stays inside meets a base of reflectance 0.5 again and again: linear, as if that base gave all of it back
 * from the second time on; nonlinear, each time half of it. */
static void test_nonlinear_loses_light_at_each_bounce(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf linear, nonlinear;
	bsdf_make(&a, "plastic diffuse_reflectance=0.5 int_ior=1.7 ext_ior=1", &linear);
	bsdf_make(&a, "plastic diffuse_reflectance=0.5 int_ior=1.7 ext_ior=1 nonlinear=true", &nonlinear);
	vec3 straight = {0, 0, 1};
	double t = fresnel_dielectric(1, 1.7).transmitted,
	       once = linear.ops->eval(&linear, &point, straight, straight).v[0];
	double out = 0.5 * t * t / PI / once / (1.7 * 1.7); /* the part of diffuse light that leaves at a time */
	double series = 0.5 * out / (1 - 0.5 * (1 - out));  /* 0.5 out + 0.5 (1 - out) 0.5 out + ... */
	double want = once * series / 0.5;
	assert_true(out > 0.2 && out < 0.5);
	assert_true(fabs(nonlinear.ops->eval(&nonlinear, &point, straight, straight).v[0] / want - 1) < 1e-6);
	arena_fini(&a);
}

/* What comes out again of the light that is in, from Fresnel's factors inside: total reflection included. */
static void test_escape_is_what_fresnel_says_inside(void **state)
{
	(void)state;
	enum { STEPS = 1 << 20 };
	struct arena a = {0};
	struct bsdf b;
	bsdf_make(&a, "plastic diffuse_reflectance=1 int_ior=1.7 ext_ior=1", &b);
	double out = 0, t = fresnel_dielectric(1, 1.7).transmitted;
	for (int i = 0; i < STEPS; i++)
		out += fresnel_dielectric(sqrt((i + 0.5) / STEPS), 1 / 1.7).transmitted / STEPS;
	vec3 straight = {0, 0, 1};
	double f = b.ops->eval(&b, &point, straight, straight).v[0];
	assert_true(fabs(f * PI * 1.7 * 1.7 * out / (t * t) - 1) < 1e-5);
	arena_fini(&a);
}

/* A rough coating gives back what it lets in, too; and it becomes the smooth one. */
static void test_rough_and_smooth_coatings_meet(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf rough, smooth;
	bsdf_make(&a, "roughplastic alpha=0.1 diffuse_reflectance=1", &rough);
	for (double z = 0.3; z < 1; z += 0.2) {
		double all = albedo(&rough, direction(z));
		if (all > 1.005 || all < 0.97)
			fail_msg("roughplastic gives back %g of light from z = %g", all, z);
	}
	bsdf_make(&a, "roughplastic alpha=0.001 diffuse_reflectance=rgb(0.6,0.3,0.9) nonlinear=true", &rough);
	bsdf_make(&a, "plastic diffuse_reflectance=rgb(0.6,0.3,0.9) nonlinear=true", &smooth);
	vec3 wo = direction(0.8), wi = {-0.3, 0.5, sqrt(1 - 0.09 - 0.25)}; /* far from the mirror's direction */
	for (int l = 0; l < SPECTRUM_LANES; l++) {
		double r = rough.ops->eval(&rough, &point, wo, wi).v[l],
		       s = smooth.ops->eval(&smooth, &point, wo, wi).v[l];
		assert_true(fabs(r / s - 1) < 2e-3);
	}
	arena_fini(&a);
}

/* The specular lobe is that of roughdielectric, seen from outside. */
static void test_the_coating_is_a_dielectric(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf plastic, glass;
	bsdf_make(&a, "roughplastic alpha=0.3 diffuse_reflectance=0 int_ior=1.7 ext_ior=1.1 distribution=ggx",
		  &plastic);
	bsdf_make(&a, "roughdielectric alpha=0.3 int_ior=1.7 ext_ior=1.1 distribution=ggx", &glass);
	for (double z = 0.05; z < 1; z += 0.1) {
		vec3 wo = direction(z), wi = {-0.2, 0.4, sqrt(0.8)};
		double p = plastic.ops->eval(&plastic, &point, wo, wi).v[1],
		       g = glass.ops->eval(&glass, &point, wo, wi).v[1];
		assert_true(fabs(p / g - 1) < 1e-12);
	}
	arena_fini(&a);
}

/* Reflected and transmitted again and again between the two sides of a sheet, term by term. */
static void test_a_sheet_is_a_series(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	bsdf_make(&a, "thindielectric int_ior=1.8 ext_ior=1", &b);
	for (double z = 0.02; z < 1; z += 0.07) {
		struct fresnel f = fresnel_dielectric(z, 1.8);
		double back = f.reflected, through = 0, inside = f.transmitted;
		for (int i = 0; i < 2000; i++) {
			*(i % 2 ? &back : &through) += inside * f.transmitted;
			inside *= f.reflected;
		}
		vec3 wi, wo = vec3_neg(direction(z));
		double chance;
		assert_true(fabs(bsdf_eval_delta(&b, &point, wo, BSDF_REFLECT, &wi, &chance).v[0] - back) < 1e-12);
		assert_true(fabs(bsdf_eval_delta(&b, &point, wo, BSDF_TRANSMIT, &wi, &chance).v[0] - through) < 1e-12);
		assert_true(wi.x == -wo.x && wi.y == -wo.y && wi.z == -wo.z);
	}
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_nothing_is_lost_under_a_smooth_coating),
		cmocka_unit_test(test_nonlinear_loses_light_at_each_bounce),
		cmocka_unit_test(test_escape_is_what_fresnel_says_inside),
		cmocka_unit_test(test_rough_and_smooth_coatings_meet),
		cmocka_unit_test(test_the_coating_is_a_dielectric),
		cmocka_unit_test(test_a_sheet_is_a_series),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
