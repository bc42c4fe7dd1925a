/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Laws that every BSDF obeys, for all of bsdf_cases.h: reciprocity unless `is_nonreciprocal`, no gain of energy, white
 * furnaces, the same values without wavelengths and in any frame. Then closed forms of simple BSDFs, microfacet values
 * computed by hand, textured roughness, and errors: invalid parameters, and lack of memory.
 */
#include "tests/support/test_length.h"
#include "tests/support/stats.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/math/rng.h"
#include "worker/render/bsdf/diffuse.h"

#define PI 3.14159265358979323846

static const struct wavelengths wavelengths = {.nm = {550, 500, 600, 700}};

static struct bsdf_point point_of(enum transport t)
{
	return (struct bsdf_point){.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = &wavelengths, .transport = t};
}

static vec3 uniform_direction(double u0, double u1)
{
	double z = 1 - 2 * u0, r = sqrt(fmax(0, 1 - z * z)), phi = 2 * PI * u1;
	return vec3_normalize((vec3){r * cos(phi), r * sin(phi), z});
}

static double index_on(const struct bsdf *b, vec3 v)
{
	return v.z > 0 ? 1 : bsdf_eta(b, &wavelengths);
}

static void assert_near(double a, double b, double tolerance, const char *what)
{
	if (!(fabs(a - b) <= tolerance * fmax(fabs(a), fabs(b)) || fabs(a - b) < 1e-290))
		fail_msg("%s: %.17g is not %.17g", what, a, b);
}

/* Deterministic: f(wo,wi) n_wi^2 = f(wi,wo) n_wo^2 for radiance, unless it is directed, and importance is radiance with
 * the directions exchanged. Cosines to a facet seen edge-on keep few digits, hence 1e-6. */
static void bsdfs_are_reciprocal(void **state)
{
	(void)state;
	int positive = 0;
	for (int k = 0; k < BSDF_CASES; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, bsdf_cases[k], &b);
		const struct bsdf_point r = point_of(TRANSPORT_RADIANCE), m = point_of(TRANSPORT_IMPORTANCE);
		for (uint64_t i = 0; i < 2000; i++) {
			double u[4];
			struct bsdf_sample s;
			rng_uniform4(stats_seed(__func__), RNG_TEST, i, 0, 0, u);
			vec3 wo = uniform_direction(u[0], u[1]), wi = uniform_direction(u[2], u[3]);
			/* Half of the pairs lie within the lobes. */
			if (i % 2 && b.ops->sample(&b, &r, wo, u, &s))
				wi = s.wi;
			spectrum forward = b.ops->eval(&b, &r, wo, wi), reverse = b.ops->eval(&b, &r, wi, wo);
			spectrum importance = b.ops->eval(&b, &m, wo, wi);
			double no = index_on(&b, wo), ni = index_on(&b, wi);
			for (int l = 0; l < SPECTRUM_LANES; l++) {
				if (b.is_nonreciprocal) {
					assert_near(reverse.v[l], importance.v[l], 1e-12, bsdf_cases[k]);
					continue;
				}
				assert_near(forward.v[l] * ni * ni, reverse.v[l] * no * no, 1e-6, bsdf_cases[k]);
				assert_near(forward.v[l] * ni * ni, importance.v[l] * no * no, 1e-12, bsdf_cases[k]);
			}
			positive += spectrum_max(forward) > 0;
		}
		arena_fini(&a);
	}
	assert_true(positive > BSDF_CASES * 500);
}

/* Estimates the share of light that is scattered, as importance (which refraction does not scale), by sampling. */
static struct stats_mean albedo(const struct bsdf *b, vec3 wo, enum transport t, uint64_t seed)
{
	enum { GROUPS = 16, SAMPLES = 1000 };
	const struct bsdf_point p = point_of(t);
	double means[GROUPS] = {0};
	for (uint64_t i = 0; i < GROUPS * SAMPLES; i++) {
		double u[4];
		struct bsdf_sample s;
		rng_uniform4(seed, RNG_TEST, i, 0, 0, u);
		if (!b->ops->sample(b, &p, wo, u, &s))
			continue;
		double scale = t == TRANSPORT_RADIANCE ? s.eta * s.eta : 1;
		means[i % GROUPS] += scale * spectrum_max(s.f) * fabs(s.wi.z) / s.pdf / SAMPLES;
	}
	return stats_mean_test(means, GROUPS, 1);
}

