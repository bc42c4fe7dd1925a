/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The setting `colour=rgb`: the R, G and B values of each kind of colour, against integrals with another quadrature;
 * a closed sphere that emits and reflects, whose radiance is known for each of R, G and B; no dispersion; and
 * agreement of integrators on a scene with glass, metal and a coating.
 */
#include "common/base/color.h"
#include "tests/support/agreement.h"
#include "tests/support/worlds.h"
#include "worker/render/bsdf/metal.h"
#include "worker/render/texture/color.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static const struct wavelengths rgb_lanes = {.is_rgb = true};

static void assert_same_lanes(const struct color *c, const double rgb[3], double tolerance)
{
	spectrum s = color_eval(c, &rgb_lanes);
	for (int k = 0; k < 3; k++)
		if (!(fabs(s.v[k] - rgb[k]) <= tolerance))
			fail_msg("channel %d: %.9g, expected %.9g", k, s.v[k], rgb[k]);
	assert_true(s.v[3] == s.v[1]);
}

/* Integrates by the midpoint rule over the wavelengths, with the film's density and weights. */
static void integrate(const struct color *c, bool under_d65, double rgb[3])
{
	enum { STEPS = 9400 };
	double xyz[3] = {0, 0, 0}, range = WAVELENGTH_MAX - WAVELENGTH_MIN;
	for (int i = 0; i < STEPS; i++) {
		double nm = WAVELENGTH_MIN + (i + 0.5) * range / STEPS, one[3];
		struct wavelengths w = {.nm = {nm, nm, nm, nm}};
		double factor = wavelength_pdf(nm) * range / STEPS * (under_d65 ? color_d65(nm) : 1);
		spectrum_to_xyz(spectrum_scale(factor, color_eval(c, &w)), &w, one);
		for (int k = 0; k < 3; k++)
			xyz[k] += one[k];
	}
	rec709_from_xyz(xyz, rgb);
}

static void test_lanes_are_the_rgb_components(void **state)
{
	(void)state;
	struct arena arena = {0};
	struct error e;
	struct color c;
	double expected[3];
	const double rgb[3] = {0.63, 0.065, 0.05}, light[3] = {5, 2, 0};
	assert_int_equal(color_from_rgb(rgb, COLOR_REFLECTANCE, &c), 0);
	assert_same_lanes(&c, rgb, 1e-15);
	assert_int_equal(color_from_rgb(light, COLOR_ILLUMINANT, &c), 0);
	assert_same_lanes(&c, light, 1e-14);
	assert_int_equal(color_from_rgb(light, COLOR_UNBOUNDED, &c), 0);
	assert_same_lanes(&c, light, 1e-14);
	c = color_constant(0.25);
	assert_same_lanes(&c, (const double[]){0.25, 0.25, 0.25}, 0);
	spectrum s = color_eval_rgb_reflectance(rgb, &rgb_lanes), t = color_eval_rgb_illuminant(light, &rgb_lanes);
	for (int k = 0; k < SPECTRUM_LANES; k++)
		assert_true(s.v[k] == rgb[k % 3 + (k == 3)] && t.v[k] == light[k % 3 + (k == 3)]);

	const double nm[] = {380, 480, 550, 600, 720}, x[] = {0.1, 0.2, 0.9, 0.5, 0.7}, one[] = {2};
	struct value v = {.type = VALUE_SPECTRUM, .as.spectrum = {.count = 5, .nm = nm, .value = x}};
	static const enum color_role roles[] = {COLOR_REFLECTANCE, COLOR_UNBOUNDED, COLOR_ILLUMINANT};
	for (int k = 0; k < 3; k++) {
		assert_int_equal(color_from_value(&v, roles[k], &arena, &c, &e), 0);
		integrate(&c, roles[k] != COLOR_ILLUMINANT, expected);
		assert_same_lanes(&c, expected, 2e-4);
	}
	v.as.spectrum.count = 1;
	v.as.spectrum.value = one;
	assert_int_equal(color_from_value(&v, COLOR_ILLUMINANT, &arena, &c, &e), 0);
	integrate(&c, false, expected);
	assert_same_lanes(&c, expected, 2e-4);
	assert_true(expected[0] > 2.4 && expected[2] < 1.85);
	arena_fini(&arena);
}

/* A reflectance is at most 1, and no component of a colour is negative, although monochromatic red light has negative
 * green. */
static void test_colours_beyond_the_gamut_are_clipped(void **state)
{
	(void)state;
	struct arena arena = {0};
	struct error e;
	struct color c;
	const double nm[] = {499, 500, 501, 579, 580, 640, 641}, narrow[] = {0, 1, 0, 0, 0, 0, 0},
		     red[] = {0, 0, 0, 0, 1, 1, 1};
	struct value v = {.type = VALUE_SPECTRUM, .as.spectrum = {.count = 7, .nm = nm, .value = narrow}};
	assert_int_equal(color_from_value(&v, COLOR_ILLUMINANT, &arena, &c, &e), 0);
	spectrum s = color_eval(&c, &rgb_lanes);
	assert_true(s.v[0] == 0 && s.v[1] > 0 && s.v[2] > 0);
	v.as.spectrum.value = red;
	assert_int_equal(color_from_value(&v, COLOR_REFLECTANCE, &arena, &c, &e), 0);
	assert_true(color_eval(&c, &rgb_lanes).v[0] == 1);
	assert_int_equal(color_from_value(&v, COLOR_UNBOUNDED, &arena, &c, &e), 0);
	assert_true(color_eval(&c, &rgb_lanes).v[0] > 1.1);
	arena_fini(&arena);
}

