/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images known in closed form, which need no rendering: furnaces, directly lit planes, two plates, and lamps smaller
 * than a pixel. test_closed_form_media.c tests media. Statistics as in tests/support/agreement.h (level 1e-4 over the
 * suite, power printed and bounded).
 */
#include "tests/support/agreement.h"
#include "tests/support/known_radiance.h"
#include "tests/support/test_length.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static double sum3(const double v[3])
{
	return v[0] + v[1] + v[2];
}

#define DEPTH(k) "<integrator type='path'><integer name='max_depth' value='" k "'/></integrator>"

/* Inside a sphere that emits L = 1 and reflects rho = 0.5, the radiance is 1 + 1/2 + 1/4 + ..., with one term per
 * edge up to max_depth. */
static void furnace_has_a_geometric_series_of_radiance(void **state)
{
	(void)state;
	known_radiance_check(
		"furnace",
		world_from_text(
			16, 16,
			DEPTH("5") SENSOR(
				"0.2,0.1,0.3",
				"0.5,1,0") "<shape type='sphere'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'>"
					   "<float name='reflectance' value='.5'/></bsdf><emitter type='area'/></shape>"),
		1 + 0.5 + 0.25 + 0.125 + 0.0625, (struct known_radiance_spp){64, 256, 0});
}

/* Like furnace_has_a_geometric_series_of_radiance(), but seen in all directions from a point off the centre, with a
 * filter that wraps around the film's edges. */
static void furnace_is_uniform_in_all_directions(void **state)
{
	(void)state;
	known_radiance_check(
		"furnace, all around",
		world_from_text(
			16, 8,
			DEPTH("5") "<sensor type='spherical'><film type='hdrfilm'/><transform name='to_world'>"
				   "<translate x='0.3' y='0.5'/></transform></sensor>"
				   "<shape type='sphere'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'>"
				   "<float name='reflectance' value='.5'/></bsdf><emitter type='area'/></shape>"),
		1 + 0.5 + 0.25 + 0.125 + 0.0625,
		(struct known_radiance_spp){512, 1024, test_is_full() ? 49152 : 0}); /* pssmlt takes a minute */
}

/* Seen through a telecentric lens, whose points lie a million radii away: the states of chains must represent them
 * accurately enough. */
static void furnace_is_uniform_through_a_telecentric_lens(void **state)
{
	(void)state;
	static struct agreement_image image;
	struct world *w = world_from_text(
		16, 16,
		DEPTH("5") "<sensor type='telecentric'><film type='hdrfilm'/><float name='aperture_radius' value='.2'/>"
			   "<float name='focus_distance' value='.5'/><transform name='to_world'><scale value='0.3'/>"
			   "<lookat origin='0.2,0.1,0.3' target='0.5,1,0' up='0,1,0'/></transform></sensor>"
			   "<shape type='sphere'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'>"
			   "<float name='reflectance' value='.5'/></bsdf><emitter type='area'/></shape>");
	struct agreement_options side = {"hslt", 512, 32, 0, 0};
	agreement_render(w, "furnace, far lens, hslt", "hslt", &side, &image);
	if (!(image.counters[COUNT_ACCEPTED] > 0 && image.counters[COUNT_STATES_LOST] == 0))
		fail_msg("%llu accepted, %llu states lost", (unsigned long long)image.counters[COUNT_ACCEPTED],
			 (unsigned long long)image.counters[COUNT_STATES_LOST]);
	known_radiance_check("furnace, far lens", w, 1 + 0.5 + 0.25 + 0.125 + 0.0625,
			     (struct known_radiance_spp){64, 256, 0});
}

#define SKY "<emitter type='constant'><float name='radiance' value='.7'/></emitter>"
#define BALL(bsdf) "<shape type='sphere'>" bsdf "</shape>"