/* Level: 8 standard errors with 15 degrees of freedom, below 1e-6 per test. A gain of 5 % anywhere would be found. */
static vec3 rotate_about_z(vec3 w, double angle)
{
	double c = cos(angle), s = sin(angle);
	return (vec3){c * w.x - s * w.y, s * w.x + c * w.y, w.z};
}

/* A BSDF without uses_tangents does not depend on the rotation of the frame about the normal, so it gets no
 * tangents. */
static void bsdfs_without_tangents_ignore_rotation(void **state)
{
	(void)state;
	int without = 0;
	for (int k = 0; k < BSDF_CASES; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, bsdf_cases[k], &b);
		const struct bsdf_point at = point_of(TRANSPORT_RADIANCE);
		for (uint64_t i = 0; i < 400 && !b.uses_tangents; i++) {
			double u[4];
			struct bsdf_sample s;
			rng_uniform4(stats_seed(__func__), RNG_TEST, i, 0, 0, u);
			vec3 wo = uniform_direction(u[0], u[1]), wi = uniform_direction(u[2], u[3]);
			if (i % 2 && b.ops->sample(&b, &at, wo, u, &s))
				wi = s.wi;
			spectrum f = b.ops->eval(&b, &at, wo, wi),
				 g = b.ops->eval(&b, &at, rotate_about_z(wo, 1 + u[0]), rotate_about_z(wi, 1 + u[0]));
			assert_near(f.v[0], g.v[0], 1e-6, bsdf_cases[k]);
		}
		without += !b.uses_tangents;
		arena_fini(&a);
	}
	assert_true(without > BSDF_CASES / 2 && without < BSDF_CASES - 5);
}

static void test_no_energy_is_gained(void **state)
{
	(void)state;
	double largest = 0, widest = 0;
	for (int k = 0; k < BSDF_CASES; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, bsdf_cases[k], &b);
		for (int i = 0; i < 16; i += test_is_scaled() ? 5 : 1) {
			double z = (1 - 2 * (i & 1)) * (0.05 + 0.95 * (i / 2) / 7.0);
			vec3 wo = {sqrt(1 - fmin(z * z, 1)), 0, z};
			/* Not reciprocal: all of the light that leaves comes from somewhere, but what one direction
			 * brings leaves at many places. */
			int last = b.is_nonreciprocal ? TRANSPORT_RADIANCE : TRANSPORT_IMPORTANCE;
			for (int t = TRANSPORT_RADIANCE; t <= last; t++) {
				struct stats_mean m = albedo(&b, wo, (enum transport)t, stats_seed(bsdf_cases[k]));
				/* The principled model adds its lobes (worker/render/bsdf/principled.c). */
				bool adds = strstr(bsdf_cases[k], "principled") != NULL;
				if (m.mean > (adds ? 1.5 : 1) + 8 * m.error + 1e-9)
					fail_msg("%s from z = %g: %g +- %g", bsdf_cases[k], z, m.mean, m.error);
				largest = fmax(largest, adds ? 0 : m.mean);
				widest = fmax(widest, adds ? 0 : m.error);
			}
		}
		arena_fini(&a);
	}
	print_message("largest share %.4f, largest standard error %.4f\n", largest, widest);
	assert_true(8 * widest < 0.05);
}

/* Reflected and transmitted light add up to all light; if both lobes are sampled, their probabilities add up to 1. */
static void test_smooth_boundaries_lose_nothing(void **state)
{
	(void)state;
	static const char *const texts[] = {"dielectric", "dielectric int_ior=1 ext_ior=1.7",
					    "dielectric int_ior=1.0001 ext_ior=1", "thindielectric"};
	const struct bsdf_point p = point_of(TRANSPORT_IMPORTANCE);
	for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, texts[k], &b);
		unsigned passes = BSDF_TRANSMIT | (b.modes & BSDF_STRAIGHT);
		for (int i = 0; i < 40; i++) {
			double z = -0.975 + 0.05 * i, chance[2];
			vec3 wo = {0, sqrt(1 - z * z), z}, wi;
			double reflected = bsdf_eval_delta(&b, &p, wo, BSDF_REFLECT, &wi, &chance[0]).v[0];
			double transmitted = bsdf_eval_delta(&b, &p, wo, passes, &wi, &chance[1]).v[0];
			assert_near(reflected + transmitted, 1, 1e-13, texts[k]);
			assert_near(chance[0] + chance[1], 1, 1e-13, texts[k]);
			assert_true(chance[0] >= reflected && chance[0] <= fmax(reflected, 0.1));
			assert_true(chance[0] >= fmin(0.1, 8 * reflected) && chance[0] <= 8 * reflected);
		}
		arena_fini(&a);
	}
}

