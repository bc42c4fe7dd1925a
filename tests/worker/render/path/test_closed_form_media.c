/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images of media known in closed form: absorption by Beer's law, a sky seen through and in media that absorb
 * nothing, layers that scatter light once, a beam in a layer, and a half-space (Chandrasekhar 1960). Statistics as in
 * tests/support/agreement.h (level 1e-4 over the suite, power printed and bounded).
 */
#include "tests/support/known_radiance.h"
#include "tests/support/test_length.h"
#include "tests/support/memory_assets.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

#define SKY "<emitter type='constant'><float name='radiance' value='.7'/></emitter>"
#define BALL(bsdf) "<shape type='sphere'>" bsdf "</shape>"

/* The ray runs perpendicular to the faces, without refraction, through a length of 1.4 in a medium of sigma_t 1.1 and
 * 0.6 in one of 0.5. The innermost slab states no medium. */
static void absorbing_slabs_follow_beers_law(void **state)
{
	(void)state;
#define SLAB(size, inner)                                                           \
	"<shape type='cube'><transform name='to_world'><scale x='9' y='9' z='" size \
	"'/></transform><bsdf type='null'/>" inner "</shape>"
	static const char view[] =
		"<sensor type='orthographic'><float name='far_clip' value='100'/><transform name='to_world'><lookat "
		"origin='0.2,0.1,40' target='0.2,0.1,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/>"
		"</film></sensor>";
	known_radiance_check(
		"absorbing slabs",
		world_from_text(
			16, 16,
			"%s<integrator type='volpath'><integer name='max_depth' value='16'/><integer name='rr_depth' "
			"value='16'/></integrator>" SKY
			"<medium type='homogeneous' id='haze'><spectrum name='sigma_t' value='0.25'/><float name='scale' value='2'/>"
			"<spectrum name='albedo' value='0'/><phase type='isotropic'/></medium>" SLAB(
				"1", "<ref name='interior' id='haze'/>")
				SLAB("0.7",
				     "<medium type='homogeneous' name='interior'><spectrum name='sigma_a' value='1.1'/>"
				     "<spectrum name='sigma_s' value='0'/></medium><ref name='exterior' id='haze'/>")
					SLAB("0.1", ""),
			view),
		0.7 * exp(-1.1 * 1.4 - 0.5 * 0.6), (struct known_radiance_spp){512, 512, 0});
}

/* A camera in a medium, whose near plane lies 3 before a face beyond which there is no medium; the medium in front of
 * the near plane does not count. */
static void medium_before_the_near_plane_does_not_count(void **state)
{
	(void)state;
	known_radiance_check(
		"camera in a medium",
		world_from_text(
			16, 16,
			SKY
			"<sensor type='orthographic'><float name='near_clip' value='36'/><transform name='to_world'>"
			"<lookat origin='0.2,0.1,40' target='0.2,0.1,0' up='0,1,0'/></transform><film type='hdrfilm'>"
			"<rfilter type='box'/></film><medium type='homogeneous' id='haze'><float name='sigma_a' "
			"value='0.2'/></medium></sensor><shape type='rectangle'><transform name='to_world'>"
			"<scale value='9'/><translate z='1'/></transform><bsdf type='null'/><ref name='exterior' "
			"id='haze'/></shape>"),
		0.7 * exp(-0.2 * 3), (struct known_radiance_spp){64, 64, 0});
}

#define FROM_ABOVE(near_clip, medium)                                                                               \
	"<sensor type='orthographic'><float name='near_clip' value='" near_clip                                     \
	"'/><float name='far_clip' value='1000'/><transform name='to_world'><lookat "                               \
	"origin='0.2,0.1,90' target='0.2,0.1,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/>" \
	"</film>" medium "</sensor>"
/* A layer between z = 0 and z = -2 half, so wide that its sides are out of reach. */
#define LAYER_OF(type, half, sigma_t, albedo, phase)                                                     \
	"<shape type='cube'><transform name='to_world'><translate z='-1'/><scale x='40' y='40' z='" half \
	"'/></transform><bsdf type='null'/><medium type='" type "' name='interior' id='layer'>" sigma_t  \
	"<spectrum name='albedo' value='" albedo "'/>" phase "</medium></shape>"
#define LAYER(half, albedo, phase) LAYER_OF("homogeneous", half, "<float name='sigma_t' value='1'/>", albedo, phase)
#define WITHOUT_ROULETTE(depth)                                              \
	"<integrator type='volpath'><integer name='max_depth' value='" depth \
	"'/><integer name='rr_depth' value='128'/></integrator>"

#define FORWARDS "<phase type='hg'><float name='g' value='0.6'/></phase>"
#define FLAKES \
	"<phase type='sggx'><volume type='constvolume' name='S'><string name='value' value='.5,.2,.9,.1,.3,-.1'/></volume></phase>"