/* In constant light, objects that absorb nothing are invisible. */
static void objects_that_absorb_nothing_are_invisible(void **state)
{
	(void)state;
	known_radiance_check(
		"invisible glass",
		world_from_text(16, 16, DEPTH("128") SENSOR("0,0,4", "0,0,0") SKY BALL("<bsdf type='dielectric'/>")),
		0.7, (struct known_radiance_spp){128, 192, 0});
	known_radiance_check(
		"invisible mirror",
		world_from_text(16, 16,
				DEPTH("8") SENSOR("0,0,4", "0,0,0") SKY BALL(
					"<bsdf type='conductor'><string name='material' value='none'/></bsdf>")),
		0.7, (struct known_radiance_spp){64, 64, 16384});
	known_radiance_check(
		"invisible glass in glass",
		world_from_text(
			16, 16,
			DEPTH("128") SENSOR("0,0,4", "0,0,0") SKY BALL(
				"<bsdf type='dielectric'/>") "<shape type='sphere'><float name='radius' value='.5'/>"
							     "<bsdf type='dielectric'><float name='int_ior' value='1'/>"
							     "<float name='ext_ior' value='1.5046'/></bsdf></shape>"),
		0.7, (struct known_radiance_spp){320, 0, 0});
	/* The surface is rough, but only slightly: a model of single scattering loses 0.065 % +- 0.007 % of this
	 * image at alpha = 0.01, in proportion to alpha^2, which is far below the bias that the test can find. */
	known_radiance_check(
		"invisible rough glass",
		world_from_text(16, 16,
				DEPTH("64") SENSOR("0,0,4", "0,0,0") SKY BALL(
					"<bsdf type='roughdielectric'><float name='alpha' value='.001'/></bsdf>")),
		0.7, (struct known_radiance_spp){256, 256, 0});
	known_radiance_check(
		"invisible rough metal",
		world_from_text(16, 16,
				DEPTH("8") SENSOR("0,0,4", "0,0,0")
					SKY BALL("<bsdf type='roughconductor'><string name='material' value='none'/>"
						 "<float name='alpha' value='.001'/></bsdf>")),
		0.7, (struct known_radiance_spp){128, 64, 0});
	/* A white diffuse ball: every path ends in the sky. */
	known_radiance_check(
		"invisible white ball",
		world_from_text(16, 16,
				DEPTH("8") SENSOR("0,0,4", "0,0,0")
					SKY BALL("<bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf>")),
		0.7, (struct known_radiance_spp){1536, 1024, 0});
}

/* A lamp at height h over the floor: either a square of side a that faces down, integrated by the midpoint rule, or a
 * sphere of radius r entirely above the horizon, whose irradiance is pi r^2 / d^2 times the cosine. The functions
 * below give the irradiance at (x, z) from the lamp's foot for radiance 1. glass: thickness of a pane of index 1.5
 * between a tiny sphere and a floor that reflects nothing back. */
struct lamp {
	double a, r, h, glass;
};

/* Returns the share of unpolarised light that one face of the pane transmits at this angle of incidence. */
static double transmitted_share(double cosine, double inner)
{
	double s = (cosine - 1.5 * inner) / (cosine + 1.5 * inner), p = (1.5 * cosine - inner) / (1.5 * cosine + inner);
	return 1 - 0.5 * (s * s + p * p);
}

/* Light that leaves the lamp at the angle t from the vertical arrives at the distance rho(t) from the lamp's foot;
 * the flux pi r^2 sin t dt is spread over rho drho. */
static double irradiance_behind_glass(const struct lamp *l, double rho)
{
	double low = 0, high = M_PI / 2, air = l->h - l->glass;
	for (;;) {
		double t = 0.5 * (low + high), c = cos(t), inner = sqrt(1 - pow(sin(t) / 1.5, 2));
		if (t <= low || t >= high) {
			double through = transmitted_share(c, inner), bent = l->glass * c / (1.5 * inner);
			return M_PI * l->r * l->r * through * through * (c / (air + bent)) /
			       (air / (c * c) + bent / (inner * inner));
		}
		*(tan(t) * (air + l->glass * c / (1.5 * inner)) < rho ? &low : &high) = t;
	}
}