/* White materials lose only what microfacets mask. */
static void white_materials_lose_only_masked_light(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double least;
	} white[] = {
		{"diffuse reflectance=1", 1 - 1e-12},
		{"conductor material=none", 1 - 1e-12},
		{"roughdielectric int_ior=1.3 ext_ior=1.3 alpha=0.2", 1 - 1e-12},
		{"roughconductor material=none alpha=0.001", 0.9999},
		{"roughconductor material=none alpha=0.2 distribution=ggx", 0.8},
		{"roughconductor material=none alpha=0.2", 0.85},
		{"roughdielectric alpha=0.001", 0.9999},
		{"roughdielectric alpha=0.001 distribution=ggx", 0.9999},
		{"roughdielectric alpha=0.2", 0.85},
		{"twosided | diffuse reflectance=1", 1 - 1e-12},
		{"hair sigma_a=0", 1 - 1e-12},
	};
	for (size_t k = 0; k < sizeof white / sizeof *white; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, white[k].text, &b);
		for (int i = 0; i < 6; i++) {
			double z = -0.95 + 0.38 * i;
			if (z < 0 && !b.is_two_sided)
				continue;
			struct stats_mean m = albedo(&b, (vec3){0, sqrt(1 - z * z), z}, TRANSPORT_RADIANCE, k);
			if (m.mean < white[k].least - 8 * m.error || (white[k].least > 0.999999 && m.error > 1e-12))
				fail_msg("%s from z = %g: %.15g +- %g", white[k].text, z, m.mean, m.error);
		}
		arena_fini(&a);
	}
}

static struct bsdf_sample draw_sample(const char *text, bool dialect_3, vec3 wo, double u2)
{
	struct arena a = {0};
	struct bsdf b;
	struct error e;
	struct bsdf_sample s;
	const struct bsdf_point p = point_of(TRANSPORT_RADIANCE);
	if (bsdf_try(&a, text, dialect_3, &b, &e))
		fail_msg("%s: %s", text, e.text);
	assert_true(b.ops->sample(&b, &p, vec3_normalize(wo), (double[]){0.3, 0.6, u2}, &s));
	arena_fini(&a);
	return s;
}

static double fresnel_at_normal(double n, double k)
{
	return ((n - 1) * (n - 1) + k * k) / ((n + 1) * (n + 1) + k * k);
}

