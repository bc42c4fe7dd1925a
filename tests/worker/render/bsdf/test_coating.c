/* SPDX-License-Identifier: Apache-2.0 */
/*
 * plastic, roughplastic, coating, roughcoating and thindielectric. Light that enters and leaves the layer is followed
 * bounce by bounce and compared with the closed forms: energy over a white base, absorption by Beer's law, total
 * internal reflection, rough layers in the limit of smooth ones, layers without a boundary, two-sided layers, and
 * textured ones.
 */
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/microfacet.h"
#include "worker/render/bsdf/rough_boundary.h"

#include <math.h>

#define PI 3.14159265358979323846

static const struct wavelengths wavelengths = {.nm = {400, 500, 600, 700}};
static const struct bsdf_point point = {
	.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = &wavelengths, .transport = TRANSPORT_RADIANCE};

static vec3 direction_at_cosine(double z)
{
	return (vec3){sqrt((1 - z) * (1 + z)), 0, z};
}

/* Returns the share of light from wo that is reflected: the specular lobe, plus the other lobes integrated by the
 * midpoint rule over cosine^2 and azimuth. */
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

/* Over a base that absorbs nothing, a smooth coating reflects all light. */
static void test_nothing_is_lost_under_a_smooth_coating(void **state)
{
	(void)state;
	static const char *const cases[] = {"plastic diffuse_reflectance=1",
					    "plastic diffuse_reflectance=1 nonlinear=true int_ior=2.4",
					    "plastic diffuse_reflectance=1 int_ior=1.2 ext_ior=1"};
	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, cases[k], &b);
		for (double z = 0.1; z < 1; z += 0.2)
			if (fabs(albedo(&b, direction_at_cosine(z)) - 1) > 1e-3)
				fail_msg("%s: gives back %g of light from z = %g", cases[k],
					 albedo(&b, direction_at_cosine(z)), z);
		arena_fini(&a);
	}
}

/* Light that stays inside meets a base of reflectance 0.5 repeatedly: if linear, the base reflects all of it from the
 * second time on; if nonlinear, half of it each time. */
static void test_nonlinear_loses_light_at_each_bounce(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf linear, nonlinear;
	bsdf_make_or_fail(&a, "plastic diffuse_reflectance=0.5 int_ior=1.7 ext_ior=1", &linear);
	bsdf_make_or_fail(&a, "plastic diffuse_reflectance=0.5 int_ior=1.7 ext_ior=1 nonlinear=true", &nonlinear);
	vec3 straight = {0, 0, 1};
	double t = fresnel_dielectric(1, 1.7).transmittance,
	       once = linear.ops->eval(&linear, &point, straight, straight).v[0];
	double out = 0.5 * t * t / PI / once / (1.7 * 1.7); /* the share of diffuse light that leaves at each bounce */
	double series = 0.5 * out / (1 - 0.5 * (1 - out));  /* 0.5 out + 0.5 (1 - out) 0.5 out + ... */
	double want = once * series / 0.5;
	assert_true(out > 0.2 && out < 0.5);
	assert_true(fabs(nonlinear.ops->eval(&nonlinear, &point, straight, straight).v[0] / want - 1) < 1e-6);
	arena_fini(&a);
}

/* The share of diffuse light from inside that leaves agrees with Fresnel's factors inside, including total
 * reflection. */
static void diffuse_light_escapes_as_fresnel_says(void **state)
{
	(void)state;
	enum { STEPS = 1 << 20 };
	struct arena a = {0};
	struct bsdf b;
	bsdf_make_or_fail(&a, "plastic diffuse_reflectance=1 int_ior=1.7 ext_ior=1", &b);
	double out = 0, t = fresnel_dielectric(1, 1.7).transmittance;
	for (int i = 0; i < STEPS; i++)
		out += fresnel_dielectric(sqrt((i + 0.5) / STEPS), 1 / 1.7).transmittance / STEPS;
	vec3 straight = {0, 0, 1};
	double f = b.ops->eval(&b, &point, straight, straight).v[0];
	assert_true(fabs(f * PI * 1.7 * 1.7 * out / (t * t) - 1) < 1e-5);
	arena_fini(&a);
}

