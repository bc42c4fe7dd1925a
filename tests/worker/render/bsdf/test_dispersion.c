/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Indices of refraction as functions of the wavelength, compared with manufacturers' catalogues and handbooks;
 * refraction by a prism, compared with Snell's law computed here; and the properties that a BSDF reports.
 * Deterministic.
 */
#include "tests/support/dice.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

#define PI 3.14159265358979323846

static const double fraunhofer_f = 486.1327, fraunhofer_d = 587.5618, fraunhofer_c = 656.2725;

static struct wavelengths wavelength_of(double nm)
{
	/* The other wavelengths must not be used. */
	return (struct wavelengths){.nm = {nm, NAN, NAN, NAN}};
}

static double refractive_index(const char *text, double nm)
{
	struct arena a = {0};
	struct bsdf b;
	struct wavelengths w = wavelength_of(nm);
	bsdf_make_or_fail(&a, text, &b);
	double eta = bsdf_eta(&b, &w);
	arena_fini(&a);
	return eta;
}

/* Catalogues (Schott N-BK7, N-SF11) and handbooks print five or six digits; those of water are relative to air.
 * Diamond: Peter's 2.4175 at d, and the dispersion n(430.8) - n(686.7) = 0.044 of gemmological tables. */
static void test_glasses_have_their_catalogue_values(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double f, d, c, tolerance;
	} glass[] = {
		{"dielectric ext_ior=1 dispersion=true int_ior=bk7", 1.52238, 1.51680, 1.51432, 6e-6},
		{"dielectric ext_ior=1 dispersion=true int_ior=sf11", 1.80651, 1.78472, 1.77596, 6e-6},
		{"dielectric ext_ior=1 dispersion=true int_ior=fused_quartz", 1.46313, 1.45846, 1.45637, 6e-6},
		{"dielectric ext_ior=1 dispersion=true int_ior=water", 1.33712 * 1.00027, 1.33304 * 1.00027,
		 1.33115 * 1.00027, 5e-5},
		{"dielectric ext_ior=1 dispersion=true int_ior=sapphire_(o)", 1.7756, 1.7682, 1.7649, 1e-4},
		{"dielectric ext_ior=1 dispersion=true int_ior=diamond", 2.4354, 2.4175, 2.4099, 5e-4},
		{"roughdielectric ext_ior=1 int_sellmeier=1.03961212,0.231792344,1.01046945,0.00600069867,0.0200179144,103.560653",
		 1.52238, 1.51680, 1.51432, 6e-6},
	};
	for (size_t k = 0; k < sizeof glass / sizeof *glass; k++) {
		double f = refractive_index(glass[k].text, fraunhofer_f),
		       d = refractive_index(glass[k].text, fraunhofer_d),
		       c = refractive_index(glass[k].text, fraunhofer_c);
		double worst = fmax(fabs(f - glass[k].f), fmax(fabs(d - glass[k].d), fabs(c - glass[k].c)));
		if (!(worst < glass[k].tolerance))
			fail_msg("%s: F %.6f, d %.6f, C %.6f", glass[k].text, f, d, c);
	}
	const char *bk7 = glass[0].text, *diamond = glass[5].text;
	double abbe = (refractive_index(bk7, fraunhofer_d) - 1) /
		      (refractive_index(bk7, fraunhofer_f) - refractive_index(bk7, fraunhofer_c));
	assert_true(fabs(abbe - 64.17) < 0.02);
	assert_true(fabs(refractive_index(diamond, 430.8) - refractive_index(diamond, 686.7) - 0.044) < 0.001);
}

/* A name alone gives Mitsuba's index; with dispersion, it gives that of the law at 587.6 nm. */
static void material_name_gives_its_index_and_dispersion_law(void **state)
{
	(void)state;
	static const struct {
		const char *name;
		double plain, law;
	} names[] = {{"bk7", 1.5046, 1.5168},	  {"sf11", 1.78471, 1.78471}, {"fused_quartz", 1.458, 1.45846},
		     {"diamond", 2.419, 2.41748}, {"water", 1.333, 1.3334},   {"sapphire_(o)", 1.76817, 1.76817}};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		char plain[96], law[128];
		struct arena a = {0};
		struct bsdf b, c;
		snprintf(plain, sizeof plain, "dielectric ext_ior=1 int_ior=%s", names[i].name);
		snprintf(law, sizeof law, "%s dispersion=true", plain);
		bsdf_make_or_fail(&a, plain, &b);
		bsdf_make_or_fail(&a, law, &c);
		assert_true(b.eta == names[i].plain && !b.is_dispersive);
		assert_true(fabs(c.eta - names[i].law) < 1e-5 && c.is_dispersive);
		arena_fini(&a);
	}
}