static void values_have_their_closed_forms(void **state)
{
	(void)state;
	const vec3 up = {0, 0, 1}, slant = {0.6, 0, 0.8};
	/* A check of the data itself: Au at 550 nm. */
	struct bsdf_sample s = draw_sample("conductor material=Au", true, up, 0);
	assert_near(s.f.v[0], fresnel_at_normal(0.350, 2.714), 1e-3, "Au");
	/* Others there by laws of their own: diamond's (Peter 1923), rutile's for the extraordinary ray (Devore 1951).
	 */
	const double l2 = 0.55 * 0.55;
	double diamond = sqrt(1 + 0.3306 * l2 / (l2 - 0.030625) + 4.3356 * l2 / (l2 - 0.011236));
	s = draw_sample("conductor material=d-C", true, up, 0);
	assert_near(s.f.v[0], fresnel_at_normal(diamond, 0), 2e-4, "d-C");
	s = draw_sample("conductor material=TiO2", true, up, 0);
	assert_near(s.f.v[0], fresnel_at_normal(sqrt(7.197 + 0.3322 / (l2 - 0.0843)), 0), 2e-3, "TiO2");
	s = draw_sample("conductor material=MgO", true, up, 0);
	assert_near(s.f.v[0], fresnel_at_normal(1.7405, 0), 2e-4, "MgO");
	/* The default is copper in 0.6, and a perfect mirror in 3.x. */
	s = draw_sample("conductor", false, up, 0);
	assert_true(s.f.v[0] < 0.7 && s.f.v[3] > 0.9);
	s = draw_sample("conductor", true, up, 0);
	assert_true(s.f.v[0] == 1);
	s = draw_sample("conductor eta=1.5 k=2 ext_eta=1.25", true, up, 0);
	assert_near(s.f.v[0], fresnel_at_normal(1.2, 1.6), 1e-14, "ext_eta");
	s = draw_sample("dielectric int_ior=1.5 ext_ior=1", true, up, 0);
	assert_near(s.f.v[0], 0.04, 1e-14, "normal incidence");
	assert_near(s.pdf, 0.1, 1e-14, "more often than light");
	/* Snell's law, and the scaling of radiance. */
	s = draw_sample("dielectric int_ior=1.5 ext_ior=1", true, slant, 0.99);
	assert_near(s.wi.x, -0.4, 1e-14, "Snell");
	double below = sqrt(0.84), rs = (0.8 - 1.5 * below) / (0.8 + 1.5 * below), rp = (1.2 - below) / (1.2 + below);
	assert_near(s.f.v[0] * -s.wi.z, (1 - (rs * rs + rp * rp) / 2) / 2.25, 1e-14, "radiance");
	assert_near(s.eta, 1.5, 1e-14, "eta");
	/* Total reflection from inside. */
	s = draw_sample("dielectric int_ior=1.5 ext_ior=1", true, (vec3){0.8, 0, -0.6}, 0.999999);
	assert_true(s.pdf == 1 && s.wi.z < 0);
	/* Brewster's angle: only half of the light, s-polarised, is reflected. */
	s = draw_sample("dielectric int_ior=1.5 ext_ior=1", true, (vec3){1.5, 0, 1}, 0);
	assert_near(s.f.v[0] * s.wi.z, 0.5 * pow((2.25 - 1) / (2.25 + 1), 2), 1e-13, "Brewster");
	/* With equal indices, light passes straight on. */
	s = draw_sample("roughdielectric int_ior=1.3 ext_ior=1.3", true, slant, 0);
	assert_near(s.pdf, 1, 1e-15, "straight on");
	assert_true(s.mode == (BSDF_TRANSMIT | BSDF_DELTA) && s.wi.x == -0.6);
}

/* The separable Smith term of GGX: D and G at one pair by hand. */
static void microfacet_value_is_that_computed_by_hand(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	const struct bsdf_point p = point_of(TRANSPORT_RADIANCE);
	const double alpha = 0.5, z = 0.6, tan2 = (1 - z * z) / (z * z);
	vec3 wo = {0.8, 0, z}, wi = {-0.8, 0, z}; /* h = n */
	bsdf_make_or_fail(&a, "roughconductor material=none alpha=0.5 distribution=ggx", &b);
	double g1 = 2 / (1 + sqrt(1 + alpha * alpha * tan2)), d = 1 / (PI * alpha * alpha);
	assert_near(b.ops->eval(&b, &p, wo, wi).v[0], d * g1 * g1 / (4 * z * z), 1e-14, "ggx");
	bsdf_make_or_fail(&a, "roughconductor material=none alpha=0.5", &b);
	double x = 1 / (alpha * sqrt(tan2));
	g1 = 2 / (1 + erf(x) + exp(-x * x) / (x * sqrt(PI)));
	assert_near(b.ops->eval(&b, &p, wo, wi).v[0], d * g1 * g1 / (4 * z * z), 1e-14, "beckmann");
	arena_fini(&a);
}

static void test_phong_is_scaled_like_mitsuba(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	const struct bsdf_point p = point_of(TRANSPORT_RADIANCE);
	const vec3 up = {0, 0, 1};
	bsdf_make_or_fail(&a, "phong exponent=2 diffuse_reflectance=0.8 specular_reflectance=0.4", &b);
	double scale = 0.99 / 1.2;
	assert_near(b.ops->eval(&b, &p, up, up).v[0], scale * (0.8 / PI + 0.4 * 4 / (2 * PI)), 1e-14, "scaled");
	bsdf_make_or_fail(&a, "phong", &b);
	assert_near(b.ops->eval(&b, &p, up, up).v[0], 0.5 / PI + 0.2 * 32 / (2 * PI), 1e-14, "defaults");
	arena_fini(&a);
}