/* A rough coating reflects all light that it lets in, too, and converges to the smooth one. */
static void rough_coating_converges_to_the_smooth_one(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf rough, smooth;
	bsdf_make_or_fail(&a, "roughplastic alpha=0.1 diffuse_reflectance=1", &rough);
	for (double z = 0.3; z < 1; z += 0.2) {
		double all = albedo(&rough, direction_at_cosine(z));
		if (all > 1.005 || all < 0.97)
			fail_msg("roughplastic gives back %g of light from z = %g", all, z);
	}
	bsdf_make_or_fail(&a, "roughplastic alpha=0.001 diffuse_reflectance=rgb(0.6,0.3,0.9) nonlinear=true", &rough);
	bsdf_make_or_fail(&a, "plastic diffuse_reflectance=rgb(0.6,0.3,0.9) nonlinear=true", &smooth);
	vec3 wo = direction_at_cosine(0.8), wi = {-0.3, 0.5, sqrt(1 - 0.09 - 0.25)}; /* far from the mirror direction */
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
	bsdf_make_or_fail(&a, "roughplastic alpha=0.3 diffuse_reflectance=0 int_ior=1.7 ext_ior=1.1 distribution=ggx",
			  &plastic);
	bsdf_make_or_fail(&a, "roughdielectric alpha=0.3 int_ior=1.7 ext_ior=1.1 distribution=ggx", &glass);
	for (double z = 0.05; z < 1; z += 0.1) {
		vec3 wo = direction_at_cosine(z), wi = {-0.2, 0.4, sqrt(0.8)};
		double p = plastic.ops->eval(&plastic, &point, wo, wi).v[1],
		       g = glass.ops->eval(&glass, &point, wo, wi).v[1];
		assert_true(fabs(p / g - 1) < 1e-12);
	}
	arena_fini(&a);
}

/* Sums the reflections between the two sides of a sheet term by term. */
static void thin_sheet_sums_its_reflections(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	bsdf_make_or_fail(&a, "thindielectric int_ior=1.8 ext_ior=1", &b);
	for (double z = 0.02; z < 1; z += 0.07) {
		struct fresnel f = fresnel_dielectric(z, 1.8);
		double back = f.reflectance, through = 0, inside = f.transmittance;
		for (int i = 0; i < 2000; i++) {
			*(i % 2 ? &back : &through) += inside * f.transmittance;
			inside *= f.reflectance;
		}
		vec3 wi, wo = vec3_neg(direction_at_cosine(z));
		double chance;
		assert_true(fabs(bsdf_eval_delta(&b, &point, wo, BSDF_REFLECT, &wi, &chance).v[0] - back) < 1e-12);
		assert_true(fabs(bsdf_eval_delta(&b, &point, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, &wi, &chance).v[0] -
				 through) < 1e-12);
		assert_true(wi.x == -wo.x && wi.y == -wo.y && wi.z == -wo.z);
	}
	arena_fini(&a);
}

/* A layer with the index of its surroundings has no effect; an absorbing one follows Beer's law. */
static void layer_of_equal_index_only_absorbs(void **state)
{
	(void)state;
	static const char *const bare[] = {"roughconductor alpha=0.3 material=Au", "phong", "plastic"};
	const vec3 wo = direction_at_cosine(0.8), wi = {-0.2, 0.4, sqrt(0.8)};
	for (size_t k = 0; k < sizeof bare / sizeof *bare; k++) {
		struct arena a = {0};
		struct bsdf inner, coat, dark;
		char text[128];
		bsdf_make_or_fail(&a, bare[k], &inner);
		snprintf(text, sizeof text, "coating int_ior=1.3 ext_ior=1.3 | %s", bare[k]);
		bsdf_make_or_fail(&a, text, &coat);
		snprintf(text, sizeof text, "coating int_ior=1.3 ext_ior=1.3 sigma_a=0.2 thickness=3 | %s", bare[k]);
		bsdf_make_or_fail(&a, text, &dark);
		double f = inner.ops->eval(&inner, &point, wo, wi).v[1], beer = exp(-0.6 * (1 / wo.z + 1 / wi.z));
		assert_true(fabs(coat.ops->eval(&coat, &point, wo, wi).v[1] / f - 1) < 1e-13);
		assert_true(fabs(dark.ops->eval(&dark, &point, wo, wi).v[1] / (beer * f) - 1) < 1e-6);
		assert_true(
			fabs(coat.ops->pdf_solid(&coat, &point, wo, wi) / inner.ops->pdf_solid(&inner, &point, wo, wi) -
			     1) < 1e-13);
		arena_fini(&a);
	}
}

