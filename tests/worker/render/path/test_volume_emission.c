/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Emitting media. Layers and balls whose radiance is known in closed form; furnaces, in which a medium emits sigma_a
 * L and everything around it emits L, so that the medium is invisible, whatever its coefficients, shape, boundary and
 * grid (Kirchhoff's law); and a ball that scatters, against a random walk written for this test. By all integrators
 * that find such light. Statistics as in tests/support/agreement.h.
 */
#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"
#include "worker/cli/base/options.h"
#include "worker/render/bsdf/ior.h"

#include <math.h>
#include "worker/render/path/path.h"
#include "worker/render/path/volume_emission.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const char *const integrators[] = {"path", "bdpt", "bdpt8", "erpt", "erpt4"};
enum { INTEGRATORS = sizeof integrators / sizeof *integrators, GROUPS = 32, SIDE = 8 };

static double sum3(const double v[3])
{
	return v[0] + v[1] + v[2];
}

/* Cells that have the same value in every sample have no variance to test with. */
static void ignore_rounding_variance(struct agreement_image *image, double expected)
{
	for (uint32_t g = 0; g < image->groups; g++)
		for (int c = 0; c <= AGREEMENT_CELLS; c++)
			if (fabs(image->mean[g][c] / expected - 1) < 1e-5)
				image->mean[g][c] = expected;
}

/* spp: samples per pixel; with_derived_integrators: run also the integrators that build on `path` and bdpt. Long runs
 * are for FULL=1 and then half as many samples longer: bdpt from LONGER samples on, these other integrators from LONG
 * on. */
struct effort {
	uint64_t spp;
	bool with_derived_integrators;
};

enum { LONG = 1000, LONGER = 5000 };

static uint64_t spp_of_integrator(size_t i, struct effort e)
{
	static const uint64_t max_spp[INTEGRATORS] = {UINT64_MAX, LONGER, LONG, LONG, LONG};
	if (i >= 2 && !e.with_derived_integrators)
		return 0;
	return e.spp < max_spp[i] ? e.spp : test_is_full() ? 3 * e.spp / 2 : 0;
}

/* Expects X + Y + Z = `sum` in every block of the image, from paths of at least `min_edges` edges. Takes ownership of
 * the world. */
static void assert_block_sums(const char *name, struct world *w, uint32_t min_edges, double sum, struct effort e)
{
	static struct agreement_image image;
	for (size_t i = 0; i < INTEGRATORS; i++) {
		char test[96];
		const struct agreement_options side = {integrators[i], spp_of_integrator(i, e), GROUPS, min_edges, 0};
		if (!side.spp)
			continue;
		snprintf(test, sizeof test, "%s, %s", name, integrators[i]);
		agreement_render(w, test, integrators[i], &side, &image);
		ignore_rounding_variance(&image, sum);
		agreement_check_constant(test, &image, sum);
	}
	world_free(w);
}

static void assert_radiance(const char *name, struct world *w, double radiance, struct effort e)
{
	assert_false(w->effects.colour);
	assert_block_sums(name, w, 0, radiance * sum3(w->grey_xyz), e);
}

#define DEPTH(k)                                                         \
	"<integrator type='volpath'><integer name='max_depth' value='" k \
	"'/><integer name='rr_depth' value='8'/></integrator>"
#define FROM_ABOVE(near_clip, medium)                                                                               \
	"<sensor type='orthographic'><float name='near_clip' value='" near_clip                                     \
	"'/><float name='far_clip' value='1000'/><transform name='to_world'><lookat "                               \
	"origin='0.2,0.1,90' target='0.2,0.1,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/>" \
	"</film>" medium "</sensor>"
#define SKY "<emitter type='constant'><float name='radiance' value='.7'/></emitter>"
#define SHINES(radiance) "<emitter type='volumelight'><float name='radiance' value='" radiance "'/></emitter>"
#define FOG(sigma_t, albedo)                                                                                        \
	"<medium type='homogeneous' name='interior' id='fog'><float name='sigma_t' value='" sigma_t "'/><spectrum " \
	"name='albedo' value='" albedo "'/></medium>"
#define NULL_FACES "<bsdf type='null'/>"
/* A layer between z = 0 and -2. */
#define LAYER(inner)                                                                                                \
	"<shape type='cube'><transform name='to_world'><translate z='-1'/><scale x='40' y='40'/></transform>" inner \
	"</shape>"

/* Seen from above: the emission of a layer of thickness 2, and the remaining light of the sky behind it. Lengths are
 * in units of the scene; the medium's scale applies to its coefficients only. */
static void emitting_layer_has_its_closed_form(void **state)
{
	(void)state;
	const struct effort e = {16, false};
	double transmittance = exp(-0.6 * 2);
	assert_radiance(
		"absorbing layer",
		world_from_text(
			SIDE, SIDE,
			DEPTH("8") FROM_ABOVE("1", "") SKY LAYER(
				"<medium type='homogeneous' name='interior'><float name='sigma_t' value='0.3'/>"
				"<float name='albedo' value='0'/><float name='scale' value='2'/></medium>" NULL_FACES
					SHINES("0.4"))),
		0.4 / 0.6 * (1 - transmittance) + 0.7 * transmittance, e);
	assert_radiance("clear layer",
			world_from_text(SIDE, SIDE,
					DEPTH("1") FROM_ABOVE("1", "")
						SKY LAYER(FOG("0", "0.5") NULL_FACES SHINES("0.4"))),
			0.4 * 2 + 0.7, e);
	assert_radiance("clear layer and nothing else",
			world_from_text(SIDE, SIDE,
					DEPTH("1") FROM_ABOVE("1", "") LAYER(FOG("0", "0.5") NULL_FACES SHINES("0.4"))),
			0.4 * 2, e);
	/* The camera's near plane lies in the middle of the layer. */
	transmittance = exp(-1);
	assert_radiance("inside of a layer",
			world_from_text(SIDE, SIDE,
					DEPTH("8") FROM_ABOVE("91", "<ref name='medium' id='fog'/>")
						SKY LAYER(FOG("1", "0") NULL_FACES SHINES("0.4"))),
			0.4 * (1 - transmittance) + 0.7 * transmittance, e);
	/* One edge: the unscattered part of the light of a layer that scatters. */
	transmittance = exp(-2 * 1.5);
	assert_radiance("one edge in a layer that scatters",
			world_from_text(SIDE, SIDE,
					DEPTH("1") FROM_ABOVE("1", "")
						LAYER(FOG("1.5", "0.8") NULL_FACES SHINES("0.4"))),
			0.4 / 1.5 * (1 - transmittance), (struct effort){1024, true});
	/* A layer that does not scatter contributes nothing to paths of two edges or more. */
	struct world *w = world_from_text(
		SIDE, SIDE, DEPTH("8") FROM_ABOVE("1", "") SKY LAYER(FOG("1", "0") NULL_FACES SHINES("0.4")));
	static struct agreement_image image;
	const struct agreement_options side = {"bdpt", 16, GROUPS, 2, 0};
	agreement_render(w, "no second edge", "bdpt", &side, &image);
	for (uint32_t g = 0; g < GROUPS; g++)
		assert_true(image.mean[g][AGREEMENT_CELLS] == 0);
	world_free(w);
}

#define VIEW                                                                                                          \
	"<sensor type='perspective'><float name='fov' value='25'/><transform name='to_world'><lookat origin='0,0,4' " \
	"target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/></film></sensor>"
#define BALL(inner) "<shape type='sphere'>" inner "</shape>"

/* A camera in fog, in a room that reflects 0.4 and emits the rest. The fog is the interior of a ball and the exterior
 * of the other shapes: edges pass from it into other emitting media. */
/* clang-format off */
#define ROOM                                                                                                           \
	DEPTH("128") "<sensor type='perspective'><float name='fov' value='70'/><transform name='to_world'><lookat "    \
	"origin='0,0,2.5' target='0.3,0.2,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/></film>" \
	"<ref name='medium' id='fog'/></sensor><shape type='sphere'><float name='radius' value='3'/><boolean "         \
	"name='flip_normals' value='true'/><bsdf type='diffuse'><float name='reflectance' value='.4'/></bsdf>"         \
	"<emitter type='area'><float name='radiance' value='.42'/></emitter><ref name='exterior' id='fog'/></shape>"
#define FOG_BALL                                                                                               \
	"<shape type='sphere'><point name='center' x='-1' y='-0.3' z='1.2'/><float name='radius' value='0.3'/>"   \
	"<ref name='exterior' id='fog'/>" NULL_FACES FOG("0.2", "0.5") SHINES("0.07") "</shape>"
#define SMOKE_CUBE                                                                                                     \
	"<shape type='cube'><transform name='to_world'><scale value='0.3'/><translate x='0.2' y='0.1' z='1.7'/>"      \
	"</transform><ref name='exterior' id='fog'/><medium type='homogeneous' name='interior'><float name='sigma_a' " \
	"value='0.5'/></medium>" NULL_FACES SHINES("0.35") "</shape>"
#define GLASS_BALL                                                                                                 \
	BALL(GLASS("dielectric", "") "<medium type='homogeneous' name='interior'><float name='sigma_a' value='1'/>" \
	"<float name='sigma_s' value='2'/></medium><ref name='exterior' id='fog'/>" SHINES("1.575"))
/* clang-format on */

/* The emission is sigma_a times the sky's radiance, 0.7. Within glass, radiance is larger by the squared index. */
#define GLASS(type, more) \
	"<bsdf type='" type "'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>" more "</bsdf>"

static void furnace_of_emitting_fog_is_uniform(void **state)
{
	(void)state;
	static const struct {
		const char *name, *inner;
		struct effort e;
	} balls[] = {
		{"smoke", NULL_FACES FOG("2", "0") SHINES("1.4"), {16, true}},
		{"fog", NULL_FACES FOG("2", "0.3") SHINES("0.98"), {2048, true}},
		{"glass with smoke", GLASS("dielectric", "") FOG("2", "0") SHINES("3.15"), {512, false}},
		{"glass with fog", GLASS("dielectric", "") FOG("2", "0.3") SHINES("2.205"), {4096, false}},
		{"thin glass with fog", "<bsdf type='thindielectric'/>" FOG("2", "0.3") SHINES("0.98"), {4096, false}},
		{"frosted glass with fog",
		 GLASS("roughdielectric", "<float name='alpha' value='0.001'/>") FOG("2", "0.3") SHINES("2.205"),
		 {4096, false}},
	};
	for (size_t i = 0; i < sizeof balls / sizeof *balls; i++)
		assert_radiance(balls[i].name,
				world_from_text(SIDE, SIDE, DEPTH("64") VIEW SKY BALL("%s"), balls[i].inner), 0.7,
				balls[i].e);
	assert_radiance("room in fog", world_from_text(SIDE, SIDE, ROOM FOG_BALL SMOKE_CUBE GLASS_BALL), 0.7,
			(struct effort){5760, false});
}

/* Chains that spread the fog's light over many pixels cannot resolve half a percent per block in a test, but they can
 * resolve their total. */
static void chains_find_the_total_emission(void **state)
{
	(void)state;
	static struct agreement_image chains, sky;
	struct world *w =
		world_from_text(SIDE, SIDE, DEPTH("64") VIEW SKY BALL(NULL_FACES FOG("2", "0.3") SHINES("0.98")));
	const struct agreement_options side = {"pssmlt", 2048, GROUPS, 0, 0}, alone = {"path", 16, GROUPS, 0, 0};
	agreement_render(w, "fog", "pssmlt", &side, &chains);
	world_free(w);
	w = world_from_text(SIDE, SIDE, DEPTH("64") VIEW SKY);
	agreement_render(w, "fog", "sky", &alone, &sky);
	assert_true(fabs(agreement_check_any_power("fog, pssmlt", &chains, &sky)) < 0.01);
	world_free(w);
}

/* ---- grids ---- */

/* Linear between grid points, and 0 in most of one half of the box. */
static double cloud_density(double x, double y, double z, uint32_t channel)
{
	return (x < 0.5 ? 0 : 2 + 3 * y) + (z > 0.9 ? 4 : 0) + 0.3 * channel * (y + z);
}

#define GRID(name, file)                                                                                  \
	"<volume name='" name "' type='gridvolume'><string name='filename' value='" file "'/><transform " \
	"name='to_world'><translate x='-.5' y='-.5' z='-.5'/><scale value='2'/></transform></volume>"
#define CUBE(inner) "<shape type='cube'>" inner "</shape>"

static struct world *world_with_grids(const char *xml, const struct vol *extinction, const struct vol *light)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)},
					    {"t.vol", extinction->bytes, extinction->size},
					    {"l.vol", light->bytes, light->size},
					    {NULL, NULL, 0}};
	return world_from_files(SIDE, SIDE, files);
}