static void dispersive_bsdfs_are_marked(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double eta;
		bool dispersive, smooth;
		enum color_kind shape;
	} expected[] = {
		{"dielectric", 1.5046 / 1.000277, false, false, COLOR_KIND_CONSTANT},
		{"dielectric int_ior=bk7 ext_ior=air", 1.5046 / 1.000277, false, false, COLOR_KIND_CONSTANT},
		{"dielectric int_ior=bk7 ext_ior=1 dispersion=false", 1.5046, false, false, COLOR_KIND_CONSTANT},
		{"dielectric int_ior=bk7 ext_ior=bk7 dispersion=true", 1, false, false, COLOR_KIND_CONSTANT},
		{"dielectric int_ior=1.5 ext_ior=1 int_cauchy_b=0", 1.5, false, false, COLOR_KIND_CONSTANT},
		{"dielectric int_ior=1.5 ext_ior=1 int_cauchy_b=0 dispersion=true", 1.5, false, false,
		 COLOR_KIND_CONSTANT},
		{"dielectric int_ior=1.5 ext_ior=1 int_cauchy_b=0.004", 1.5, true, false, COLOR_KIND_OTHER},
		{"dielectric int_ior=3 ext_ior=2 ext_cauchy_b=0.01", 1.5, true, false, COLOR_KIND_OTHER},
		{"roughdielectric int_ior=1.5 ext_ior=1.5", 1, false, false, COLOR_KIND_CONSTANT},
		{"roughdielectric int_ior=1.5 ext_ior=1.5 int_cauchy_b=0.01", 1, true, true, COLOR_KIND_OTHER},
		{"roughdielectric int_ior=bk7 ext_ior=bk7 dispersion=true", 1, false, false, COLOR_KIND_CONSTANT},
	};
	for (size_t k = 0; k < sizeof expected / sizeof *expected; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, expected[k].text, &b);
		if (!(fabs(b.eta - expected[k].eta) < 1e-15 && b.is_dispersive == expected[k].dispersive &&
		      b.has_smooth == expected[k].smooth && b.has_delta != b.has_smooth &&
		      b.color_kind == expected[k].shape))
			fail_msg("%s: eta %.17g, dispersive %d, smooth %d, shape %d", expected[k].text, b.eta,
				 b.is_dispersive, b.has_smooth, (int)b.color_kind);
		arena_fini(&a);
	}
}

static void index_follows_cauchys_law(void **state)
{
	(void)state;
	const char *text = "dielectric int_ior=1.5 ext_ior=1 int_cauchy_b=0.0042";
	for (double nm = 360; nm <= 830; nm += 47)
		assert_true(fabs(refractive_index(text, nm) -
				 (1.5 + 0.0042 * (1e6 / (nm * nm) - 1 / (0.5876 * 0.5876)))) < 1e-15);
}

/* Converts v to the frame whose z axis is at `angle` from the world's z in the plane y = 0, and back with -angle. */
static vec3 rotate_about_y(vec3 v, double angle)
{
	return (vec3){cos(angle) * v.x - sin(angle) * v.z, v.y, sin(angle) * v.x + cos(angle) * v.z};
}

/* Light passes a prism of 60 degrees, in its plane, by two specular refractions. The deviation is compared with the
 * closed form delta = i + asin(n sin(A - asin(sin i / n))) - A. */