/* In a closed diffuse sphere of reflectance rho that emits E, the radiance is L = E / (1 - rho) everywhere. */
static void test_closed_sphere_has_its_radiance(void **state)
{
	(void)state;
	static const double emitted[3] = {1, 2, 3}, rho[3] = {0.63, 0.065, 0.05};
	double light[3], xyz[3];
	for (int k = 0; k < 3; k++)
		light[k] = emitted[k] / (1 - rho[k]);
	rec709_to_xyz(light, xyz);
	worlds_accuracy = "colour=rgb";
	struct world *w = world_from_text(
		16, 16,
		SENSOR("0,0,0", "0,0,1") "<shape type='sphere'><boolean name='flip_normals' value='true'/>"
					 "<emitter type='area'><rgb name='radiance' value='1,2,3'/></emitter>"
					 "<bsdf type='diffuse'><rgb name='reflectance' value='0.63,0.065,0.05'/>"
					 "</bsdf></shape>");
	worlds_accuracy = NULL;
	static const struct agreement_options sides[] = {{"path", 64, 32, 0, 0}, {"bdpt", 64, 32, 0, 0}};
	for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
		static struct agreement_image a;
		agreement_render(w, "rgb", sides[i].integrator, &sides[i], &a);
		agreement_check_constant(sides[i].integrator, &a, xyz[0] + xyz[1] + xyz[2]);
	}
	world_free(w);
}

#define PRISM                                                                                            \
	"<shape type='sphere'><point name='center' y='-0.5' z='0.3'/><float name='radius' value='0.5'/>" \
	"<bsdf type='dielectric'><float name='int_cauchy_b' value='0.0042'/></bsdf></shape>"

static void test_dispersion_is_off(void **state)
{
	(void)state;
	worlds_accuracy = "colour=rgb";
	struct world *w = world_from_text(8, 8,
					  SENSOR("0,0,3", "0,0,0") PRISM
					  "<emitter type='constant'><rgb name='radiance' value='1'/></emitter>");
	assert_true(w->effects.colour && !w->effects.dispersion);
	bool said = false;
	for (size_t i = 0; i < w->effects.effect_line_count; i++)
		said |= !w->effects.effect_lines[i].is_on &&
			strstr(w->effects.effect_lines[i].reason, "but colours are rgb");
	assert_true(said);
	world_free(w);
	worlds_effects = "+dispersion";
	world_check_refused(PRISM, "need spectra");
	worlds_effects = "+wavelength";
	world_check_refused(PRISM, "need spectra");
	worlds_effects = worlds_accuracy = NULL;
}

static void test_integrators_agree(void **state)
{
	(void)state;
	static struct agreement_image a, b;
	worlds_accuracy = "colour=rgb";
	struct world *w =
		world_from_text(32, 32,
				"<integrator type='path'><integer name='max_depth' value='6'/></integrator>" SENSOR(
					"0,0.2,3.2", "0,-0.3,0") PRISM
				"<shape type='rectangle'><transform name='to_world'><scale value='3'/>"
				"<rotate x='1' angle='-90'/><translate y='-1'/></transform>"
				"<bsdf type='diffuse'><rgb name='reflectance' value='0.8,0.3,0.1'/></bsdf>"
				"</shape><shape type='sphere'><point name='center' x='-0.9' y='-0.5'/>"
				"<float name='radius' value='0.5'/><bsdf type='roughconductor'>"
				"<string name='material' value='Cu'/><float name='alpha' value='0.15'/></bsdf>"
				"</shape><shape type='sphere'><point name='center' x='0.9' y='-0.5'/>"
				"<float name='radius' value='0.5'/><bsdf type='principled'>"
				"<rgb name='base_color' value='0.1,0.4,0.8'/><float name='spec_tint' value='1'/>"
				"<float name='roughness' value='0.4'/></bsdf></shape>"
				"<shape type='rectangle'><transform name='to_world'><scale value='0.8'/>"
				"<rotate x='1' angle='90'/><translate y='1.5'/></transform><emitter type='area'>"
				"<spectrum name='radiance' value='400:1 550:9 700:12'/></emitter></shape>");
	worlds_accuracy = NULL;
	static const struct agreement_options bdpt = {"bdpt", 512, 32, 0, 0}, hslt = {"hslt", 3072, 32, 0, 0};
	agreement_render(w, "rgb", "bdpt", &bdpt, &a);
	agreement_render(w, "rgb", "hslt", &hslt, &b);
	agreement_check_any_power("rgb, hslt and bdpt", &b, &a);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_lanes_are_the_rgb_components),
		cmocka_unit_test(test_colours_beyond_the_gamut_are_clipped),
		cmocka_unit_test(test_closed_sphere_has_its_radiance),
		cmocka_unit_test(test_dispersion_is_off),
		cmocka_unit_test(test_integrators_agree),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
