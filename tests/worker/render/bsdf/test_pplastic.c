/* SPDX-License-Identifier: Apache-2.0 */
/* pplastic, lobe by lobe, against the plug-ins that have the same lobes. */
#include "tests/worker/render/bsdf/bsdf_cases.h"

#include <math.h>

static const struct wavelengths wavelengths = {.nm = {430, 500, 570, 640}};
static const struct bsdf_point point = {
	.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = &wavelengths, .transport = TRANSPORT_RADIANCE};

static vec3 direction(double z, double phi)
{
	double s = sqrt((1 - z) * (1 + z));
	return (vec3){s * cos(phi), s * sin(phi), z};
}

static void expect_equal(const char *a, const char *b, double factor)
{
	struct arena arena = {0};
	struct bsdf x, y;
	bsdf_make_or_fail(&arena, a, &x);
	bsdf_make_or_fail(&arena, b, &y);
	int positive = 0;
	for (int i = 0; i < 400; i++) {
		vec3 wo = direction(0.03 + 0.96 * (i % 20) / 20, 0.4),
		     wi = direction(0.02 + 0.97 * (i / 20) / 20, 0.3 * i);
		spectrum p = x.ops->eval(&x, &point, wo, wi), q = y.ops->eval(&y, &point, wo, wi);
		for (int l = 0; l < SPECTRUM_LANES; l++)
			if (!(fabs(p.v[l] - factor * q.v[l]) <= 1e-9 * p.v[l]))
				fail_msg("%s is %g, %s %g, from z = %g to %g", a, p.v[l], b, q.v[l], wo.z, wi.z);
		positive += p.v[0] > 0;
	}
	assert_true(positive > 200);
	arena_fini(&arena);
}

static void specular_lobe_is_that_of_roughplastic(void **state)
{
	(void)state;
	expect_equal("pplastic alpha=0.3 int_ior=1.7 diffuse_reflectance=0 specular_reflectance=0.8",
		     "roughplastic alpha=0.3 int_ior=1.7 diffuse_reflectance=0 specular_reflectance=0.8", 1);
}

/* With a dark base, `plastic` has only the light that the base reflects once, over eta^2, because it takes total
 * internal reflection into account. */
static void diffuse_lobe_is_that_of_plastic(void **state)
{
	(void)state;
	expect_equal("pplastic int_ior=1.6 ext_ior=1 diffuse_reflectance=1e-12 specular_reflectance=0",
		     "plastic int_ior=1.6 ext_ior=1 diffuse_reflectance=1e-12 specular_reflectance=0 nonlinear=true",
		     1.6 * 1.6);
	expect_equal("pplastic diffuse_reflectance=0.6 specular_reflectance=0",
		     "pplastic diffuse_reflectance=0.3 specular_reflectance=0", 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(specular_lobe_is_that_of_roughplastic),
					   cmocka_unit_test(diffuse_lobe_is_that_of_plastic)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