static void test_a_prism_spreads_light(void **state)
{
	(void)state;
	const double apex = PI / 3, incidence = 1.1;
	struct arena a = {0};
	struct bsdf b;
	bsdf_make_or_fail(&a, "dielectric int_ior=sf11 ext_ior=1 dispersion=true specular_transmittance=0.5", &b);
	double previous_deviation = INFINITY, spread = 0;
	for (double nm = 365; nm < 830; nm += 25) {
		struct wavelengths w = wavelength_of(nm);
		struct bsdf_point p = {.wavelengths = &w};
		vec3 in = {-sin(incidence), 0, cos(incidence)}, inside, out;
		double chance, n = 0, l2 = nm * nm * 1e-6;
		spectrum first = bsdf_eval_delta(&b, &p, in, BSDF_TRANSMIT, &inside, &chance);
		/* The outward normal of the second face is rotated by pi - apex; light arrives from inside. */
		vec3 from = rotate_about_y(vec3_neg(inside), PI - apex);
		if (from.z > 0)
			from = rotate_about_y(vec3_neg(inside), -(PI - apex));
		spectrum second = bsdf_eval_delta(&b, &p, from, BSDF_TRANSMIT, &out, &chance);
		assert_true(first.v[0] > 0 && first.v[0] < 0.5 && second.v[0] > 0 && out.z > 0);
		n = sqrt(1 + 1.73759695 * l2 / (l2 - 0.013188707) + 0.313747346 * l2 / (l2 - 0.0623068142) +
			 1.89878101 * l2 / (l2 - 155.23629));
		double refracted = asin(sin(incidence) / n), exit = asin(n * sin(apex - refracted));
		double actual_deviation = acos(out.z);
		if (!(fabs(actual_deviation - exit) < 1e-12))
			fail_msg("%g nm leaves at %.15g, not %.15g", nm, actual_deviation, exit);
		double deviation = incidence + actual_deviation - apex;
		assert_true(deviation < previous_deviation);
		spread = nm == 365 ? deviation : spread;
		previous_deviation = deviation;
		/* Fresnel's factor at both faces, from the angles. */
		double rs = sin(incidence - refracted) / sin(incidence + refracted),
		       rp = tan(incidence - refracted) / tan(incidence + refracted);
		assert_true(fabs(first.v[0] * n * n - 0.5 * (1 - (rs * rs + rp * rp) / 2)) < 1e-13);
	}
	assert_true(spread - previous_deviation > 0.1);
	arena_fini(&a);
}

/* With coefficients of 0, the values are those of plain glass to the bit; and only nm[0] is used. */
static void zero_coefficients_are_plain_glass_and_use_one_wavelength(void **state)
{
	(void)state;
	static const char *const pairs[][2] = {
		{"dielectric int_ior=1.6 ext_ior=1", "dielectric int_ior=1.6 ext_ior=1 int_cauchy_b=0 ext_cauchy_b=0"},
		{"roughdielectric int_ior=1.6 ext_ior=1 alpha=0.2",
		 "roughdielectric int_ior=1.6 ext_ior=1 alpha=0.2 int_cauchy_b=0"},
	};
	const struct wavelengths w = {.nm = {500, 600, 700, 800}}, hero = {.nm = {500, NAN, NAN, NAN}};
	struct dice d = dice_for_test(__func__);
	struct arena a = {0};
	for (int i = 0; i < 4000; i++) {
		struct bsdf plain, zero, bent;
		struct bsdf_sample s, t;
		struct bsdf_point p = {.wavelengths = &w}, q = {.wavelengths = &hero};
		vec3 wo = dice_direction(&d);
		double u[3] = {dice_uniform(&d), dice_uniform(&d), dice_uniform(&d)};
		bsdf_make_or_fail(&a, pairs[i % 2][0], &plain);
		bsdf_make_or_fail(&a, pairs[i % 2][1], &zero);
		bsdf_make_or_fail(&a,
				  i % 2 ? "roughdielectric int_ior=bk7 dispersion=true"
					: "dielectric int_ior=bk7 dispersion=true",
				  &bent);
		bool is_sampled = plain.ops->sample(&plain, &p, wo, u, &s);
		assert_int_equal(is_sampled, zero.ops->sample(&zero, &p, wo, u, &t));
		assert_true(!is_sampled ||
			    (s.pdf == t.pdf && s.f.v[3] == t.f.v[3] && s.wi.x == t.wi.x && s.wi.z == t.wi.z));
		is_sampled = bent.ops->sample(&bent, &p, wo, u, &s);
		assert_int_equal(is_sampled, bent.ops->sample(&bent, &q, wo, u, &t));
		assert_true(!is_sampled ||
			    (s.pdf == t.pdf && s.f.v[0] == t.f.v[0] && s.wi.x == t.wi.x && s.eta == t.eta));
		arena_fini(&a);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_glasses_have_their_catalogue_values),
		cmocka_unit_test(material_name_gives_its_index_and_dispersion_law),
		cmocka_unit_test(dispersive_bsdfs_are_marked),
		cmocka_unit_test(index_follows_cauchys_law),
		cmocka_unit_test(test_a_prism_spreads_light),
		cmocka_unit_test(zero_coefficients_are_plain_glass_and_use_one_wavelength),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