/* Makes a grid of extinction, and one of emission that has its values times `factor`. */
static void make_cloud(struct vol *extinction, struct vol *light, uint32_t channels, double factor)
{
	const uint32_t side[3] = {5, 4, 6};
	vol_make(extinction, side, channels, cloud_density);
	vol_make(light, side, channels, cloud_density);
	for (uint32_t i = 0; i < side[0] * side[1] * side[2] * channels; i++)
		light->value[i] *= (float)factor;
	vol_write(light);
}

#define CLOUD(albedo)                                         \
	"<medium type='heterogeneous' name='interior'>" GRID( \
		"sigma_t", "t.vol") "<spectrum name='albedo' value='" albedo "'/></medium>" NULL_FACES
#define GRID_GLOW "<emitter type='volumelight'>" GRID("radiance", "l.vol") "</emitter>"

static void furnace_of_an_emitting_grid_is_uniform(void **state)
{
	(void)state;
	static struct vol extinction, light;
	static const char turned[] =
		"<scene version='3.0.0'>" DEPTH("64") VIEW SKY CUBE(CLOUD("0") GRID_GLOW) "</scene>",
			  fog[] = "<scene version='3.0.0'>" DEPTH("128")
				  VIEW SKY CUBE(CLOUD("0.5") GRID_GLOW) "</scene>";
	make_cloud(&extinction, &light, 1, 0.7);
	assert_radiance("smoke on a grid", world_with_grids(turned, &extinction, &light), 0.7,
			(struct effort){2048, false});
	make_cloud(&extinction, &light, 1, 0.35);
	assert_radiance("fog on a grid", world_with_grids(fog, &extinction, &light), 0.7, (struct effort){2048, false});
}

