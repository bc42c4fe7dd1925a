/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The transmittance of a medium: the Beer-Lambert law as the limit of many thin layers, its values at the ends of all
 * ranges, and units of length. Both ways of giving coefficients, and the coefficients that remain if an effect is
 * switched off. Media of shapes are numbered individually, shared ones once.
 */
#include "worker/render/medium/medium.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const vec3 any_point = {0, 0, 0}; /* any point */
static const vec3 along_z = {0, 0, 1};

static spectrum spectral_transmittance(const struct medium *m, double distance, const struct wavelengths *w)
{
	const struct medium_lanes lanes = medium_lanes_along(m, along_z, w);
	return spectrum_transmittance(
		medium_optical_depth(&lanes, &(struct grid_ray){any_point, along_z, 0, distance}));
}

static double transmittance_through(double sigma, double per_length, double distance)
{
	const struct medium m = {.first.color = color_constant(sigma),
				 .second.color = color_constant(0),
				 .is_absorbing = true,
				 .per_length = per_length,
				 .phase.ops = phase_registry[0]};
	const struct wavelengths w = wavelengths_sample(0.3);
	spectrum t = spectral_transmittance(&m, distance, &w);
	for (int i = 1; i < SPECTRUM_LANES; i++)
		assert_true(t.v[i] == t.v[0]);
	return t.v[0];
}

/* (1 - sigma d / n)^n = exp(-sigma d) (1 - (sigma d)^2 / 2n + ...). */
static void test_transmittance_is_the_limit_of_layers(void **state)
{
	(void)state;
	enum { LAYERS = 1 << 20 };
	for (double depth = 0.01; depth < 5; depth *= 1.7) {
		double left = 1;
		for (int i = 0; i < LAYERS; i++)
			left *= 1 - depth / LAYERS;
		double found = transmittance_through(0.25, 2, 2 * depth), bound = depth * depth / LAYERS + 1e-9;
		assert_true(fabs(left / found - 1) < bound);
	}
}

static void test_extreme_transmittances_are_exact(void **state)
{
	(void)state;
	assert_true(transmittance_through(0, 1, INFINITY) == 1);
	assert_true(transmittance_through(1, 0, INFINITY) == 1);
	assert_true(transmittance_through(1e-200, 1e-200, INFINITY) == 1); /* their product is 0 */
	assert_true(transmittance_through(1e-200, 1, INFINITY) == 0);
	assert_true(transmittance_through(1, 1, 0) == 1);
	assert_true(transmittance_through(1e30, 1e30, 1e30) == 0);
}

/* Coefficients that depend on the wavelength, some of them 0, given in both ways. */
static const struct wavelengths four_wavelengths = {.nm = {450, 500, 550, 600}};
static const double nm[] = {450, 500, 550, 600};
static const double sigma_a[] = {0.5, 0, 1, 0}, sigma_s[] = {1.5, 0.25, 3, 0};
static const double sigma_t[] = {2, 0.25, 4, 0}, albedo[] = {0.75, 1, 0.75, 0.5};

static struct medium coloured_medium(bool by_albedo)
{
	return (struct medium){.first.color = color_from_samples(4, nm, by_albedo ? sigma_t : sigma_a, false, false),
			       .second.color = color_from_samples(4, nm, by_albedo ? albedo : sigma_s, false, false),
			       .uses_albedo = by_albedo,
			       .is_absorbing = true,
			       .is_scattering = true,
			       .per_length = 2,
			       .phase.ops = phase_registry[0]};
}

static void test_coefficients_agree_with_albedo(void **state)
{
	(void)state;
	for (int by_albedo = 0; by_albedo <= 1; by_albedo++) {
		struct medium m = coloured_medium(by_albedo);
		spectrum s = medium_scattering(&m, any_point, along_z, &four_wavelengths),
			 left = spectral_transmittance(&m, 0.3, &four_wavelengths);
		for (int i = 0; i < SPECTRUM_LANES; i++) {
			assert_true(fabs(s.v[i] - 2 * sigma_s[i]) < 1e-12);
			assert_true(fabs(left.v[i] - exp(-0.6 * sigma_t[i])) < 1e-12);
		}
		m.is_absorbing = false;
		left = spectral_transmittance(&m, 0.3, &four_wavelengths);
		for (int i = 0; i < SPECTRUM_LANES; i++)
			assert_true(fabs(left.v[i] - exp(-0.6 * sigma_s[i])) < 1e-12);
		m.is_absorbing = true;
		m.is_scattering = false;
		assert_true(spectrum_is_zero(medium_scattering(&m, any_point, along_z, &four_wavelengths)));
		left = spectral_transmittance(&m, 0.3, &four_wavelengths);
		for (int i = 0; i < SPECTRUM_LANES; i++)
			assert_true(fabs(left.v[i] - exp(-0.6 * sigma_a[i])) < 1e-12);
	}
}

/* Makes a world with the given description of a medium in a file of 0.6 or 3.x, or checks that it is refused with the
 * given text. */
static struct world *world_with(const char *version, const char *inner)
{
	static char xml[1 << 11];
	snprintf(xml, sizeof xml,
		 "<scene version='%s'>" SENSOR(
			 "0,0,9", "0,0,0") "<emitter type='constant'/><shape type='sphere'>"
					   "<medium type='homogeneous' name='interior'>%s</medium></shape></scene>",
		 version, inner);
	const struct memory_file files[] = {{"test.xml", xml, strlen(xml)}, {NULL, NULL, 0}};
	return world_from_files(8, 8, files);
}