static void flags_describe_the_bsdf(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		unsigned modes;
		double alpha, eta;
		bool smooth, delta, two_sided;
		enum color_kind shape;
	} expected[] = {
		{"diffuse", BSDF_REFLECT, INFINITY, 1, true, false, false, COLOR_KIND_CONSTANT},
		{"diffuse reflectance=rgb(0.5,0.5,0.4)", BSDF_REFLECT, INFINITY, 1, true, false, false,
		 COLOR_KIND_OTHER},
		{"conductor material=none", BSDF_REFLECT | BSDF_DELTA, 0, 1, false, true, false, COLOR_KIND_CONSTANT},
		{"conductor material=Al", BSDF_REFLECT | BSDF_DELTA, 0, 1, false, true, false, COLOR_KIND_OTHER},
		{"roughconductor eta=0.2 k=3", BSDF_REFLECT, 0.1, 1, true, false, false, COLOR_KIND_CONSTANT},
		{"roughconductor eta=0.2 k=3 alpha=0", BSDF_REFLECT, 1e-6, 1, true, false, false, COLOR_KIND_CONSTANT},
		{"dielectric int_ior=1.5 ext_ior=1.2", BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA, 0, 1.25, false, true,
		 true, COLOR_KIND_CONSTANT},
		{"dielectric int_ior=bk7 ext_ior=vacuum", BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA, 0, 1.5046, false,
		 true, true, COLOR_KIND_CONSTANT},
		{"dielectric ext_ior=1", BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA, 0, 1.5046, false, true, true,
		 COLOR_KIND_CONSTANT},
		{"roughdielectric int_ior=2 ext_ior=1 alpha=0.3", BSDF_REFLECT | BSDF_TRANSMIT, 0.3, 2, true, false,
		 true, COLOR_KIND_CONSTANT},
		{"thindielectric", BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT, 0, 1, false, true, true,
		 COLOR_KIND_CONSTANT},
		{"mask | dielectric int_ior=1.5 ext_ior=1", BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT,
		 0, 1.5, false, true, true, COLOR_KIND_CONSTANT},
		{"blendbsdf | thindielectric | roughdielectric int_ior=2 ext_ior=1 alpha=0.3",
		 BSDF_REFLECT | BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT, 0.3, 2, true, true, true,
		 COLOR_KIND_CONSTANT},
		{"phong exponent=6", BSDF_REFLECT, 0.5, 1, true, false, false, COLOR_KIND_CONSTANT},
		{"twosided | diffuse | roughconductor alpha=0.2 material=none", BSDF_REFLECT, 0.2, 1, true, false, true,
		 COLOR_KIND_CONSTANT},
		{"twosided | diffuse | conductor material=Ag", BSDF_REFLECT | BSDF_DELTA, INFINITY, 1, true, true, true,
		 COLOR_KIND_OTHER},
	};
	for (size_t k = 0; k < sizeof expected / sizeof *expected; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, expected[k].text, &b);
		bool same = b.modes == expected[k].modes && b.min_alpha == expected[k].alpha &&
			    b.eta == expected[k].eta && b.has_smooth == expected[k].smooth &&
			    b.has_delta == expected[k].delta && b.is_two_sided == expected[k].two_sided &&
			    b.color_kind == expected[k].shape && !b.is_textured;
		if (!same)
			fail_msg("%s: modes %x alpha %g eta %g shape %d", expected[k].text, b.modes, b.min_alpha, b.eta,
				 (int)b.color_kind);
		arena_fini(&a);
	}
}

static void test_grey_is_the_same_without_wavelengths(void **state)
{
	(void)state;
	const struct wavelengths grey = {.is_grey = true, .nm = {NAN, NAN, NAN, NAN}};
	const struct bsdf_point in_colour = point_of(TRANSPORT_RADIANCE),
				in_grey = {.texture_point = in_colour.texture_point, .wavelengths = &grey};
	for (int k = 0; k < BSDF_CASES; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, bsdf_cases[k], &b);
		for (uint64_t i = 0; i < 50 && b.color_kind == COLOR_KIND_CONSTANT; i++) {
			double u[4];
			struct bsdf_sample s, t;
			rng_uniform4(1, RNG_TEST, i, 0, 0, u);
			vec3 wo = uniform_direction(u[0], u[3]);
			bool ok = b.ops->sample(&b, &in_grey, wo, u, &s);
			assert_int_equal(ok, b.ops->sample(&b, &in_colour, wo, u, &t));
			for (int l = 0; ok && l < SPECTRUM_LANES; l++)
				assert_true(s.f.v[l] == t.f.v[l] && s.f.v[l] == s.f.v[0]);
		}
		arena_fini(&a);
	}
}

