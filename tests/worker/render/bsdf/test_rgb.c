/* SPDX-License-Identifier: Apache-2.0 */
/* Parameters that are not given per channel, where paths carry R, G and B: the indices of metals, and tints. */
#include "tests/support/memory_assets.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/texture/color.h"

#include <math.h>

static const struct wavelengths rgb_lanes = {.is_rgb = true};
static const struct bsdf_point point = {.wavelengths = &rgb_lanes, .transport = TRANSPORT_RADIANCE};

/* n and k of silver, as others computed them by Mitsuba's rules from its tables. */
static void silver_has_its_rgb_indices(void **state)
{
	(void)state;
	static const double eta[3] = {0.155276, 0.116728, 0.138388}, k[3] = {4.828354, 3.122222, 2.146901};
	struct arena a = {0};
	struct bsdf b;
	bsdf_make_or_fail(&a, "conductor material=Ag", &b);
	for (int step = 1; step <= 10; step++) {
		double z = step / 10.0, chance;
		const vec3 wo = {sqrt((1 - z) * (1 + z)), 0, z};
		vec3 wi;
		spectrum f = bsdf_eval_delta(&b, &point, wo, BSDF_REFLECT, &wi, &chance);
		for (int c = 0; c < 3; c++) {
			double want = fresnel_conductor(z, eta[c], k[c]);
			if (!(fabs(f.v[c] - want) < 2e-4))
				fail_msg("channel %d at cosine %g: %.7f, expected %.7f", c, z, f.v[c], want);
		}
		assert_true(f.v[3] == f.v[1]);
	}
	arena_fini(&a);
}

/* Tables with the same wavelengths are looked up together if lanes are wavelengths. */
static void table_pair_reads_like_two_tables(void **state)
{
	(void)state;
	static const double nm[] = {400, 500, 600, 700}, n[] = {1, 0.5, 0.3, 0.2}, k[] = {2, 3, 4, 5};
	struct color a = color_from_samples(4, nm, n, false, false), b = color_from_samples(4, nm, k, false, false);
	spectrum both[2], sa = color_eval(&a, &rgb_lanes), sb = color_eval(&b, &rgb_lanes);
	color_eval_pair(&a, &b, &rgb_lanes, both);
	assert_memory_equal(&both[0], &sa, sizeof sa);
	assert_memory_equal(&both[1], &sb, sizeof sb);
}

/* Indices that vary over the surface: from a pattern, with values above 1, and from an image, whose values are limited
 * to 1. A textured index is relative to the outside like a constant one. */
static void textured_indices_are_read_at_each_point(void **state)
{
	(void)state;
	static const unsigned char pink[] = "P6 1 1 255\n\xff\0\xff";
	const struct memory_file files[] = {{"pink.ppm", (const char *)pink, sizeof pink - 1}, {0}};
	const struct asset_source assets = memory_assets(files);
	static const struct {
		const char *text;
		double u, eta[3], k[3];
	} cases[] = {
		{"conductor ext_eta=1.25 k=3 | @eta checkerboard color0=2 color1=rgb(0.5,1,1.5)",
		 0.3,
		 {1.6, 1.6, 1.6},
		 {2.4, 2.4, 2.4}},
		{"conductor ext_eta=1.25 k=3 | @eta checkerboard color0=2 color1=rgb(0.5,1,1.5)",
		 0.8,
		 {0.4, 0.8, 1.2},
		 {2.4, 2.4, 2.4}},
		{"conductor ext_eta=1.25 eta=2 k=3", 0.3, {1.6, 1.6, 1.6}, {2.4, 2.4, 2.4}},
		{"conductor eta=0.25 | @k checkerboard color0=3 color1=6", 0.8, {0.25, 0.25, 0.25}, {6, 6, 6}},
		{"conductor k=2 | @eta bitmap filename=pink.ppm", 0.3, {1, 0, 1}, {2, 2, 2}},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct arena a = {0};
		const struct bsdf_build build = {.arena = &a, .is_dialect_3 = true, .assets = &assets};
		struct bsdf_point at = point;
		struct bsdf b;
		struct error e;
		if (bsdf_create(&b, node_make_bsdf(&a, cases[i].text), &build, &e))
			fail_msg("%s: %s", cases[i].text, e.text);
		assert_true(b.is_textured == (strchr(cases[i].text, '@') != NULL));
		at.texture_point.u = cases[i].u;
		at.texture_point.v = 0.3;
		vec3 wi;
		double chance;
		spectrum f = bsdf_eval_delta(&b, &at, (vec3){0.6, 0, 0.8}, BSDF_REFLECT, &wi, &chance);
		for (int c = 0; c < 3; c++) {
			double want = fresnel_conductor(0.8, cases[i].eta[c], cases[i].k[c]);
			if (!(fabs(f.v[c] - want) < 1e-6))
				fail_msg("row %zu, channel %d: %.9f, expected %.9f", i, c, f.v[c], want);
		}
		arena_fini(&a);
	}
}

/* A tint is the base colour over its luminance, here 0.39186. It scales the reflectance of 0.04 of an index of 1.5, and
 * a quarter of it scales the 0.16 of an index of 7/3. */
static void tint_is_base_colour_over_luminance(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf tinted, coloured;
	bsdf_make_or_fail(&a, "principled base_color=rgb(0.8,0.3,0.1) roughness=0.4 eta=1.5 spec_tint=1", &tinted);
	bsdf_make_or_fail(&a,
			  "principled base_color=rgb(0.8,0.3,0.1) roughness=0.4 eta=2.3333333333333335 "
			  "specular_color=rgb(0.5103864,0.1913949,0.0637983)",
			  &coloured);
	const vec3 wo = {0.28, 0, 0.96}, wi = {-0.6, 0, 0.8};
	spectrum f = tinted.ops->eval(&tinted, &point, wo, wi), g = coloured.ops->eval(&coloured, &point, wo, wi);
	for (int c = 0; c < SPECTRUM_LANES; c++)
		if (!(fabs(f.v[c] / g.v[c] - 1) < 1e-6))
			fail_msg("lane %d: %.9g, expected %.9g", c, f.v[c], g.v[c]);
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(silver_has_its_rgb_indices),
					   cmocka_unit_test(table_pair_reads_like_two_tables),
					   cmocka_unit_test(tint_is_base_colour_over_luminance),
					   cmocka_unit_test(textured_indices_are_read_at_each_point)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