static double irradiance(const struct lamp *l, double x, double z)
{
	enum { N = 32 };
	double sum = 0, h = l->h, a = l->a;
	if (l->glass > 0)
		return irradiance_behind_glass(l, sqrt(x * x + z * z));
	if (l->r > 0)
		return M_PI * l->r * l->r * h / pow(x * x + z * z + h * h, 1.5);
	for (int i = 0; i < N * N; i++) {
		double dx = a * ((i % N + 0.5) / N - 0.5) - x, dz = a * ((i / N + 0.5) / N - 0.5) - z,
		       d2 = dx * dx + dz * dz + h * h;
		sum += h * h / (d2 * d2);
	}
	return sum * a * a / (N * N);
}

/* Compares the mean over each block of a film of n x n pixels that sees the floor straight from above; there are
 * AGREEMENT_BLOCKS squared blocks. The 40-degree camera at height `up` sees a square of the floor of side 2 up tan 20.
 * Film x runs along +x, film y along +z. */
static void expect_floor(const char *test, const struct agreement_image *image, double up, const struct lamp *lamp,
			 double x, double z, double scale)
{
	enum { N = 24 };
	static struct agreement_image part;
	double half = up * tan(20 * M_PI / 180), whole = 0;
	for (int c = 0; c <= AGREEMENT_CELLS; c++) {
		double sum = 0;
		for (int i = 0; c < AGREEMENT_CELLS && i < N * N; i++) {
			double u = (c % AGREEMENT_BLOCKS + (i % N + 0.5) / N) / AGREEMENT_BLOCKS,
			       v = (c / AGREEMENT_BLOCKS + (i / N + 0.5) / N) / AGREEMENT_BLOCKS;
			sum += scale * irradiance(lamp, half * (2 * u - 1) - x, half * (2 * v - 1) - z) / (N * N);
		}
		whole += c < AGREEMENT_CELLS ? sum / AGREEMENT_CELLS : 0;
		double expected = c < AGREEMENT_CELLS ? sum : whole;
		/* Each cell is divided by its expected value, so that all cells are compared with 1. */
		for (uint32_t g = 0; g < image->groups; g++)
			part.mean[g][c] = image->mean[g][c] / expected;
	}
	part.groups = image->groups;
	agreement_check_constant(test, &part, 1);
}

/* A camera above the floor looks down; the lamp hangs over (3, 1), out of its view. */
static void check_lit_floor(const char *name, struct lamp lamp, const char *xml, struct known_radiance_spp e)
{
	static struct agreement_image image;
	const struct {
		const char *integrator;
		uint64_t spp;
	} runs[] = {{"path", e.path}, {"bdpt", e.bdpt}, {"pssmlt", e.pssmlt}};
	struct world *w = world_from_text(
		16, 16,
		"%s<shape type='rectangle'><transform name='to_world'><scale value='20'/><rotate x='1' angle='-90'/></transform>"
		"<bsdf type='diffuse'><float name='reflectance' value='.5'/></bsdf></shape>"
		"<sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'>"
		"<lookat origin='0,4,0' target='0,0,0' up='0,0,-1'/>"
		"</transform><film type='hdrfilm'><rfilter type='box'/></film></sensor>%s",
		lamp.glass > 0 ? DEPTH("4") : DEPTH("2"), xml);
	for (size_t i = 0; i < 3; i++) {
		if (!runs[i].spp)
			continue;
		char test[64];
		snprintf(test, sizeof test, "%s, %s", name, runs[i].integrator);
		struct agreement_options side = {runs[i].integrator, runs[i].spp, 32, 0, 0};
		agreement_render(w, test, runs[i].integrator, &side, &image);
		expect_floor(test, &image, 4, &lamp, 3, 1, 0.5 / M_PI * sum3(w->grey_xyz));
	}
	world_free(w);
}