/* Grids of emission in a homogeneous medium, and grids of extinction with constant emission; and positions beyond a
 * grid's box. */
static double ramp_value(double x, double y, double z, uint32_t channel)
{
	(void)x;
	(void)y;
	return (1 + 2 * z) * (channel + 1);
}

static void emitting_grid_has_its_closed_form(void **state)
{
	(void)state;
	static struct vol box, light;
	vol_make(&box, (const uint32_t[3]){1, 1, 1}, 1, ramp_value);
	vol_make(&light, (const uint32_t[3]){1, 1, 2}, 1, ramp_value);
	/* Grid points lie at z = -0.75 (value 1) and z = -0.25 (value 3). Beyond the grid's box, which reaches from z
	 * = -1 to 0, the emission continues with the last value, down to -2. */
#define RAMP                                                                                                  \
	"<emitter type='volumelight'><volume name='radiance' type='gridvolume'><string name='filename' "      \
	"value='l.vol'/><transform name='to_world'><translate x='-.5' y='-.5' z='-1'/><scale x='80' y='80'/>" \
	"</transform></volume></emitter>"
	const struct effort e = {16, false};
	assert_radiance("grid of light in a clear layer",
			world_with_grids("<scene version='3.0.0'>" DEPTH("8") FROM_ABOVE("1", "")
						 LAYER(FOG("0", "0") NULL_FACES RAMP) "</scene>",
					 &box, &light),
			3 * 0.25 + 2 * 0.5 + 1 * 1.25, e);
	double sum = 0;
	enum { STEPS = 4000 };
	for (int i = 0; i < STEPS; i++) {
		double z = (i + 0.5) * 2 / STEPS;
		sum += exp(-1.5 * z) * fmin(fmax(3 - (z - 0.25) * 4, 1), 3) * 2 / STEPS;
	}
	assert_radiance("grid of light in a layer",
			world_with_grids("<scene version='3.0.0'>" DEPTH("8") FROM_ABOVE("1", "")
						 LAYER(FOG("1.5", "0") NULL_FACES RAMP) "</scene>",
					 &box, &light),
			sum, (struct effort){512, false});
	/* The medium's own box is half of the layer. */
	assert_radiance(
		"light in a box",
		world_with_grids(
			"<scene version='3.0.0'>" DEPTH("8") FROM_ABOVE("1", "") LAYER(
				"<medium type='heterogeneous' name='interior'><volume name='sigma_t' type='constvolume'>"
				"<float name='value' value='0'/><transform name='to_world'><translate x='-.5' y='-.5' z='-1.5'/>"
				"<scale x='80' y='80'/></transform></volume><volume name='sigma_n' type='constvolume'>"
				"<float name='value' value='1'/></volume></medium>" NULL_FACES SHINES(
					"0.4")) "</scene>",
			&box, &light),
		0.4, e);
}