static void test_refusals_say_why(void **state)
{
	(void)state;
	static const struct {
		const char *text, *word;
	} bad[] = {
		{"fur", "fur"},
		{"diffuse reflectance=1.5", "reflectance"},
		{"diffuse reflectance=rgb(0.5,2,0.1)", "must be within [0, 1]"},
		{"conductor material=Unobtainium", "Unobtainium"},
		{"roughplastic alpha_u=0.1 alpha_v=0.2", "isotropic"},
		{"roughconductor alpha_u=1e-5 alpha_v=1", "apart"},
		{"dielectric int_ior=cheese", "cheese"},
		{"dielectric int_ior=-1", "outside [0.001, 1000]"},
		{"dielectric int_ior=amber dispersion=true", "amber"},
		{"dielectric int_ior=1.5 dispersion=true", "wavelength"},
		{"dielectric dispersion=true", "bk7"},
		{"dielectric int_ior=1.5 int_sellmeier=1,0.01", "int_ior"},
		{"dielectric int_cauchy_b=0.1 int_sellmeier=1,0.01", "int_cauchy_b"},
		{"dielectric ext_sellmeier=1,0.01,2", "ext_sellmeier"},
		{"dielectric int_sellmeier=1,1,1,1,1,0.01,0.01,0.01,0.01,0.01", "1 to 4"},
		{"dielectric int_sellmeier=glass", "1 to 4"},
		{"dielectric int_sellmeier=1,0.25", "500 nm"},
		{"dielectric int_sellmeier=-1,0.01", "negative"},
		{"dielectric int_sellmeier=100,0.7", "index"},
		{"roughdielectric ext_ior=1 ext_cauchy_b=-0.9", "ext_cauchy_b"},
		{"twosided", "one or two"},
		{"twosided | diffuse | diffuse | diffuse", "one or two"},
		{"twosided | dielectric", "transmits light"},
		{"twosided | hair", "transmits light"},
		{"twosided | fur", "fur"},
		{"hair sigma_a=1 eumelanin=1", "give one"},
		{"hair int_ior=1.3 ext_ior=1.3", "must differ"},
		{"mask", "exactly one"},
		{"mask | dielectric int_ior=bk7 dispersion=true", "is dispersive"},
		{"blendbsdf | diffuse", "exactly two"},
		{"blendbsdf | dielectric int_ior=1.3 | dielectric", "different index"},
		{"blendbsdf | difftrans | roughdielectric", "different index"},
		{"blendbsdf | diffuse | dielectric int_ior=bk7 dispersion=true", "is dispersive"},
		{"coating", "exactly one"},
		{"roughcoating | diffuse | phong", "exactly one"},
		{"coating | thindielectric", "transmits light"},
		{"roughcoating alpha_u=0.1 alpha_v=0.2 | diffuse", "isotropic"},
		{"coating sigma_a=-1 | diffuse", "must be within [0, 1e+09]"},
		{"mixturebsdf weights=1", "needs BSDFs"},
		{"mixturebsdf | diffuse", "needs 1 weight,"},
		{"mixturebsdf weights=0.5 | diffuse | phong", "needs 2 weights"},
		{"mixturebsdf weights=0.5,-1 | diffuse | phong", "within"},
		{"mixturebsdf weights=0.5,nan | diffuse | phong", "2 weights"},
		{"mixturebsdf weights=0.5,0.5,0.1 | diffuse | phong", "2 weights"},
		{"mixturebsdf weights=0,0 | diffuse | phong", "all are 0"},
		{"bumpmap | diffuse", "needs a texture"},
		{"bumpmap | texture checkerboard", "exactly one BSDF"},
		{"normalmap | diffuse | phong | texture checkerboard", "exactly one BSDF"},
		{"normalmap | diffuse | texture scale", "needs a texture inside"},
	};
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
		struct arena a = {0};
		struct bsdf b;
		struct error e = {{0}};
		if (bsdf_try(&a, bad[k].text, true, &b, &e) >= 0 || !strstr(e.text, bad[k].word))
			fail_msg("%s: \"%s\" does not say \"%s\"", bad[k].text, e.text, bad[k].word);
		arena_fini(&a);
	}
}