static void floor_has_the_irradiance_of_its_lamp(void **state)
{
	(void)state;
	check_lit_floor(
		"floor under a square", (struct lamp){1, 0, 2, 0},
		"<shape type='rectangle'><transform name='to_world'><scale value='.5'/><rotate x='1' angle='90'/>"
		"<translate x='3' y='2' z='1'/></transform><emitter type='area'/></shape>",
		(struct known_radiance_spp){3072, 6144, test_is_full() ? 32768 : 0});
	check_lit_floor("floor under a sphere", (struct lamp){0, 0.4, 2, 0},
			"<shape type='sphere'><point name='center' x='3' y='2' z='1'/><float name='radius' value='.4'/>"
			"<emitter type='area'/></shape>",
			(struct known_radiance_spp){1024, 2048, 0});
	check_lit_floor(
		"floor under a tiny sphere", (struct lamp){0, 1e-5, 2, 0},
		"<shape type='sphere'><point name='center' x='3' y='2' z='1'/><float name='radius' value='1e-5'/>"
		"<emitter type='area'/></shape>",
		(struct known_radiance_spp){512, 0, 0});
#define GLASS                                                                                                       \
	"<shape type='cube'><transform name='to_world'><scale x='90' y='.5' z='90'/><translate y='5'/></transform>" \
	"<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/></bsdf></shape>"
	check_lit_floor("floor behind glass, under a tiny sphere", (struct lamp){0, 1e-5, 7, 1},
			GLASS "<shape type='sphere'><point name='center' x='3' y='7' z='1'/>"
			      "<float name='radius' value='1e-5'/><emitter type='area'/></shape>",
			(struct known_radiance_spp){64, 512, 0});
	check_lit_floor("floor behind glass, under a point", (struct lamp){0, 1 / sqrt(M_PI), 7, 1},
			GLASS "<emitter type='point'><point name='position' x='3' y='7' z='1'/></emitter>",
			(struct known_radiance_spp){64, 512, 0});
}

/* A beam straight down, wider than the part of the floor in view: the radiance is M rho / pi. */
static void wide_beam_lights_the_floor_evenly(void **state)
{
	(void)state;
	struct world *w = world_from_own_scene("beam", "floor.xml", 16, 16);
	known_radiance_check("floor under a beam", w, 1.5 * 0.5 / M_PI, (struct known_radiance_spp){128, 832, 0});
}

/* The sun shines straight down through thin glass and a filter, which also lie between the camera and the floor. The
 * glass reflects r = 2 R / (1 + R) with R = ((n - 1) / (n + 1))^2, and the filter transmits one half at each passage:
 * the camera sees (1 - r) / 4 of M rho / pi. A sub-path from either side can reach the floor only through the glass
 * and the filter, and neither the sun nor the camera can be hit. */
static void glass_and_filter_attenuate_the_sun_twice(void **state)
{
	(void)state;
	const double n = 1.5, R = (n - 1) * (n - 1) / ((n + 1) * (n + 1));
	struct world *w = world_from_text(
		16, 16,
		"%s<sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'>"
		"<lookat origin='0,2,0' target='0,0,0' up='0,0,-1'/></transform></sensor>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/></transform>"
		"<bsdf type='diffuse'><float name='reflectance' value='.5'/></bsdf></shape>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='90'/>"
		"<translate y='1'/></transform><bsdf type='polarizer'/></shape>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/>"
		"<translate y='3'/></transform><bsdf type='thindielectric'><float name='int_ior' value='1.5'/>"
		"<float name='ext_ior' value='1'/></bsdf></shape>"
		"<emitter type='directional'><vector name='direction' value='0,-1,0'/>"
		"<float name='irradiance' value='3'/></emitter>",
		DEPTH("5"));
	known_radiance_check("floor seen through a filter", w, 3 * 0.5 / M_PI * (1 - 2 * R / (1 + R)) / 4,
			     (struct known_radiance_spp){128, 832, 0});
}

/* Two plates of reflectance rho, of which the lower emits radiance 1. Between infinite plates every ray from one
 * meets the other, so the radiance of the lower plate is 1 + rho^2 + rho^4 + ..., that of the upper one rho + rho^3 +
 * .... The plates are 4000 gaps wide, which loses about 1e-6 of the light seen by the camera in the middle. */