/* In media that absorb nothing, everything looks like the sky. */
static void white_media_look_like_the_sky(void **state)
{
	(void)state;
	static const char *const boundary[] = {"<bsdf type='null'/>", "<bsdf type='dielectric'/>"};
	static const char *const names[] = {"white fog", "milk in glass", "white flakes in glass"};
	static const char *const phases[] = {FORWARDS, FORWARDS, FLAKES};
	for (int i = 0; i < 3; i++)
		known_radiance_check(
			names[i],
			world_from_text(
				16, 16,
				WITHOUT_ROULETTE("128") SKY
				"<sensor type='perspective'><float name='fov' value='25'/><transform name='to_world'><lookat "
				"origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/>"
				"</film></sensor><shape type='sphere'>%s<medium type='homogeneous' name='interior'>"
				"<float name='sigma_s' value='2'/>%s</medium></shape>",
				boundary[i > 0], phases[i]),
			0.7, i ? (struct known_radiance_spp){320, 0, 0} : (struct known_radiance_spp){3072, 0, 0});
}

/* Faces of `null` are no vertices, so paths of one edge pass through them: the image shows the sky through the layer,
 * without the light that the layer scatters. */
static void unscattered_light_passes_through_null_faces(void **state)
{
	(void)state;
	known_radiance_check(
		"seen through a layer",
		world_from_text(16, 16, WITHOUT_ROULETTE("1") SKY FROM_ABOVE("0.01", "") LAYER("0.5", "0.5", "")),
		0.7 * exp(-1), (struct known_radiance_spp){1024, 1024, 0});
}

/* Returns E_2(x) / 2, the share of light that reaches the depth x below a plane lit from all directions of one
 * hemisphere, by the midpoint rule over the cosine. */
static double half_exponential_integral(double x)
{
	enum { STEPS = 2000 };
	double sum = 0;
	for (int i = 0; i < STEPS; i++)
		sum += exp(-x * STEPS / (i + 0.5));
	return sum / (2 * STEPS);
}

/* Light of the sky that a layer of optical depth 2 scatters once, seen from above, or from a near plane in the layer
 * at the depth `begin`: the integral over the depth x of exp(begin - x) times the albedo times the light that reaches
 * x from both sides. The faces of the layer are no vertices, so the paths have two edges. */
static void check_scattered_once(const char *name, double begin, const char *sensor, struct known_radiance_spp e)
{
	enum { STEPS = 1000 };
	double depth = 2, sum = 0, step = (depth - begin) / STEPS;
	for (int i = 0; i < STEPS; i++) {
		double x = begin + (i + 0.5) * step;
		sum += exp(begin - x) * (half_exponential_integral(x) + half_exponential_integral(depth - x)) * step;
	}
	known_radiance_check_edges(
		name, world_from_text(16, 16, WITHOUT_ROULETTE("2") SKY "%s" LAYER("1", "0.6", ""), sensor), 2,
		0.7 * 0.6 * sum, e);
}

static void layer_scatters_sky_light_once(void **state)
{
	(void)state;
	check_scattered_once("scattered once", 0, FROM_ABOVE("0.01", ""), (struct known_radiance_spp){14336, 0, 0});
	check_scattered_once("scattered once, seen from inside", 0.5,
			     FROM_ABOVE("90.5", "<ref name='medium' id='layer'/>"),
			     (struct known_radiance_spp){8192, 0, 0});
}

/* Chandrasekhar 1960, sec. 36 and 58: under a sky of radiance 1, a half-space that scatters isotropically reflects 1
 * - H(mu) sqrt(1 - albedo). H is found by iterating its equation, in the form whose integral is positive. */
static double chandrasekhar_h(double albedo, double mu)
{
	enum { STEPS = 400, ROUNDS = 60 };
	double h[STEPS], root = sqrt(1 - albedo), at = 1;
	for (int i = 0; i < STEPS; i++)
		h[i] = 1;
	for (int round = 0; round < ROUNDS; round++) {
		double next[STEPS];
		for (int i = 0; i <= STEPS; i++) {
			double m = i < STEPS ? (i + 0.5) / STEPS : mu, sum = 0;
			for (int k = 0; k < STEPS; k++)
				sum += (k + 0.5) / STEPS * h[k] / (m + (k + 0.5) / STEPS) / STEPS;
			at = 1 / (root + albedo / 2 * sum);
			if (i < STEPS)
				next[i] = at;
		}
		memcpy(h, next, sizeof h);
	}
	return at;
}

