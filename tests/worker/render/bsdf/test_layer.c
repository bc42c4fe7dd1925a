/* SPDX-License-Identifier: Apache-2.0 */
/*
 * hk is compared with its definition, the integral over the depth at which light is scattered, by Gauss's rule; with a
 * plate of the medium itself, in which paths scatter once; and with known limits.
 */
#include "tests/support/agreement.h"
#include "tests/support/dice.h"
#include "tests/support/worlds.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/math/measured_media.h"

#include <float.h>
#include <math.h>

#define PI 3.14159265358979323846

static const struct wavelengths wavelengths = {.nm = {400, 500, 600, 700}};
static const struct bsdf_point point = {
	.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = &wavelengths, .transport = TRANSPORT_RADIANCE};

static double henyey_greenstein(double g, double cosine)
{
	return (1 - g * g) / (4 * PI * pow(1 + g * g - 2 * g * cosine, 1.5));
}

/* Light that is scattered at depth z has travelled z / c, and leaves through z / a, or through the rest of the layer.
 * The density of the event per depth is sigma_s over the two cosines in the definition of reflectance. */
static double depth_integral(double sigma_s, double sigma_t, double thickness, double g, vec3 wo, vec3 wi)
{
	static const double node[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363},
			    weight[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
	enum { PIECES = 2000 };
	double a = fabs(wo.z), c = fabs(wi.z), sum = 0, step = thickness / PIECES;
	for (int i = 0; i < PIECES; i++)
		for (int k = 0; k < 8; k++) {
			double x = k < 4 ? node[k] : -node[k - 4], z = (i + 0.5 + x / 2) * step;
			double out = wo.z * wi.z > 0 ? z : thickness - z;
			sum += weight[k % 4] * step / 2 * exp(-sigma_t * (z / c + out / a));
		}
	return sigma_s * henyey_greenstein(g, -vec3_dot(wo, wi)) * sum / (a * c);
}

static void layer_agrees_with_the_integral_over_depth(void **state)
{
	(void)state;
	static const struct {
		double sigma_s, sigma_a, thickness, g;
	} layers[] = {{2, 0.1, 0.1, 0.8}, {0.3, 0, 1, 0}, {5, 3, 2, -0.5}, {1e-6, 1e-7, 1, 0.3}};
	for (size_t k = 0; k < sizeof layers / sizeof *layers; k++) {
		struct arena a = {0};
		struct dice d = dice_for_test("layer");
		struct bsdf by_both, by_albedo;
		char text[160];
		double s = layers[k].sigma_s, t = s + layers[k].sigma_a, h = layers[k].thickness, g = layers[k].g;
		snprintf(text, sizeof text, "hk sigma_s=%.17g sigma_a=%.17g thickness=%g | phase hg g=%g", s,
			 layers[k].sigma_a, h, g);
		bsdf_make_or_fail(&a, text, &by_both);
		snprintf(text, sizeof text, "hk sigma_t=%.17g albedo=%.17g thickness=%g | phase hg g=%g", t, s / t, h,
			 g);
		bsdf_make_or_fail(&a, text, &by_albedo);
		for (int i = 0; i < 200; i++) {
			vec3 wo = dice_direction(&d), wi = dice_direction(&d), straight;
			if (fmin(fabs(wo.z), fabs(wi.z)) < 0.01)
				continue;
			double want = depth_integral(s, t, h, g, wo, wi),
			       got = by_both.ops->eval(&by_both, &point, wo, wi).v[1], chance,
			       direct = bsdf_eval_delta(&by_both, &point, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, &straight,
							&chance)
						.v[1];
			if (fabs(got - want) > 1e-9 * want + DBL_MIN)
				fail_msg("%s: f(%g %g) is %.17g, by the depth %.17g", text, wo.z, wi.z, got, want);
			if (fabs(by_albedo.ops->eval(&by_albedo, &point, wo, wi).v[1] - want) > 1e-9 * want + DBL_MIN)
				fail_msg("%s is not the same by sigma_s and sigma_a", text);
			double depth = t * h / fabs(wo.z);
			assert_true(fabs(direct - exp(-depth)) <= 1e-15 * (1 + depth) * direct);
			assert_true(straight.x == -wo.x && straight.y == -wo.y && straight.z == -wo.z);
		}
		arena_fini(&a);
	}
}

/* Both cosines are equal or nearly so, where the closed form is 0 / 0. */
static void equal_cosines_have_their_limit(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	bsdf_make_or_fail(&a, "hk sigma_s=2 sigma_a=1 thickness=0.5", &b);
	for (double z = 0.05; z < 1; z += 0.05)
		for (int e = -60; e < -2; e++)
			for (int sign = -1; sign <= 1; sign++) {
				double c = z * (1 - sign * ldexp(1, e));
				vec3 wo = {sqrt((1 - z) * (1 + z)), 0, z}, wi = {0, -sqrt((1 - c) * (1 + c)), -c};
				double want = depth_integral(2, 3, 0.5, 0, wo, wi),
				       got = b.ops->eval(&b, &point, wo, wi).v[0];
				if (fabs(got - want) > 1e-9 * want)
					fail_msg("%.17g and %.17g: %.17g is not %.17g", z, c, got, want);
			}
	arena_fini(&a);
}

/* A layer of thickness 0 has no effect; a thick one transmits nothing, and reflects like a half space that scatters
 * once, A p / (a + c). */
static void thin_and_thick_layers_have_their_limits(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf none, thick;
	vec3 wo = {0.6, 0, 0.8}, above = {0, -0.8, 0.6}, below = {0, 0.8, -0.6}, wi;
	double chance;
	bsdf_make_or_fail(&a, "hk sigma_s=3 sigma_a=2 thickness=0", &none);
	assert_true(bsdf_eval_delta(&none, &point, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, &wi, &chance).v[0] == 1);
	assert_true(chance == 1 && none.ops->pdf_solid(&none, &point, wo, above) == 0);
	assert_true(none.ops->eval(&none, &point, wo, above).v[0] == 0 &&
		    none.ops->eval(&none, &point, wo, below).v[0] == 0);
	bsdf_make_or_fail(&a, "hk sigma_t=1e9 albedo=0.5 thickness=1e30", &thick);
	assert_true(bsdf_eval_delta(&thick, &point, wo, BSDF_TRANSMIT | BSDF_STRAIGHT, &wi, &chance).v[0] == 0 &&
		    chance == 0);
	assert_true(thick.ops->eval(&thick, &point, wo, below).v[0] == 0);
	assert_true(fabs(thick.ops->eval(&thick, &point, wo, above).v[0] * 4 * PI * 1.4 / 0.5 - 1) < 1e-12);
	arena_fini(&a);
}

/* The measured materials of 0.6, whose coefficients are replaced one by one by those that the file gives. */
static void named_materials_have_their_coefficients(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf named, stated;
	char list[300], text[200];
	const struct measured_medium *m = measured_medium_find("ketchup", list, sizeof list);
	vec3 wo = {0.6, 0, 0.8}, wi = {0, -0.8, 0.6};
	snprintf(text, sizeof text, "hk thickness=0.01 sigma_a=0.4 sigma_s=rgb(%.17g,%.17g,%.17g)",
		 MEASURED_MEDIUM_SCALE * m->sigma_s[0], MEASURED_MEDIUM_SCALE * m->sigma_s[1],
		 MEASURED_MEDIUM_SCALE * m->sigma_s[2]);
	bsdf_make_or_fail(&a, "hk thickness=0.01 material=ketchup sigma_a=0.4", &named);
	bsdf_make_or_fail(&a, text, &stated);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		assert_true(named.ops->eval(&named, &point, wo, wi).v[i] ==
			    stated.ops->eval(&stated, &point, wo, wi).v[i]);
	assert_true(named.color_kind == COLOR_KIND_OTHER);
	arena_fini(&a);
}

static void invalid_layers_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *text, *sentence;
	} cases[] = {
		{"hk sigma_s=1 albedo=0.5", "either sigma_s and sigma_a, or sigma_t and albedo"},
		{"hk sigma_t=1", "either sigma_s and sigma_a, or sigma_t and albedo"},
		{"hk material=skin9", "there is no material 'skin9'"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct arena a = {0};
		struct bsdf b;
		struct error e;
		assert_int_not_equal(bsdf_try(&a, cases[i].text, true, &b, &e), 0);
		if (!strstr(e.text, cases[i].sentence))
			fail_msg("%s: %s", cases[i].text, e.text);
		arena_fini(&a);
	}
	world_check_refused(
		"<shape type='sphere'><bsdf type='hk'><phase type='sggx'><volume type='constvolume' name='S'><string "
		"name='value' value='0.15, 1, 0.8, 0, 0, 0'/></volume></phase></bsdf></shape>",
		"microflakes are not supported in a layer");
}

