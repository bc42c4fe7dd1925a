/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Exactly specular lobes. eval_delta gives the directions and probabilities that sample() finds at random; no light
 * passes beyond the critical angle; masks and polarization filters let light pass straight through; and the mean
 * roughness that mutations use is that of all lobes.
 */
#include "tests/support/dice.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/bsdf/diffuse.h"
#include "worker/render/bsdf/twosided.h"

#include <float.h>

static const struct wavelengths wavelengths = {.nm = {550, 500, 600, 700}};

/* Further cases: mirrors inside twosided. */
static const char *const mirrors[] = {
	"twosided | conductor material=Au | conductor material=Ag specular_reflectance=0.5",
	"twosided | conductor material=Cr | diffuse",
	"twosided | conductor material=Al",
};
enum { MIRRORS = sizeof mirrors / sizeof *mirrors };

static const char *case_text(int k)
{
	return k < BSDF_CASES ? bsdf_cases[k] : mirrors[k - BSDF_CASES];
}

static bool is_near(double a, double b)
{
	return fabs(a - b) <= 8 * DBL_EPSILON * fabs(b);
}

static void check_lobe(const char *text, const struct bsdf *b, const struct bsdf_point *p, vec3 wo,
		       const struct bsdf_sample *s)
{
	for (int with_bit = 0; with_bit < 2; with_bit++) {
		vec3 wi = {NAN, NAN, NAN};
		double chance = NAN;
		unsigned mode = with_bit ? s->mode : s->mode & ~(unsigned)BSDF_DELTA;
		spectrum weight = bsdf_eval_delta(b, p, wo, mode, &wi, &chance);
		if (!is_near(wi.x, s->wi.x) || !is_near(wi.y, s->wi.y) || !is_near(wi.z, s->wi.z) ||
		    !is_near(chance, s->pdf))
			fail_msg("%s: from z = %g lobe %x goes to z = %g with chance %g, sample to %g with %g", text,
				 wo.z, mode, wi.z, chance, s->wi.z, s->pdf);
		for (int l = 0; l < SPECTRUM_LANES; l++)
			if (!is_near(weight.v[l], s->f.v[l] * fabs(s->wi.z)))
				fail_msg("%s: from z = %g lobe %x weighs %.17g, sample %.17g", text, wo.z, mode,
					 weight.v[l], s->f.v[l] * fabs(s->wi.z));
	}
}

/* Sums the probabilities of all specular lobes. */
static double sum_of_probabilities(const struct bsdf *b, const struct bsdf_point *p, vec3 wo)
{
	double sum = 0;
	static const unsigned modes[] = {BSDF_REFLECT, BSDF_TRANSMIT, BSDF_TRANSMIT | BSDF_STRAIGHT};
	for (int i = 0; i < 3; i++) {
		vec3 wi;
		double chance;
		if (!spectrum_is_zero(bsdf_eval_delta(b, p, wo, modes[i], &wi, &chance)))
			sum += chance;
	}
	return sum;
}

static vec3 random_direction(struct dice *d, int i)
{
	vec3 w = dice_direction(d);
	if (i % 4)
		return w;
	double z = copysign(pow(10, -dice_between(d, 0, 12)), w.z), r = sqrt((1 - z) * (1 + z)) / hypot(w.x, w.y);
	return (vec3){r * w.x, r * w.y, z};
}