/* ---- colours ---- */

#define WHITE "<emitter type='constant'><spectrum name='radiance' value='%s'/></emitter>"

/* Expects the image of the sky alone. */
static void assert_image_of_sky_alone(const char *name, struct world *w, struct world *sky, struct effort e)
{
	static struct agreement_image image, of_sky;
	const struct agreement_options alone = {"path", 4096, GROUPS, 0, 0};
	assert_true(w->effects.colour && sky->effects.colour);
	agreement_render(sky, name, "sky", &alone, &of_sky);
	for (size_t i = 0; i < INTEGRATORS; i++) {
		char test[96];
		const struct agreement_options side = {integrators[i], spp_of_integrator(i, e), GROUPS, 0, 0};
		if (!side.spp)
			continue;
		snprintf(test, sizeof test, "%s, %s", name, integrators[i]);
		agreement_render(w, test, integrators[i], &side, &image);
		agreement_check(test, &image, &of_sky);
	}
	world_free(w);
	world_free(sky);
}

/* clang-format off */
#define COLOURED(albedo, light)                                                                                     \
	"<medium type='homogeneous' name='interior'><spectrum name='sigma_t' value='" RISING "'/><spectrum name='albedo' " \
	"value='" albedo "'/></medium><emitter type='volumelight'><spectrum name='radiance' value='" light "'/></emitter>"