/* One bounce off a diffuse base, with the refraction computed here; and the specular reflections of layer and metal,
 * which are one lobe. */
static void layer_refracts_light_in_and_out(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf coat, metal, coated;
	const double eta = 1.6;
	bsdf_make_or_fail(&a, "coating int_ior=1.6 ext_ior=1 | diffuse reflectance=0.7", &coat);
	bsdf_make_or_fail(&a, "conductor material=Al", &metal);
	bsdf_make_or_fail(&a,
			  "coating int_ior=1.6 ext_ior=1 specular_reflectance=0.5 sigma_a=0.1 | conductor material=Al",
			  &coated);
	for (double z = 0.1; z < 1; z += 0.2) {
		vec3 wo = direction_at_cosine(z), wi = {-0.3, 0.5, sqrt(1 - 0.09 - 0.25)}, out;
		double to = fresnel_dielectric(z, eta).transmittance, ti = fresnel_dielectric(wi.z, eta).transmittance,
		       one;
		double want = to * ti / (eta * eta) * 0.7 / PI;
		assert_true(fabs(coat.ops->eval(&coat, &point, wo, wi).v[0] / want - 1) < 1e-12);
		double inside = sqrt(1 - (1 - z * z) / (eta * eta));
		double mirror =
			bsdf_eval_delta(&metal, &point, direction_at_cosine(inside), BSDF_REFLECT, &out, &one).v[0];
		want = 0.5 * (1 - to) + to * to * mirror * exp(-0.1 * 2 / inside);
		double got = bsdf_eval_delta(&coated, &point, wo, BSDF_REFLECT, &out, &one).v[0];
		if (fabs(got / want - 1) > 1e-6 || fabs(out.x + wo.x) > 0 || fabs(one - 1) > 1e-12)
			fail_msg("from z = %g: %.12g is not %.12g, chance %g", z, got, want, one);
	}
	arena_fini(&a);
}

/* Where a textured roughness has some value, the BSDF is that with this value as a number; here, one at the end of the
 * table. */
static void textured_roughness_equals_its_number(void **state)
{
	(void)state;
	static const char *const kind[] = {"roughplastic diffuse_reflectance=0.9 int_ior=1.8 | ",
					   "roughcoating int_ior=1.8 | diffuse reflectance=0.9 | "};
	static const double rough[] = {0.05, 0.6};
	const vec3 wo = direction_at_cosine(0.3), wi = {-0.3, 0.5, sqrt(1 - 0.09 - 0.25)};
	for (int k = 0; k < 2; k++)
		for (int place = 0; place < 2; place++) {
			struct arena a = {0};
			struct bsdf map, number;
			struct bsdf_point p = point;
			char text[192];
			snprintf(text, sizeof text, "%s@alpha checkerboard color0=0.6 color1=0.05", kind[k]);
			bsdf_make_or_fail(&a, text, &map);
			snprintf(text, sizeof text, "%s@alpha checkerboard color0=%g color1=%g", kind[k], rough[place],
				 rough[place]);
			bsdf_make_or_fail(&a, text, &number);
			p.texture_point.u =
				place ? 0.75
				      : 0.25; /* for numbers in 3.x, color0 where u and v are in different halves */
			p.texture_point.v = 0.25;
			assert_true(map.is_textured && map.min_alpha == 0.05);
			double m = map.ops->eval(&map, &p, wo, wi).v[0], n = number.ops->eval(&number, &p, wo, wi).v[0];
			if (fabs(m / n - 1) > 1e-9)
				fail_msg("%s at %d: %.12g is not %.12g", kind[k], place, m, n);
			arena_fini(&a);
		}
}