static void test_specular_lobes_are_those_of_sample(void **state)
{
	(void)state;
	size_t lobes[2] = {0, 0}, mirrored = 0;
	for (int k = 0; k < BSDF_CASES + MIRRORS; k++) {
		struct dice d = dice_for_test(case_text(k));
		struct arena a = {0};
		struct bsdf b;
		double excess = 0, variance = 0;
		bsdf_make_or_fail(&a, case_text(k), &b);
		for (int i = 0; i < 2000; i++) {
			vec3 wo = random_direction(&d, i);
			struct bsdf_point p = {.texture_point = {.u = 0.3, .v = 0.7},
					       .wavelengths = &wavelengths,
					       .transport = i % 2 ? TRANSPORT_RADIANCE : TRANSPORT_IMPORTANCE};
			double u[3] = {dice_uniform(&d), dice_uniform(&d), dice_uniform(&d)};
			struct bsdf_sample s;
			bool is_sampled = b.ops->sample(&b, &p, wo, u, &s);
			bool specular = is_sampled && (s.mode & BSDF_DELTA);
			if (specular) {
				check_lobe(case_text(k), &b, &p, wo, &s);
				lobes[(s.mode & BSDF_TRANSMIT) != 0]++;
				mirrored += wo.z < 0 && b.ops->decl.type[0] == 't';
			}
			/* If specular and other lobes lie on the same side, only frequencies can be compared. */
			double chance = sum_of_probabilities(&b, &p, wo);
			bool mixed = b.has_smooth && chance > 0 && chance < 1;
			if (!mixed && !(fabs(chance - specular) < 1e-12))
				fail_msg("%s: from z = %g specular chances add up to %g", case_text(k), wo.z, chance);
			excess += mixed ? specular - chance : 0;
			variance += mixed ? chance * (1 - chance) : 0;
		}
		/* Six standard deviations: level 2e-9 per case. */
		if (fabs(excess) > 6 * sqrt(variance))
			fail_msg("%s: %g specular samples more than their chances say, +- %g", case_text(k), excess,
				 sqrt(variance));
		arena_fini(&a);
	}
	assert_true(lobes[0] > 2000 && lobes[1] > 1000 && mirrored > 1000);
}

static void test_a_mirrored_back_is_a_mirror(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	struct error e;
	vec3 wi, wo = {0.6, 0, -0.8};
	double chance;
	const struct bsdf_point p = {.wavelengths = &wavelengths};
	bsdf_make_or_fail(&a, "conductor material=none specular_reflectance=0.5", &b);
	assert_true(spectrum_is_zero(bsdf_eval_delta(&b, &p, wo, BSDF_REFLECT, &wi, &chance)));
	assert_int_equal(bsdf_mirror_back(&b, &(struct bsdf_build){.arena = &a}, &e), 0);
	assert_true(bsdf_eval_delta(&b, &p, wo, BSDF_REFLECT | BSDF_DELTA, &wi, &chance).v[2] == 0.5);
	assert_true(wi.x == -0.6 && wi.z == -0.8 && chance == 1 && b.mean_alpha == 0);
	assert_true(spectrum_is_zero(bsdf_eval_delta(&b, &p, wo, BSDF_TRANSMIT, &wi, &chance)));
	arena_fini(&a);
}

static void test_nothing_passes_beyond_the_critical_angle(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	vec3 wi;
	double chance, critical = sqrt(1 - 1 / 2.25);
	const struct bsdf_point p = {.wavelengths = &wavelengths};
	bsdf_make_or_fail(&a, "dielectric int_ior=1.5 ext_ior=1", &b);
	for (int i = -100; i <= 100; i++) {
		double z = critical + 1e-4 * i + 1e-9;
		vec3 wo = {sqrt(1 - z * z), 0, -z};
		bool is_transmitted = !spectrum_is_zero(bsdf_eval_delta(&b, &p, wo, BSDF_TRANSMIT, &wi, &chance));
		assert_int_equal(is_transmitted, i >= 0);
		double reflected = bsdf_eval_delta(&b, &p, wo, BSDF_REFLECT, &wi, &chance).v[0];
		assert_true(i >= 0 ? reflected < 1 : reflected == 1 && chance == 1);
	}
	arena_fini(&a);
}

/* For unpolarised light, polarization filters are like a black sheet with holes. */
static void polarization_filters_are_black_sheets_with_holes(void **state)
{
	(void)state;
	static const char *const pairs[][2] = {
		{"polarizer theta=30", "mask opacity=0.5 | diffuse reflectance=0"},
		{"polarizer transmittance=0.5 polarizing=false", "mask opacity=0.75 | diffuse reflectance=0"},
		{"circular left_handed=true", "mask opacity=0.5 | diffuse reflectance=0"},
		{"circular transmittance=0.25", "mask opacity=0.875 | diffuse reflectance=0"},
		{"retarder theta=20 delta=180", "null"},
		{"retarder", "mask opacity=0 | diffuse"},
	};
	const unsigned straight = BSDF_TRANSMIT | BSDF_STRAIGHT;
	struct dice d = dice_for_test("filters");
	for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
		struct arena a = {0};
		struct bsdf filter, sheet;
		bsdf_make_or_fail(&a, pairs[i][0], &filter);
		bsdf_make_or_fail(&a, pairs[i][1], &sheet);
		for (int k = 0; k < 20; k++) {
			struct bsdf_point p = {.wavelengths = &wavelengths};
			vec3 wo = random_direction(&d, k), through, also;
			double chance;
			spectrum weight = bsdf_eval_delta(&filter, &p, wo, straight, &through, &chance),
				 expected = bsdf_eval_delta(&sheet, &p, wo, straight, &also, &chance);
			assert_memory_equal(&through, &also, sizeof through);
			for (int l = 0; l < SPECTRUM_LANES; l++)
				if (weight.v[l] != expected.v[l])
					fail_msg("%s lets %g through, %s %g", pairs[i][0], weight.v[l], pairs[i][1],
						 expected.v[l]);
			assert_true(spectrum_is_zero(bsdf_eval_delta(&filter, &p, wo, BSDF_REFLECT, &also, &chance)));
		}
		arena_fini(&a);
	}
}