/* clang-format on */
#define RISING "360:1,595:2,830:4"
#define HALF_RISING "360:0.5,595:1,830:2"
#define FLAT "360:1,595:1.000001,830:1"

static void emission_that_balances_absorption_is_unseen_in_colour(void **state)
{
	(void)state;
	static const struct {
		const char *name, *inner;
		struct effort e;
	} balls[] = {
		{"coloured smoke", NULL_FACES COLOURED("0", RISING), {512, false}},
		{"coloured fog", NULL_FACES COLOURED("0.5", HALF_RISING), {2432, false}},
	};
	for (size_t i = 0; i < sizeof balls / sizeof *balls; i++)
		assert_image_of_sky_alone(
			balls[i].name,
			world_from_text(SIDE, SIDE, DEPTH("64") VIEW WHITE BALL("%s"), FLAT, balls[i].inner),
			world_from_text(SIDE, SIDE, DEPTH("64") VIEW WHITE, FLAT), balls[i].e);
	/* In dispersive glass: half of sigma_t times the squared index at each wavelength. */
	char light_in_glass[4096], *to = light_in_glass;
	for (int nm = 360; nm <= 830; nm += 5) {
		double sigma_t = nm <= 595 ? 1 + (nm - 360) / 235.0 : 2 + 2 * (nm - 595) / 235.0,
		       index = 1.5 + 0.02e6 * (1 / ((double)nm * nm) - 1 / (IOR_REFERENCE_NM * IOR_REFERENCE_NM));
		to += sprintf(to, "%s%d:%.9g", nm == 360 ? "" : ",", nm, 0.5 * sigma_t * index * index);
	}
#define PRISM GLASS("dielectric", "<float name='int_cauchy_b' value='0.02'/>")
	assert_image_of_sky_alone("coloured fog in glass that disperses",
				  world_from_text(SIDE, SIDE, DEPTH("64") VIEW WHITE BALL(PRISM COLOURED("0.5", "%s")),
						  FLAT, light_in_glass),
				  world_from_text(SIDE, SIDE, DEPTH("64") VIEW WHITE, FLAT),
				  (struct effort){16384, false});
	/* R, G and B on a grid. */
	static struct vol extinction, light;
	static const char fog[] = "<scene version='3.0.0'>" DEPTH("64") VIEW
		"<emitter type='constant'><rgb name='radiance' value='0.7'/></emitter>" CUBE(
			CLOUD("0.5") GRID_GLOW) "</scene>",
			  sky[] = "<scene version='3.0.0'>" DEPTH("64") VIEW
			  "<emitter type='constant'><rgb name='radiance' value='0.7,0.7,0.70001'/></emitter></scene>";
	make_cloud(&extinction, &light, 3, 0.35);
	worlds_accuracy = "colour=rgb";
	assert_image_of_sky_alone("fog on a grid of R, G and B", world_with_grids(fog, &extinction, &light),
				  world_with_grids(sky, &extinction, &light), (struct effort){2240, false});
	worlds_accuracy = NULL;
}