static void check_rgb(const char *version, const char *inner, double red_s, double red_t)
{
	struct world *w = world_with(version, inner);
	const struct wavelengths rgb = {.is_rgb = true};
	double s = medium_scattering(&w->media[0], any_point, along_z, &rgb).v[0] * w->scale,
	       t = medium_extinction(&w->media[0], any_point, along_z, &rgb).v[0] * w->scale;
	if (fabs(s - red_s) > 1e-9 || fabs(t - red_t) > 1e-9)
		fail_msg("%s: sigma_s %g and sigma_t %g, not %g and %g", inner, s, t, red_s, red_t);
	world_free(w);
}

/* The defaults of both dialects, and the names of materials in 0.6. */
static void test_descriptions_follow_the_dialect(void **state)
{
	(void)state;
	check_rgb("3.0.0", "", 0.75, 1);
	check_rgb("0.6.0", "", 74, 74 + 3.2);
	check_rgb("0.6.0", "<string name='material' value='Ketchup'/><float name='scale' value='10'/>", 180, 241);
	check_rgb("0.6.0", "<string name='material' value='Chicken1'/>", 15, 15.15);
	/* The mean cosine of 0.6 reduces scattering, whether the file or the material gives it. */
	check_rgb("0.6.0", "<string name='material' value='Regular Milk'/>", 455.13, 455.13 + 0.153);
	check_rgb("0.6.0", "<string name='material' value='Regular Milk'/><float name='g' value='0.5'/>", 910.26,
		  910.26 + 0.153);
	check_rgb("0.6.0",
		  "<rgb name='sigmaS' value='1,2,3'/><rgb name='sigmaA' value='3,2,1'/><float name='g' value='0.75'/>",
		  0.25, 3.25);
	check_rgb("0.6.0",
		  "<rgb name='sigmaT' value='4,2,1'/><float name='albedo' value='0.5'/><float name='g' value='-1e-1'/>",
		  2.2, 4.2);
	/* Coefficients that a file of 0.6 omits are those of skin1. */
	check_rgb("0.6.0", "<rgb name='sigmaA' value='3,2,1'/>", 74, 77);
	check_rgb("0.6.0", "<rgb name='sigmaS' value='3,2,1'/><float name='scale' value='2'/>", 6, 12.4);
	check_rgb("0.6.0", "<rgb name='sigmaT' value='4,2,1'/>", 4 * 74 / 77.2, 4);
	check_rgb("0.6.0", "<float name='albedo' value='0.5'/>", 38.6, 77.2);
	check_rgb("0.6.0", "<rgb name='sigmaS' value='1,2,3'/><rgb name='sigmaA' value='3,2,1'/>", 1, 4);
	check_rgb("3.0.0", "<rgb name='sigma_t' value='4,2,1'/><rgb name='albedo' value='0.5,0.1,0'/>", 2, 4);
	check_rgb("3.0.0", "<rgb name='sigma_t' value='4,2,1'/>", 3, 4);
	check_rgb("3.0.0", "<float name='sigma_s' value='2'/>", 2, 2);
#define INSIDE(inner) "<shape type='sphere'><medium type='homogeneous' name='interior'>" inner "</medium></shape>"
	world_check_refused(INSIDE("<string name='material' value='tea'/>"),
			    "there is no material 'tea' (supported: apple, chicken1, ");
	world_check_refused(INSIDE("<float name='sigma_a' value='2'/><float name='g' value='0.5'/>"),
			    "g is a parameter of the phase function in 3.x");
	world_check_refused(INSIDE("<float name='sigma_a' value='2'/><float name='albedo' value='0.5'/>"),
			    "either sigma_a and sigma_s, or sigma_t and albedo, or a material of 0.6");
	world_check_refused(INSIDE("<float name='sigma_t' value='2'/><string name='material' value='apple'/>"),
			    "either sigma_a and sigma_s, or sigma_t and albedo, or a material of 0.6");
}

#define AMBER(attribute)     \
	"<medium " attribute \
	" type='homogeneous'><float name='sigma_s' value='0'/><float name='sigma_a' value='1'/></medium>"

/* Every third shape has a medium of its own inside, every third the shared one outside. */
static void test_shapes_share_media(void **state)
{
	(void)state;
	enum { SHAPES = 300, ROOM = 320 };
	char *text = malloc(SHAPES * ROOM), *at = text;
	assert_non_null(text);
	for (int i = 0; i < SHAPES; i++)
		at += snprintf(at, ROOM, "<shape type='sphere'><point name='center' x='%d' y='0' z='0'/>%s</shape>",
			       3 * i,
			       i % 3 == 0   ? AMBER("name='interior'")
			       : i % 3 == 1 ? "<ref name='exterior' id='shared'/>"
					    : "");
	struct world *w = world_from_text(8, 8, SENSOR("0,0,9", "0,0,0") "<emitter type='constant'/>%s%s",
					  AMBER("id='shared'"), text);
	free(text);
	assert_int_equal(w->media_count, SHAPES / 3 + 1);
	for (uint32_t i = 0; i < SHAPES; i++) {
		assert_int_equal(w->shape_bindings[i].exterior, i % 3 == 1 ? 2 : 0);
		assert_int_equal(w->shape_bindings[i].interior, i == 0 ? 1 : i % 3 == 0 ? i / 3 + 2 : 0);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_transmittance_is_the_limit_of_layers),
		cmocka_unit_test(test_extreme_transmittances_are_exact),
		cmocka_unit_test(test_coefficients_agree_with_albedo),
		cmocka_unit_test(test_descriptions_follow_the_dialect),
		cmocka_unit_test(test_shapes_share_media),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