static void half_space_reflects_as_chandrasekhar_computed(void **state)
{
	(void)state;
	double albedo = 0.5;
	known_radiance_check(
		"half-space",
		world_from_text(16, 16, WITHOUT_ROULETTE("128") SKY FROM_ABOVE("0.01", "") LAYER("8", "0.5", "")),
		0.7 * (1 - chandrasekhar_h(albedo, 1) * sqrt(1 - albedo)), (struct known_radiance_spp){3072, 0, 0});
}

/* The mean is 1 from z = 0 to -2, so that the optical depth is that of LAYER. */
static double strata_density(double x, double y, double z, uint32_t channel)
{
	(void)x;
	(void)y;
	(void)channel;
	return z == 0 ? 0.3 : z < 0.4 ? 2.9 : z < 0.7 ? 0 : 0.8;
}

/* Phase function from the direction (-0.8, 0, 0.6) to z, from the projected areas and the distribution D of the half
 * vector, with the inverse of the matrix FLAKES. */
static double flakes_phase_value(double albedo)
{
	const double x = -0.8 / sqrt(3.2), z = 1.6 / sqrt(3.2), det = .5 * .17 - .1 * .12 - .3 * .07;
	double form = (x * x * .17 + z * z * .09 - 2 * x * z * .07) / det, along = sqrt(.9) + sqrt(.356) / 0.6;
	return albedo / (4 * M_PI * sqrt(det) * form * form) * (1 - exp(-2 * along)) / along;
}

/* An oblique beam whose light is scattered once: only the optical depth matters, not the position of the beam. */
static void oblique_beam_is_scattered_once_in_a_layer(void **state)
{
	(void)state;
#define BEAM_IN(layer)                                                                                          \
	"<scene version='3.0.0'>" WITHOUT_ROULETTE("2") "<emitter type='directional'><vector name='direction' " \
							"x='0.8' y='0' z='-0.6'/><float name='irradiance' "     \
							"value='5'/></emitter>" FROM_ABOVE("0.01", "") layer    \
		"</scene>"
#define STRATA                                                                                             \
	"<volume name='sigma_t' type='gridvolume'><string name='filename' value='strata.vol'/><transform " \
	"name='to_world'><translate x='-.5' y='-.5' z='-1'/><scale x='80' y='80' z='2'/></transform></volume>"
	static const char layered[] =
		BEAM_IN(LAYER_OF("heterogeneous", "1", STRATA, "0.6", "<phase type='rayleigh'/>"));
	/* The cosine between the incident and the scattered direction is -0.6, for which the table has 1.2 / (6 * 2
	 * pi). */
	static const char mixed[] = BEAM_IN(
		LAYER("1", "0.6",
		      "<phase type='mixturephase'><string name='weights' value='.2,.5'/><phase type='rayleigh'/><phase "
		      "type='tabphase'><string name='values' value='0,3,6'/></phase></phase>"));
	static struct vol grid;
	vol_make(&grid, (const uint32_t[3]){1, 1, 4}, 1, strata_density);
	double along = 1 + 1 / 0.6, phase = 3 / (16 * M_PI) * 1.36, once = 0.6 * (1 - exp(-2 * along)) / along;
	static const char *const names[] = {"beam in a layer", "beam in strata", "beam in a mixture", "beam in flakes"},
				 *const scenes[] = {BEAM_IN(LAYER("1", "0.6", "<phase type='rayleigh'/>")), layered,
						    mixed, BEAM_IN(LAYER("1", "0.6", FLAKES))};
	const double share[] = {once * phase, once * phase, once * (0.2 * phase + 0.1 / (2 * M_PI)),
				flakes_phase_value(0.6)};
	for (int i = 0; i < 4; i++) {
		const struct memory_file files[] = {{"beam.xml", scenes[i], strlen(scenes[i])},
						    {"strata.vol", grid.bytes, grid.size},
						    {NULL, NULL, 0}};
		known_radiance_check_edges(names[i], world_from_files(16, 16, files), 2, 5 * share[i],
					   (struct known_radiance_spp){512, 512, 0});
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(absorbing_slabs_follow_beers_law),
		cmocka_unit_test(medium_before_the_near_plane_does_not_count),
		cmocka_unit_test(white_media_look_like_the_sky),
		cmocka_unit_test(layer_scatters_sky_light_once),
		cmocka_unit_test(unscattered_light_passes_through_null_faces),
		cmocka_unit_test(oblique_beam_is_scattered_once_in_a_layer),
	};
	const struct CMUnitTest longer[] = {
		cmocka_unit_test(half_space_reflects_as_chandrasekhar_computed)}; /* half a minute */
	int failed = cmocka_run_group_tests(tests, NULL, NULL);
	return test_is_full() ? failed + cmocka_run_group_tests(longer, NULL, NULL) : failed;
}