#define FOG                                                                                                  \
	"<rgb name='sigma_t' value='0.8,1.5,2.5'/><rgb name='albedo' value='0.9,0.6,0.3'/><phase type='hg'>" \
	"<float name='g' value='0.5'/></phase>"
#define LIGHT                                                                                                       \
	"<emitter type='constant'><rgb name='radiance' value='0.3'/></emitter><emitter type='directional'><vector " \
	"name='direction' x='0.3' y='-0.5' z='-0.6'/><rgb name='irradiance' value='2,3,4'/></emitter>"

/* A plate of the medium of thickness 1, so large that its rim is not seen, with paths of two edges, that is with one
 * scattering event: its faces, which are `null`, are no events, since connections look through them. */
static void layer_agrees_with_a_plate_of_its_medium(void **state)
{
	(void)state;
	enum { SIDE = 16 };
	static const char camera[] = SENSOR("0,20,30", "0,0,0");
	static struct agreement_image layer, plate;
	struct world *w = world_from_text(
		SIDE, SIDE,
		LIGHT
		"%s<shape type='rectangle'><transform name='to_world'><scale value='1e4'/></transform><bsdf type='hk'>" FOG
		"</bsdf></shape>",
		camera);
	agreement_render(w, "layer", "layer", &(struct agreement_options){"path", 1536, 16, 1, 2}, &layer);
	world_free(w);
	w = world_from_text(
		SIDE, SIDE,
		LIGHT
		"%s<shape type='cube'><transform name='to_world'><scale x='1e4' y='1e4' z='0.5'/></transform><bsdf type='null'/>"
		"<medium type='homogeneous' name='interior'>" FOG "</medium></shape>",
		camera);
	agreement_render(w, "layer", "plate", &(struct agreement_options){"path", 6144, 16, 1, 2}, &plate);
	world_free(w);
	agreement_check("layer", &layer, &plate);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(layer_agrees_with_the_integral_over_depth),
		cmocka_unit_test(equal_cosines_have_their_limit),
		cmocka_unit_test(thin_and_thick_layers_have_their_limits),
		cmocka_unit_test(named_materials_have_their_coefficients),
		cmocka_unit_test(invalid_layers_are_refused),
		cmocka_unit_test(layer_agrees_with_a_plate_of_its_medium),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