/* ---- another walk ---- */

/* Returns one sample of the light that leaves a ball of radius 1 and emission 1 per unit length, seen from its
 * surface at height y straight down z. Events of the walk are drawn by extinction and weighted by the albedo; each
 * step adds the light emitted until the next event. */
static double random_walk(struct dice *d, double y, double sigma, double albedo)
{
	vec3 at = {0, y, sqrt(1 - y * y)}, w = {0, 0, -1};
	double weight = 1, sum = 0;
	for (;;) {
		double along = vec3_dot(at, w), end = -along + sqrt(fmax(along * along - vec3_dot(at, at) + 1, 0)),
		       free = -log1p(-dice_uniform(d)) / sigma;
		sum += weight * -expm1(-sigma * end) / sigma; /* expected value of the last step, up to the surface */
		if (free >= end)
			return sum;
		at = vec3_madd(at, free, w);
		w = dice_direction(d);
		weight *= albedo;
	}
}

static void emitting_ball_agrees_with_a_random_walk(void **state)
{
	(void)state;
	enum { WALKS = 1 << 21 };
	static struct agreement_image image;
	const double y = 0.4, sigma = 3, albedo = 0.85;
	struct dice d = dice_for_test("test_volume_emission, ball");
	double sums[GROUPS] = {0};
	static struct agreement_image walked;
	walked.groups = GROUPS;
	struct world *w = world_from_text(
		SIDE, SIDE,
		DEPTH("128") "<sensor type='orthographic'><float name='far_clip' value='9'/><transform name='to_world'>"
			     "<scale x='0.0001' y='0.0001'/><lookat origin='0,0.4,4' target='0,0.4,0' up='0,1,0'/></transform>"
			     "<film type='hdrfilm'><rfilter type='box'/></film></sensor>" BALL(
				     NULL_FACES FOG("3", "0.85") SHINES("1")));
	for (int i = 0; i < WALKS; i++)
		sums[i % GROUPS] += random_walk(&d, y, sigma, albedo);
	for (int g = 0; g < GROUPS; g++)
		for (int c = 0; c <= AGREEMENT_CELLS; c++)
			walked.mean[g][c] = sums[g] / (WALKS / GROUPS) * sum3(w->grey_xyz);
	for (size_t i = 0; i < 2; i++) {
		char test[64];
		const struct agreement_options side = {integrators[i], 13312, GROUPS, 0, 0};
		snprintf(test, sizeof test, "ball that scatters, %s", integrators[i]);
		agreement_render(w, test, integrators[i], &side, &image);
		agreement_check(test, &image, &walked);
	}
	world_free(w);
}

/* ---- descriptions ---- */

static void invalid_volume_lights_are_refused(void **state)
{
	(void)state;
	world_check_refused("<emitter type='volumelight'/>", "\"volumelight\" must be inside a shape");
	world_check_refused(BALL(SHINES("1")), "\"volumelight\" must be inside a shape with an interior medium");
	world_check_refused(BALL("<medium type='homogeneous' name='exterior'/>" SHINES("1")),
			    "a shape with an interior medium");
	world_check_refused(BALL(FOG("1", "0") SHINES("1")) BALL("<ref name='interior' id='fog'/>" SHINES("2")),
			    "a medium may have only one \"volumelight\"");
	world_check_refused(BALL(FOG("1", "0") SHINES("-1")), "radiance");
	world_check_refused(
		BALL(FOG("1", "0") "<emitter type='volumelight'><texture name='radiance' type='checkerboard'/>"
				   "</emitter>"),
		"`radiance` may be a volume, but not a texture");
	world_check_refused(BALL("<emitter type='area'><volume name='radiance' type='constvolume'/></emitter>"),
			    "`radiance` may be a texture, but not a volume");
}

