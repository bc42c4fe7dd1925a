/* SPDX-License-Identifier: Apache-2.0 */
/* Quantities of materials that may be textured: a texture with one value is equivalent to the number, and one with two
 * values to its number at each point. */
#include "tests/support/dice.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

#include <errno.h>
#include <math.h>

static const struct wavelengths wavelengths = {.nm = {400, 500, 600, 700}};

/* BSDFs as text, with %s in place of the quantity, and values as text and as texture for which the lobes differ. */
static const struct {
	const char *prefix, *name, *suffix;
	double low, high;
	bool is_number; /* not a spectrum: Mitsuba 3 exchanges the colours of checkerboards */
} quantities[] = {
	{"phong specular_reflectance=0.6", "exponent", "", 3, 200, true},
	{"principledthin spec_trans=0.7 spec_tint=0.3 roughness=0.5", "eta", "", 1.2, 2.5, true},
	{"coating thickness=2", "sigma_a", "| diffuse reflectance=0.8", 0.1, 0.7, false},
	{"roughcoating alpha=0.2", "sigma_a", "| roughconductor alpha=0.3", 0.1, 0.7, false},
	{"roughconductor alpha=0.3 k=2", "eta", "", 0.3, 1.4, false},
};
enum { QUANTITIES = sizeof quantities / sizeof *quantities };

static void assert_same_bsdf(const char *text, const struct bsdf *got, const struct bsdf *want, double u)
{
	struct dice d = dice_for_test(text);
	const struct bsdf_point p = {
		.texture_point = {.u = u, .v = 0.2}, .wavelengths = &wavelengths, .transport = TRANSPORT_RADIANCE};
	int seen = 0;
	for (int i = 0; i < 1000; i++) {
		vec3 wo = dice_direction(&d), wi = dice_direction(&d);
		const double x[3] = {dice_uniform(&d), dice_uniform(&d), dice_uniform(&d)};
		spectrum a = got->ops->eval(got, &p, wo, wi), b = want->ops->eval(want, &p, wo, wi);
		spectrum ah = bsdf_eval_halfvec(got, &p, wo, wi), bh = bsdf_eval_halfvec(want, &p, wo, wi);
		if (memcmp(&a, &b, sizeof a) != 0 || memcmp(&ah, &bh, sizeof ah) != 0)
			fail_msg("%s: %.17g is not %.17g", text, a.v[0], b.v[0]);
		if (got->ops->pdf_solid(got, &p, wo, wi) != want->ops->pdf_solid(want, &p, wo, wi))
			fail_msg("%s: another density", text);
		struct bsdf_sample s, t;
		bool sampled = got->ops->sample(got, &p, wo, x, &s), wanted = want->ops->sample(want, &p, wo, x, &t);
		if (sampled != wanted || (sampled && (memcmp(&s.wi, &t.wi, sizeof s.wi) != 0 || s.pdf != t.pdf)))
			fail_msg("%s: another sample", text);
		seen += a.v[0] > 0 && sampled;
	}
	assert_true(seen > 100);
}

static void test_a_texture_is_its_value_at_each_point(void **state)
{
	(void)state;
	for (size_t q = 0; q < QUANTITIES; q++)
		for (int place = 0; place < 2; place++)
			for (int varies = 0; varies < 2; varies++) {
				struct arena a = {0};
				struct bsdf constant, textured;
				char text[256];
				bool exchanged = quantities[q].is_number && place == 0;
				bool second = quantities[q].is_number ? exchanged : place == 1;
				double value = second ? quantities[q].high : quantities[q].low;
				snprintf(text, sizeof text, "%s %s=%g %s", quantities[q].prefix, quantities[q].name,
					 value, quantities[q].suffix);
				bsdf_make_or_fail(&a, text, &constant);
				snprintf(text, sizeof text, "%s %s | @%s checkerboard color0=%g color1=%g",
					 quantities[q].prefix, quantities[q].suffix, quantities[q].name,
					 varies ? quantities[q].low : value, varies ? quantities[q].high : value);
				bsdf_make_or_fail(&a, text, &textured);
				assert_true(textured.is_textured);
				assert_int_equal(textured.modes, constant.modes);
				assert_same_bsdf(text, &textured, &constant, place ? 0.7 : 0.2);
				if (!varies && textured.min_alpha != constant.min_alpha)
					fail_msg("%s: alpha is %g, not %g", text, textured.min_alpha,
						 constant.min_alpha);
				arena_fini(&a);
			}
}

/* The roughness that determines the steps of chains is that of the narrowest lobe. */
static void test_the_narrowest_lobe_counts(void **state)
{
	(void)state;
	static const char *const of[][2] = {
		{"phong | @exponent checkerboard color0=2 color1=500", "phong exponent=500"},
		{"phong | @exponent checkerboard color0=500 color1=2", "phong exponent=500"},
		{"principledthin spec_trans=1 roughness=0.3 | @eta checkerboard color0=1.1 color1=3",
		 "principledthin spec_trans=1 roughness=0.3 eta=1.1"},
		{"principledthin spec_trans=1 roughness=0.3 | @eta checkerboard color0=3 color1=1.1",
		 "principledthin spec_trans=1 roughness=0.3 eta=1.1"},
	};
	for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
		struct arena a = {0};
		struct bsdf got, want;
		bsdf_make_or_fail(&a, of[i][0], &got);
		bsdf_make_or_fail(&a, of[i][1], &want);
		if (got.min_alpha != want.min_alpha)
			fail_msg("%s: %g is not %g", of[i][0], got.min_alpha, want.min_alpha);
		arena_fini(&a);
	}
}

static void textured_quantities_out_of_range_are_refused(void **state)
{
	(void)state;
	static const char *const texts[] = {
		"phong | @exponent scale scale=10 value=5e8",
		"principledthin | @eta checkerboard color0=0.5 color1=1.5",
		"principledthin | @eta checkerboard color0=1.2 color1=11",
	};
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
		struct arena a = {0};
		struct bsdf b;
		struct error e;
		if (bsdf_try(&a, texts[i], true, &b, &e) != -ERANGE)
			fail_msg("%s: accepted, or another error", texts[i]);
		arena_fini(&a);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_a_texture_is_its_value_at_each_point),
		cmocka_unit_test(test_the_narrowest_lobe_counts),
		cmocka_unit_test(textured_quantities_out_of_range_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