static void parallel_plates_exchange_a_series_of_light(void **state)
{
	(void)state;
	const double rho = 0.6;
	static const char plates[] =
		"<shape type='rectangle'><transform name='to_world'><scale value='4000'/><rotate x='1' angle='-90'/></transform>"
		"<bsdf type='diffuse'><float name='reflectance' value='.6'/></bsdf><emitter type='area'/></shape>"
		"<shape type='rectangle'><transform name='to_world'><scale value='4000'/><rotate x='1' angle='90'/>"
		"<translate y='1'/></transform>"
		"<bsdf type='diffuse'><float name='reflectance' value='.6'/></bsdf></shape>";
	known_radiance_check("lower plate",
			     world_from_text(16, 16, DEPTH("6") SENSOR("0,0.5,0", "0.2,0,0.1") "%s", plates),
			     1 + pow(rho, 2) + pow(rho, 4), (struct known_radiance_spp){512, 0, 0});
	known_radiance_check("upper plate",
			     world_from_text(16, 16, DEPTH("6") SENSOR("0,0.5,0", "0.2,1,0.1") "%s", plates),
			     rho + pow(rho, 3) + pow(rho, 5), (struct known_radiance_spp){1024, 0, 0});
}

/* A lamp on the axis, about 400 times smaller than a pixel: it covers the part `share` of the film with its radiance
 * 1. A sample of the film meets the lamp once in 100,000 times, so points on the lamp must be connected to the lens. */
static void check_small_lamp(const char *name, const char *lamp, double share)
{
	static struct agreement_image image;
	const char *const integrators[] = {"bdpt", "bdpt8", "erpt4", "pssmlt"};
	const uint64_t spp[] = {64, 256, 256, 512};
	struct world *w = world_from_text(16, 16, DEPTH("3") SENSOR("0,0,4", "0,0,0") "%s", lamp);
	for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
		char test[64];
		snprintf(test, sizeof test, "%s, %s", name, integrators[i]);
		struct agreement_options side = {integrators[i], spp[i], 32, 0, 0};
		agreement_render(w, test, integrators[i], &side, &image);
		for (uint32_t g = 0; g < image.groups; g++)
			for (int c = 0; c <= AGREEMENT_CELLS; c++)
				image.mean[g][c] = image.mean[g][AGREEMENT_CELLS] / (share * sum3(w->grey_xyz));
		/* The amount that one sample of the film would add if it met the lamp. */
		known_radiance_round(&image, 1, 1e-4);
		agreement_check_constant(test, &image, 1);
	}
	world_free(w);
}

static void lamp_smaller_than_a_pixel_has_its_share_of_light(void **state)
{
	(void)state;
	double slope = tan(20 * M_PI / 180); /* slope of the ray through the film's edge */
	check_small_lamp("square in a pixel",
			 "<shape type='rectangle'><transform name='to_world'><scale value='0.005'/></transform>"
			 "<emitter type='area'/></shape>",
			 pow(0.005 / 4 / slope, 2));
	double tangent = tan(asin(0.005 / 4));
	check_small_lamp("ball in a pixel",
			 "<shape type='sphere'><float name='radius' value='0.005'/><emitter type='area'/></shape>",
			 M_PI * pow(tangent / slope, 2) / 4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(furnace_has_a_geometric_series_of_radiance),
		cmocka_unit_test(furnace_is_uniform_in_all_directions),
		cmocka_unit_test(furnace_is_uniform_through_a_telecentric_lens),
		cmocka_unit_test(objects_that_absorb_nothing_are_invisible),
		cmocka_unit_test(floor_has_the_irradiance_of_its_lamp),
		cmocka_unit_test(wide_beam_lights_the_floor_evenly),
		cmocka_unit_test(glass_and_filter_attenuate_the_sun_twice),
		cmocka_unit_test(parallel_plates_exchange_a_series_of_light),
		cmocka_unit_test(lamp_smaller_than_a_pixel_has_its_share_of_light),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