/* Two shapes with one medium refer to the same emitter, and so does the medium around the camera. */
static void shapes_with_one_medium_share_its_emitter(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		SIDE, SIDE,
		VIEW BALL("<medium type='homogeneous' name='interior' id='fog'/><emitter type='volumelight' id='l'>"
			  "<float name='radiance' value='3'/></emitter>")
			BALL("<ref name='interior' id='fog'/><ref id='l'/><point name='center' x='5'/>"));
	assert_true(w->media_count == 1 && w->media[0].is_emissive && w->emitter_count == 0);
	assert_true(w->effects.medium_light && w->effects.scattering && w->effects.max_depth == 128);
	assert_true(fabs(w->media[0].emission.per_length * w->scale - 1) < 1e-15);
	struct render_summary summary;
	world_summary(w, &summary);
	assert_true(summary.brightness_bound > 0);
	world_free(w);
}

/* Chains over full paths would leave the emission out. */
static void integrators_that_miss_volume_emission_are_refused(void **state)
{
	(void)state;
	struct world *w = world_from_text(SIDE, SIDE, VIEW BALL(FOG("1", "0.5") NULL_FACES SHINES("1")));
	struct render_summary summary;
	world_summary(w, &summary);
	for (size_t i = 0; render_integrator_at(i); i++) {
		const char *name = render_integrator_at(i)->name;
		struct render_arguments a = {.plan = {.spp = 4}};
		struct error e = {""};
		snprintf(a.plan.integrator, sizeof a.plan.integrator, "%s", name);
		bool hslt = strcmp(name, "hslt") == 0;
		assert_int_equal(render_plan_from_scene(&a, &summary, &e), hslt ? -EINVAL : 0);
		if (hslt)
			assert_non_null(
				strstr(e.text, "the integrator hslt cannot find the light of media (`volumelight`)"));
	}
	world_free(w);
	worlds_effects = "-medium-light";
	w = world_from_text(SIDE, SIDE, VIEW SKY BALL(FOG("1", "0") NULL_FACES SHINES("1")));
	worlds_effects = NULL;
	assert_true(!w->effects.medium_light && !w->effects.scattering && !w->media[0].is_emissive);
	world_free(w);
}

/* After a vertex that disperses, one wavelength travels on and stands for all four. */
static void volume_emission_after_dispersion_has_one_wavelength(void **state)
{
	(void)state;
	static struct path_context c;
	static uint64_t counters[BATCH_COUNTERS];
	const struct plan p = {.width = SIDE, .height = SIDE, .crop_width = SIDE, .crop_height = SIDE, .max_depth = 8};
	struct world *w = world_from_text(SIDE, SIDE, VIEW WHITE BALL(PRISM COLOURED("0.5", "%s")), FLAT, FLAT);
	unsigned met = 0;
	path_context_init_for_samples(&c, w, &p, counters);
	for (uint64_t i = 0; i < 64; i++) {
		struct sampler_random s;
		double film[2];
		sampler_random_init(&s, 5, RNG_TEST, i, 0);
		path_walk_camera(&c, &s.base, 8, film);
		bool glass = c.camera[1].kind == VERTEX_SURFACE && path_vertex_disperses(&c.camera[1]);
		c.emission_edges = 2;
		c.emission[1] = (spectrum){{1, 2, 3, 4}};
		c.emission[2] = (spectrum){{5, 6, 7, 8}};
		spectrum l = volume_emission(&c, 1, 2, NULL);
		assert_true(l.v[0] == (glass ? 21 : 6) && l.v[1] == (glass ? 2 : 8) && l.v[3] == (glass ? 4 : 12));
		met += glass;
	}
	assert_true(met > 0);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(emitting_layer_has_its_closed_form),
		cmocka_unit_test(furnace_of_emitting_fog_is_uniform),
		cmocka_unit_test(chains_find_the_total_emission),
		cmocka_unit_test(furnace_of_an_emitting_grid_is_uniform),
		cmocka_unit_test(emitting_grid_has_its_closed_form),
		cmocka_unit_test(emission_that_balances_absorption_is_unseen_in_colour),
		cmocka_unit_test(emitting_ball_agrees_with_a_random_walk),
		cmocka_unit_test(invalid_volume_lights_are_refused),
		cmocka_unit_test(shapes_with_one_medium_share_its_emitter),
		cmocka_unit_test(integrators_that_miss_volume_emission_are_refused),
		cmocka_unit_test(volume_emission_after_dispersion_has_one_wavelength),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