/* A texture with the same value everywhere is equivalent to the number; a varying one to the number at each point. */
static void textured_roughness_equals_its_number(void **state)
{
	(void)state;
	static const char *const same[][2] = {
		{"roughconductor material=Au alpha=0.3",
		 "roughconductor material=Au | @alpha checkerboard color0=0.3 color1=0.3"},
		{"roughdiffuse reflectance=0.9 alpha=0.4",
		 "roughdiffuse reflectance=0.9 | @alpha checkerboard color0=0.4 color1=0.9"},
		{"roughdielectric alpha_u=0.2 alpha_v=0.4",
		 "roughdielectric alpha_u=0.2 | @alpha_v checkerboard color0=0.4 color1=0.9"},
	};
	const vec3 wo = vec3_normalize((vec3){0.3, 0.2, 0.8}), wi = vec3_normalize((vec3){-0.1, -0.3, 0.7});
	for (size_t k = 0; k < sizeof same / sizeof *same; k++) {
		struct arena a = {0};
		struct bsdf number, map;
		bsdf_make_or_fail(&a, same[k][0], &number);
		bsdf_make_or_fail(&a, same[k][1], &map);
		struct bsdf_point p = point_of(TRANSPORT_RADIANCE);
		p.texture_point.u = 0.75;
		p.texture_point.v = 0.25;
		assert_true(map.is_textured && !number.is_textured);
		assert_near(map.ops->eval(&map, &p, wo, wi).v[0], number.ops->eval(&number, &p, wo, wi).v[0], 1e-12,
			    same[k][0]);
		assert_near(map.ops->pdf_solid(&map, &p, wo, wi), number.ops->pdf_solid(&number, &p, wo, wi), 1e-12,
			    same[k][0]);
		if (k == 2) {
			p.texture_point.u = 0.25;
			assert_true(
				fabs(map.ops->pdf_solid(&map, &p, wo, wi) / number.ops->pdf_solid(&number, &p, wo, wi) -
				     1) > 0.1);
		}
		arena_fini(&a);
	}
}

static void lack_of_memory_is_reported(void **state)
{
	(void)state;
	struct arena nodes = {0};
	const struct asset_source assets = memory_assets(measured_file_all());
	for (int k = 0; k < BSDF_CASES; k++) {
		const struct scene_node *n = node_make_bsdf(&nodes, bsdf_cases[k]);
		int code = -ENOMEM;
		for (size_t limit = 1; code; limit += 64 + limit / 64) {
			struct arena a = {.limit = limit};
			const struct bsdf_build build = {.arena = &a, .is_dialect_3 = true, .assets = &assets};
			struct bsdf b;
			struct error e;
			code = bsdf_create(&b, n, &build, &e);
			assert_true(code == 0 || code == -ENOMEM);
			arena_fini(&a);
		}
	}
	arena_fini(&nodes);
}

static void black_bsdf_and_default_bsdf_are_as_documented(void **state)
{
	(void)state;
	const struct bsdf_point p = point_of(TRANSPORT_RADIANCE);
	const vec3 up = {0, 0, 1};
	struct bsdf b;
	struct bsdf_sample s;
	bsdf_make_black(&b);
	assert_true(spectrum_is_zero(b.ops->eval(&b, &p, up, up)) && b.ops->pdf_solid(&b, &p, up, up) == 0);
	assert_false(b.ops->sample(&b, &p, up, (double[]){0.1, 0.2, 0.3}, &s));
	assert_true(!b.has_smooth && !b.has_delta && b.modes == 0);
	bsdf_make_default(&b);
	assert_near(b.ops->eval(&b, &p, up, up).v[0], 0.5 / PI, 1e-15, "default");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bsdfs_are_reciprocal),
		cmocka_unit_test(bsdfs_without_tangents_ignore_rotation),
		cmocka_unit_test(test_no_energy_is_gained),
		cmocka_unit_test(test_smooth_boundaries_lose_nothing),
		cmocka_unit_test(white_materials_lose_only_masked_light),
		cmocka_unit_test(values_have_their_closed_forms),
		cmocka_unit_test(microfacet_value_is_that_computed_by_hand),
		cmocka_unit_test(test_phong_is_scaled_like_mitsuba),
		cmocka_unit_test(flags_describe_the_bsdf),
		cmocka_unit_test(test_grey_is_the_same_without_wavelengths),
		cmocka_unit_test(test_refusals_say_why),
		cmocka_unit_test(textured_roughness_equals_its_number),
		cmocka_unit_test(lack_of_memory_is_reported),
		cmocka_unit_test(black_bsdf_and_default_bsdf_are_as_documented),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