/* Glass with holes has three specular lobes: the two of the glass, scaled by its share, and the straight one of the
 * holes. A query for one lobe is not answered with another. */
static void test_masked_glass_has_three_lobes(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf glass, masked;
	const struct bsdf_point p = {.wavelengths = &wavelengths};
	struct dice d = dice_for_test("masked glass");
	bsdf_make_or_fail(&a, "dielectric int_ior=1.5 ext_ior=1", &glass);
	bsdf_make_or_fail(&a, "mask opacity=0.25 | dielectric int_ior=1.5 ext_ior=1", &masked);
	for (int k = 0; k < 100; k++) {
		vec3 wo = random_direction(&d, k), wi[2] = {{0, 0, 0}, {0, 0, 0}};
		double chance[2];
		for (unsigned mode = BSDF_REFLECT; mode <= BSDF_TRANSMIT; mode++) {
			spectrum whole = bsdf_eval_delta(&glass, &p, wo, mode, &wi[0], &chance[0]),
				 part = bsdf_eval_delta(&masked, &p, wo, mode, &wi[1], &chance[1]);
			assert_true(part.v[0] == 0.25 * whole.v[0]);
			if (part.v[0] > 0)
				assert_true(chance[1] == 0.25 * chance[0] && wi[0].z == wi[1].z);
		}
		spectrum holes = bsdf_eval_delta(&masked, &p, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, &wi[1], &chance[1]);
		assert_true(holes.v[0] == 0.75 && chance[1] == 0.75 && wi[1].x == -wo.x && wi[1].z == -wo.z);
		assert_true(spectrum_is_zero(
			bsdf_eval_delta(&glass, &p, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, &wi[0], &chance[0])));
	}
	arena_fini(&a);
}

static void mean_roughness_weights_all_lobes(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double mean;
	} expected[] = {
		{"diffuse", 1},
		{"conductor", 0},
		{"dielectric", 0},
		{"roughconductor alpha=0.2", 0.2},
		{"roughdielectric alpha=0.3 distribution=ggx", 0.3},
		{"roughdielectric alpha=0.3 int_ior=1.2 ext_ior=1.2", 0},
		{"phong exponent=6 diffuse_reflectance=0.6 specular_reflectance=0.2", 0.25 * 0.5 + 0.75},
		{"phong exponent=6 diffuse_reflectance=0 specular_reflectance=0.2", 0.5},
		{"phong diffuse_reflectance=0 specular_reflectance=0", 1},
		{"twosided | roughconductor alpha=0.2 | diffuse", 0.6},
		{"twosided | conductor | roughconductor alpha=0.2", 0.2},
		{"twosided | conductor", 0},
	};
	struct arena a = {0};
	struct bsdf b;
	for (size_t k = 0; k < sizeof expected / sizeof *expected; k++) {
		bsdf_make_or_fail(&a, expected[k].text, &b);
		if (!(fabs(b.mean_alpha - expected[k].mean) < 1e-15))
			fail_msg("%s: %.17g", expected[k].text, b.mean_alpha);
	}
	bsdf_make_default(&b);
	assert_true(b.mean_alpha == 1);
	bsdf_make_black(&b);
	assert_true(b.mean_alpha == 0);
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_specular_lobes_are_those_of_sample),
		cmocka_unit_test(test_a_mirrored_back_is_a_mirror),
		cmocka_unit_test(test_nothing_passes_beyond_the_critical_angle),
		cmocka_unit_test(polarization_filters_are_black_sheets_with_holes),
		cmocka_unit_test(test_masked_glass_has_three_lobes),
		cmocka_unit_test(mean_roughness_weights_all_lobes),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