/* A layer over a two-sided BSDF is two-sided. */
static void layer_over_a_two_sided_bsdf_is_two_sided(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	struct error e;
	struct scene_node *n = node_make(&a, PLUGIN_BSDF, "roughcoating alpha=0.2"),
			  *both = node_make(&a, PLUGIN_BSDF, "twosided");
	const struct bsdf_build build = {.arena = &a, .is_dialect_3 = true};
	node_add_child(&a, both, node_make(&a, PLUGIN_BSDF, "plastic"));
	node_add_child(&a, n, both);
	assert_int_equal(bsdf_create(&b, n, &build, &e), 0);
	const vec3 wo = direction_at_cosine(0.6), wi = {-0.3, 0.5, sqrt(1 - 0.09 - 0.25)};
	const vec3 under_o = {wo.x, wo.y, -wo.z}, under_i = {wi.x, wi.y, -wi.z};
	assert_true(b.is_two_sided && b.ops->eval(&b, &point, wo, wi).v[0] > 0);
	assert_true(fabs(b.ops->eval(&b, &point, under_o, under_i).v[0] / b.ops->eval(&b, &point, wo, wi).v[0] - 1) <
		    1e-13);
	assert_true(b.ops->eval(&b, &point, wo, under_i).v[0] == 0);
	for (int i = 0; i < 100; i++) {
		struct bsdf_sample s;
		const double u[3] = {(i + 0.5) / 100, fmod(i * 0.618, 1), fmod(i * 0.414, 1)};
		if (b.ops->sample(&b, &point, under_o, u, &s))
			assert_true(s.wi.z < 0 &&
				    ((s.mode & BSDF_DELTA) || s.pdf == b.ops->pdf_solid(&b, &point, under_o, s.wi)));
	}
	arena_fini(&a);
}

/* Boundaries of a scene share a table if and only if they are equal. */
static void test_equal_boundaries_share_a_table(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double eta;
		int same_as; /* index of an earlier case; -1: none */
	} all[] = {
		{"roughplastic alpha=0.2", 1.5, -1},
		{"roughplastic alpha=0.2 diffuse_reflectance=0.1", 1.5, 0},
		{"roughplastic alpha=0.2", 1.6, -1},
		{"roughplastic alpha=0.3", 1.5, -1},
		{"roughplastic alpha=0.2 distribution=ggx", 1.5, -1},
		{"roughplastic | @alpha checkerboard color0=0.2 color1=0.3", 1.5, -1},
		{"roughplastic | @alpha checkerboard color0=0.2 color1=0.4", 1.5, -1},
		{"roughplastic | @alpha checkerboard color0=0.3 color1=0.2", 1.5, 5},
		{"roughplastic | @alpha checkerboard color0=0.2 color1=0.2", 1.5, 0},
		{"roughplastic alpha=0.3", 1.5, 3},
	};
	enum { COUNT = sizeof all / sizeof *all };
	struct arena a = {0};
	struct boundary_table *boundaries = NULL;
	const struct bsdf_build build = {.arena = &a, .is_dialect_3 = true, .boundary_tables = &boundaries},
				alone = {.arena = &a, .is_dialect_3 = true};
	struct rough_boundary r[COUNT], own;
	for (int i = 0; i < COUNT; i++) {
		struct bsdf b = {.min_alpha = INFINITY};
		struct error e;
		struct scene_node *n = node_make_bsdf(&a, all[i].text);
		assert_int_equal(rough_boundary_read(&r[i], all[i].eta, &b, n, &build, &e), 0);
		assert_int_equal(rough_boundary_read(&own, all[i].eta, &b, n, &alone, &e), 0);
		for (int k = 0; k < i; k++)
			if ((r[k].table == r[i].table) !=
			    (k == all[i].same_as || (all[i].same_as >= 0 && all[k].same_as == all[i].same_as)))
				fail_msg("%s and %s", all[k].text, all[i].text);
		assert_true(own.table != r[i].table && own.table->row_count == r[i].table->row_count);
		assert_memory_equal(own.table->row, r[i].table->row,
				    (size_t)own.table->row_count * sizeof *own.table->row);
	}
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_nothing_is_lost_under_a_smooth_coating),
		cmocka_unit_test(test_nonlinear_loses_light_at_each_bounce),
		cmocka_unit_test(diffuse_light_escapes_as_fresnel_says),
		cmocka_unit_test(rough_coating_converges_to_the_smooth_one),
		cmocka_unit_test(test_the_coating_is_a_dielectric),
		cmocka_unit_test(thin_sheet_sums_its_reflections),
		cmocka_unit_test(layer_of_equal_index_only_absorbs),
		cmocka_unit_test(layer_refracts_light_in_and_out),
		cmocka_unit_test(textured_roughness_equals_its_number),
		cmocka_unit_test(layer_over_a_two_sided_bsdf_is_two_sided),
		cmocka_unit_test(test_equal_boundaries_share_a_table),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
