/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images that are known without rendering: furnaces, directly lit planes, two plates, lamps smaller than a pixel,
 * layers that scatter. Statistics as in tests/support/agree.h (level 1e-4 over the suite, power printed and bounded).
 */
#include "worker/render/render.h"
#include "tests/support/agree.h"
#include "tests/support/dice.h"
#include "tests/support/length.h"
#include "tests/support/leases.h"
#include "tests/support/memory_assets.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static double sum3(const double v[3])
{
	return v[0] + v[1] + v[2];
}

/* Integrators at their least samples that tell half a percent of the mean; 0: not run on this scene. */
struct effort {
	uint64_t path, bdpt, pssmlt;
};

/* Where every sample is the same the groups are, too, but for the rounding of tiles to float and what a hair of
 * roughness loses: no statistics of that. */
static void remove_rounding(struct agree_image *image, double expected, double tolerance)
{
	for (uint32_t g = 0; g < image->groups; g++)
		for (int c = 0; c <= AGREE_CELLS; c++)
			if (fabs(image->mean[g][c] / expected - 1) < tolerance)
				image->mean[g][c] = expected;
}

/* Each cell of the image has the radiance L of a grey scene, by paths of `least` edges or more. Takes the world. */
static void check_depths(const char *name, struct world *w, uint32_t least, double radiance, struct effort e)
{
	static struct agree_image image;
	const struct {
		const char *integrator;
		uint64_t spp;
	} runs[] = {{"path", e.path}, {"bdpt", e.bdpt}, {"pssmlt", e.pssmlt}};
	assert_false(w->effects.colour);
	for (size_t i = 0; i < 3; i++) {
		if (!runs[i].spp)
			continue;
		char test[64];
		snprintf(test, sizeof test, "%s, %s", name, runs[i].integrator);
		struct agree_side side = {runs[i].integrator, runs[i].spp, 32, least, 0};
		agree_render(w, test, runs[i].integrator, &side, &image);
		remove_rounding(&image, radiance * sum3(w->grey_xyz), 1e-5);
		agree_expect(test, &image, radiance * sum3(w->grey_xyz));
	}
	world_free(w);
}

static void check_constant(const char *name, struct world *w, double radiance, struct effort e)
{
	check_depths(name, w, 0, radiance, e);
}

#define DEPTH(k) "<integrator type='path'><integer name='max_depth' value='" k "'/></integrator>"

/* Inside a sphere that shines with L = 1 and reflects rho = 0.5: 1 + 1/2 + 1/4 + ... up to the depth. */
static void test_furnace(void **state)
{
	(void)state;
	check_constant(
		"furnace",
		world_of_text(
			16, 16,
			DEPTH("5") SENSOR(
				"0.2,0.1,0.3",
				"0.5,1,0") "<shape type='sphere'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'>"
					   "<float name='reflectance' value='.5'/></bsdf><emitter type='area'/></shape>"),
		1 + 0.5 + 0.25 + 0.125 + 0.0625, (struct effort){64, 256, 0});
}

/* The same, seen all around from a point off its centre, with a filter that reaches around the film's edges. */
static void test_furnace_all_around(void **state)
{
	(void)state;
	check_constant(
		"furnace, all around",
		world_of_text(
			16, 8,
			DEPTH("5") "<sensor type='spherical'><film type='hdrfilm'/><transform name='to_world'>"
				   "<translate x='0.3' y='0.5'/></transform></sensor>"
				   "<shape type='sphere'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'>"
				   "<float name='reflectance' value='.5'/></bsdf><emitter type='area'/></shape>"),
		1 + 0.5 + 0.25 + 0.125 + 0.0625,
		(struct effort){512, 1024, test_full() ? 49152 : 0}); /* pssmlt: a minute */
}

/* Through a telecentric lens, whose points lie a million radii away: states of chains hold them exactly enough. */
static void test_furnace_far_lens(void **state)
{
	(void)state;
	static struct agree_image image;
	struct world *w = world_of_text(
		16, 16,
		DEPTH("5") "<sensor type='telecentric'><film type='hdrfilm'/><float name='aperture_radius' value='.2'/>"
			   "<float name='focus_distance' value='.5'/><transform name='to_world'><scale value='0.3'/>"
			   "<lookat origin='0.2,0.1,0.3' target='0.5,1,0' up='0,1,0'/></transform></sensor>"
			   "<shape type='sphere'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'>"
			   "<float name='reflectance' value='.5'/></bsdf><emitter type='area'/></shape>");
	struct agree_side side = {"hslt", 512, 32, 0, 0};
	agree_render(w, "furnace, far lens, hslt", "hslt", &side, &image);
	if (!(image.counters[COUNT_ACCEPTED] > 0 && image.counters[COUNT_STATES_LOST] == 0))
		fail_msg("%llu accepted, %llu states lost", (unsigned long long)image.counters[COUNT_ACCEPTED],
			 (unsigned long long)image.counters[COUNT_STATES_LOST]);
	check_constant("furnace, far lens", w, 1 + 0.5 + 0.25 + 0.125 + 0.0625, (struct effort){64, 256, 0});
}

#define SKY "<emitter type='constant'><float name='radiance' value='.7'/></emitter>"
#define BALL(bsdf) "<shape type='sphere'>" bsdf "</shape>"

/* In constant light lossless things cannot be seen. */
static void test_invisible(void **state)
{
	(void)state;
	check_constant(
		"invisible glass",
		world_of_text(16, 16, DEPTH("128") SENSOR("0,0,4", "0,0,0") SKY BALL("<bsdf type='dielectric'/>")), 0.7,
		(struct effort){128, 192, 0});
	check_constant("invisible mirror",
		       world_of_text(16, 16,
				     DEPTH("8") SENSOR("0,0,4", "0,0,0") SKY BALL(
					     "<bsdf type='conductor'><string name='material' value='none'/></bsdf>")),
		       0.7, (struct effort){64, 64, 16384});
	check_constant(
		"invisible glass in glass",
		world_of_text(
			16, 16,
			DEPTH("128") SENSOR("0,0,4", "0,0,0") SKY BALL(
				"<bsdf type='dielectric'/>") "<shape type='sphere'><float name='radius' value='.5'/>"
							     "<bsdf type='dielectric'><float name='int_ior' value='1'/>"
							     "<float name='ext_ior' value='1.5046'/></bsdf></shape>"),
		0.7, (struct effort){320, 0, 0});
	/* Rough, but so little that what a model of single scattering loses (0.065 % +- 0.007 % of this image at alpha
	 * 0.01, and with its square) is far below what is found. */
	check_constant("invisible rough glass",
		       world_of_text(16, 16,
				     DEPTH("64") SENSOR("0,0,4", "0,0,0") SKY BALL(
					     "<bsdf type='roughdielectric'><float name='alpha' value='.001'/></bsdf>")),
		       0.7, (struct effort){256, 256, 0});
	check_constant("invisible rough metal",
		       world_of_text(16, 16,
				     DEPTH("8") SENSOR("0,0,4", "0,0,0") SKY BALL(
					     "<bsdf type='roughconductor'><string name='material' value='none'/>"
					     "<float name='alpha' value='.001'/></bsdf>")),
		       0.7, (struct effort){128, 64, 0});
	/* White diffuse: every path ends in the sky. */
	check_constant("invisible white ball",
		       world_of_text(16, 16,
				     DEPTH("8") SENSOR("0,0,4", "0,0,0") SKY BALL(
					     "<bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf>")),
		       0.7, (struct effort){1536, 1024, 0});
}

/* Through 1.4 of a medium of 1.1, behind 0.6 of one of 0.5: seen at a right angle, and without refraction. What is in
 * the second states no medium. */
static void test_absorbing(void **state)
{
	(void)state;
#define SLAB(size, inner)                                                           \
	"<shape type='cube'><transform name='to_world'><scale x='9' y='9' z='" size \
	"'/></transform><bsdf type='null'/>" inner "</shape>"
	static const char view[] =
		"<sensor type='orthographic'><float name='far_clip' value='100'/><transform name='to_world'><lookat "
		"origin='0.2,0.1,40' target='0.2,0.1,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/>"
		"</film></sensor>";
	check_constant(
		"absorbing slabs",
		world_of_text(
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
		0.7 * exp(-1.1 * 1.4 - 0.5 * 0.6), (struct effort){512, 512, 0});
}

/* A camera in a medium, 3 before a face behind which there is none; the medium before its near plane is not there. */
static void test_camera_in_medium(void **state)
{
	(void)state;
	check_constant(
		"camera in a medium",
		world_of_text(
			16, 16,
			SKY
			"<sensor type='orthographic'><float name='near_clip' value='36'/><transform name='to_world'>"
			"<lookat origin='0.2,0.1,40' target='0.2,0.1,0' up='0,1,0'/></transform><film type='hdrfilm'>"
			"<rfilter type='box'/></film><medium type='homogeneous' id='haze'><float name='sigma_a' "
			"value='0.2'/></medium></sensor><shape type='rectangle'><transform name='to_world'>"
			"<scale value='9'/><translate z='1'/></transform><bsdf type='null'/><ref name='exterior' "
			"id='haze'/></shape>"),
		0.7 * exp(-0.2 * 3), (struct effort){64, 64, 0});
}

#define FROM_ABOVE(near_clip, medium)                                                                               \
	"<sensor type='orthographic'><float name='near_clip' value='" near_clip                                     \
	"'/><float name='far_clip' value='1000'/><transform name='to_world'><lookat "                               \
	"origin='0.2,0.1,90' target='0.2,0.1,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/>" \
	"</film>" medium "</sensor>"
/* Between z = 0 and twice `half` below, and so wide that its sides are out of reach. */
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

/* Where nothing is absorbed, everything looks like the sky. */
static void test_white_media(void **state)
{
	(void)state;
	static const char *const boundary[] = {"<bsdf type='null'/>", "<bsdf type='dielectric'/>"};
	static const char *const names[] = {"white fog", "milk in glass", "white flakes in glass"};
	static const char *const phases[] = {FORWARDS, FORWARDS, FLAKES};
	for (int i = 0; i < 3; i++)
		check_constant(
			names[i],
			world_of_text(
				16, 16,
				WITHOUT_ROULETTE("128") SKY
				"<sensor type='perspective'><float name='fov' value='25'/><transform name='to_world'><lookat "
				"origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'><rfilter type='box'/>"
				"</film></sensor><shape type='sphere'>%s<medium type='homogeneous' name='interior'>"
				"<float name='sigma_s' value='2'/>%s</medium></shape>",
				boundary[i > 0], phases[i]),
			0.7, i ? (struct effort){320, 0, 0} : (struct effort){3072, 0, 0});
}

/* Paths of one edge pass faces that are no vertices: the sky through a layer, without what the layer scatters. */
static void test_seen_through_layer(void **state)
{
	(void)state;
	check_constant("seen through a layer",
		       world_of_text(16, 16, WITHOUT_ROULETTE("1") SKY FROM_ABOVE("0.01", "") LAYER("0.5", "0.5", "")),
		       0.7 * exp(-1), (struct effort){1024, 1024, 0});
}

/* E_2(x) / 2: what reaches a depth of x through a plane, of light from all directions of one half. By the midpoint rule
 * over the cosine. */
static double half_exponential_integral(double x)
{
	enum { STEPS = 2000 };
	double sum = 0;
	for (int i = 0; i < STEPS; i++)
		sum += exp(-x * STEPS / (i + 0.5));
	return sum / (2 * STEPS);
}

/* Light of the sky that a layer of optical depth 2 scatters once, seen from above, or from a near plane in it at depth
 * `begin`: the integral of exp(begin - x) times the albedo times what reaches x from both sides. The layer's faces are
 * no vertices: two edges. */
static void check_scattered_once(const char *name, double begin, const char *sensor, struct effort e)
{
	enum { STEPS = 1000 };
	double depth = 2, sum = 0, step = (depth - begin) / STEPS;
	for (int i = 0; i < STEPS; i++) {
		double x = begin + (i + 0.5) * step;
		sum += exp(begin - x) * (half_exponential_integral(x) + half_exponential_integral(depth - x)) * step;
	}
	check_depths(name, world_of_text(16, 16, WITHOUT_ROULETTE("2") SKY "%s" LAYER("1", "0.6", ""), sensor), 2,
		     0.7 * 0.6 * sum, e);
}

static void test_scattered_once(void **state)
{
	(void)state;
	check_scattered_once("scattered once", 0, FROM_ABOVE("0.01", ""), (struct effort){14336, 0, 0});
	check_scattered_once("scattered once, seen from inside", 0.5,
			     FROM_ABOVE("90.5", "<ref name='medium' id='layer'/>"), (struct effort){8192, 0, 0});
}

/* Chandrasekhar 1960, sec. 36 and 58: under a sky of radiance 1 a half-space that scatters isotropically reflects
 * 1 - H(mu) sqrt(1 - albedo). H by iterating its equation, in the form whose integral is positive. */
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

static void test_half_space(void **state)
{
	(void)state;
	double albedo = 0.5;
	check_constant("half-space",
		       world_of_text(16, 16, WITHOUT_ROULETTE("128") SKY FROM_ABOVE("0.01", "") LAYER("8", "0.5", "")),
		       0.7 * (1 - chandrasekhar_h(albedo, 1) * sqrt(1 - albedo)), (struct effort){3072, 0, 0});
}

/* From 0 to -2 along z, the mean is 1: as deep as LAYER. */
static double strata(double x, double y, double z, uint32_t channel)
{
	(void)x;
	(void)y;
	(void)channel;
	return z == 0 ? 0.3 : z < 0.4 ? 2.9 : z < 0.7 ? 0 : 0.8;
}

/* From (-0.8, 0, 0.6) to z: by the areas seen and D of the half vector, with the inverse of the matrix FLAKES. */
static double flakes_once(double albedo)
{
	const double x = -0.8 / sqrt(3.2), z = 1.6 / sqrt(3.2), det = .5 * .17 - .1 * .12 - .3 * .07;
	double form = (x * x * .17 + z * z * .09 - 2 * x * z * .07) / det, along = sqrt(.9) + sqrt(.356) / 0.6;
	return albedo / (4 * M_PI * sqrt(det) * form * form) * (1 - exp(-2 * along)) / along;
}

/* A beam at an angle, scattered once: only the optical depth counts, not where it comes from. */
static void test_beam_in_layer(void **state)
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
	/* Light goes on by -0.6; there the table has 1.2 / (6 * 2 pi). */
	static const char mixed[] = BEAM_IN(
		LAYER("1", "0.6",
		      "<phase type='mixturephase'><string name='weights' value='.2,.5'/><phase type='rayleigh'/><phase "
		      "type='tabphase'><string name='values' value='0,3,6'/></phase></phase>"));
	static struct vol grid;
	vol_make(&grid, (const uint32_t[3]){1, 1, 4}, 1, strata);
	double along = 1 + 1 / 0.6, phase = 3 / (16 * M_PI) * 1.36, once = 0.6 * (1 - exp(-2 * along)) / along;
	static const char *const names[] = {"beam in a layer", "beam in strata", "beam in a mixture", "beam in flakes"},
				 *const scenes[] = {BEAM_IN(LAYER("1", "0.6", "<phase type='rayleigh'/>")), layered,
						    mixed, BEAM_IN(LAYER("1", "0.6", FLAKES))};
	const double share[] = {once * phase, once * phase, once * (0.2 * phase + 0.1 / (2 * M_PI)), flakes_once(0.6)};
	for (int i = 0; i < 4; i++) {
		const struct memory_file files[] = {{"beam.xml", scenes[i], strlen(scenes[i])},
						    {"strata.vol", grid.bytes, grid.size},
						    {NULL, NULL, 0}};
		check_depths(names[i], world_of_files(16, 16, files), 2, 5 * share[i], (struct effort){512, 512, 0});
	}
}

/* A lamp at height h over the floor: a square of side a that looks down, by the midpoint rule, or a sphere of radius r,
 * all of it above the horizon: pi r^2 / d^2 times the cosine. Irradiance at (x, z) from its foot, radiance 1. glass:
 * the thickness of a pane of index 1.5 between a tiny sphere and the floor, which reflects nothing back. */
struct lamp {
	double a, r, h, glass;
};

/* Unpolarised light that comes at this angle through one face of the pane. */
static double transmitted_share(double cosine, double inner)
{
	double s = (cosine - 1.5 * inner) / (cosine + 1.5 * inner), p = (1.5 * cosine - inner) / (1.5 * cosine + inner);
	return 1 - 0.5 * (s * s + p * p);
}

/* Light that leaves at the angle t from the vertical arrives at a distance rho(t) from the lamp's foot; the intensity
 * pi r^2 sin t dt falls on rho drho. */
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

/* Mean over the block of a film of n x n pixels, seen straight from above: block b of AGREE_BLOCKS squared. The camera
 * of 40 degrees at height `up` sees the floor's square of side 2 up tan 20. Film x is +x, film y is +z. */
static void expect_floor(const char *test, const struct agree_image *image, double up, const struct lamp *lamp,
			 double x, double z, double scale)
{
	enum { N = 24 };
	static struct agree_image part;
	double half = up * tan(20 * M_PI / 180), whole = 0;
	for (int c = 0; c <= AGREE_CELLS; c++) {
		double sum = 0;
		for (int i = 0; c < AGREE_CELLS && i < N * N; i++) {
			double u = (c % AGREE_BLOCKS + (i % N + 0.5) / N) / AGREE_BLOCKS,
			       v = (c / AGREE_BLOCKS + (i / N + 0.5) / N) / AGREE_BLOCKS;
			sum += scale * irradiance(lamp, half * (2 * u - 1) - x, half * (2 * v - 1) - z) / (N * N);
		}
		whole += c < AGREE_CELLS ? sum / AGREE_CELLS : 0;
		double expected = c < AGREE_CELLS ? sum : whole;
		/* All cells against 1. */
		for (uint32_t g = 0; g < image->groups; g++)
			part.mean[g][c] = image->mean[g][c] / expected;
	}
	part.groups = image->groups;
	agree_expect(test, &part, 1);
}

/* A camera above the floor, looking down, a lamp over (3, 1) that it does not see. */
static void check_lit_floor(const char *name, struct lamp lamp, const char *xml, struct effort e)
{
	static struct agree_image image;
	const struct {
		const char *integrator;
		uint64_t spp;
	} runs[] = {{"path", e.path}, {"bdpt", e.bdpt}, {"pssmlt", e.pssmlt}};
	struct world *w = world_of_text(
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
		struct agree_side side = {runs[i].integrator, runs[i].spp, 32, 0, 0};
		agree_render(w, test, runs[i].integrator, &side, &image);
		expect_floor(test, &image, 4, &lamp, 3, 1, 0.5 / M_PI * sum3(w->grey_xyz));
	}
	world_free(w);
}

static void test_lit_floor(void **state)
{
	(void)state;
	check_lit_floor(
		"floor under a square", (struct lamp){1, 0, 2, 0},
		"<shape type='rectangle'><transform name='to_world'><scale value='.5'/><rotate x='1' angle='90'/>"
		"<translate x='3' y='2' z='1'/></transform><emitter type='area'/></shape>",
		(struct effort){3072, 6144, test_full() ? 32768 : 0});
	check_lit_floor("floor under a sphere", (struct lamp){0, 0.4, 2, 0},
			"<shape type='sphere'><point name='center' x='3' y='2' z='1'/><float name='radius' value='.4'/>"
			"<emitter type='area'/></shape>",
			(struct effort){1024, 2048, 0});
	check_lit_floor(
		"floor under a tiny sphere", (struct lamp){0, 1e-5, 2, 0},
		"<shape type='sphere'><point name='center' x='3' y='2' z='1'/><float name='radius' value='1e-5'/>"
		"<emitter type='area'/></shape>",
		(struct effort){512, 0, 0});
#define GLASS                                                                                                       \
	"<shape type='cube'><transform name='to_world'><scale x='90' y='.5' z='90'/><translate y='5'/></transform>" \
	"<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/></bsdf></shape>"
	check_lit_floor("floor behind glass, under a tiny sphere", (struct lamp){0, 1e-5, 7, 1},
			GLASS "<shape type='sphere'><point name='center' x='3' y='7' z='1'/>"
			      "<float name='radius' value='1e-5'/><emitter type='area'/></shape>",
			(struct effort){64, 512, 0});
	check_lit_floor("floor behind glass, under a point", (struct lamp){0, 1 / sqrt(M_PI), 7, 1},
			GLASS "<emitter type='point'><point name='position' x='3' y='7' z='1'/></emitter>",
			(struct effort){64, 512, 0});
}

/* A beam straight down, wider than what the camera sees of the floor: M rho / pi. */
static void test_beam(void **state)
{
	(void)state;
	struct world *w = world_of_own_scene("beam", "floor.xml", 16, 16);
	check_constant("floor under a beam", w, 1.5 * 0.5 / M_PI, (struct effort){128, 832, 0});
}

/* The sun straight down through thin glass and a filter, which is between the camera and the floor, too. Glass reflects
 * r = 2 R / (1 + R), R = ((n - 1) / (n + 1))^2, and the filter lets half through each time: (1 - r) / 4 of M rho / pi.
 * No sub-path from either side alone gets to the floor without passing something, and neither end can be hit. */
static void test_seen_through(void **state)
{
	(void)state;
	const double n = 1.5, R = (n - 1) * (n - 1) / ((n + 1) * (n + 1));
	struct world *w = world_of_text(
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
	check_constant("floor seen through a filter", w, 3 * 0.5 / M_PI * (1 - 2 * R / (1 + R)) / 4,
		       (struct effort){128, 832, 0});
}

/* Two plates of reflectance rho, the lower shines with 1. Between infinite plates every ray from one meets the other.
 * Radiance of the lower: 1 + rho^2 + rho^4 ..., of the upper rho + rho^3 ... The plates are 4000 gaps wide, which
 * leaves out some 1e-6 of the light that the camera in the middle sees. */
static void test_plates(void **state)
{
	(void)state;
	const double rho = 0.6;
	static const char plates[] =
		"<shape type='rectangle'><transform name='to_world'><scale value='4000'/><rotate x='1' angle='-90'/></transform>"
		"<bsdf type='diffuse'><float name='reflectance' value='.6'/></bsdf><emitter type='area'/></shape>"
		"<shape type='rectangle'><transform name='to_world'><scale value='4000'/><rotate x='1' angle='90'/>"
		"<translate y='1'/></transform>"
		"<bsdf type='diffuse'><float name='reflectance' value='.6'/></bsdf></shape>";
	check_constant("lower plate", world_of_text(16, 16, DEPTH("6") SENSOR("0,0.5,0", "0.2,0,0.1") "%s", plates),
		       1 + pow(rho, 2) + pow(rho, 4), (struct effort){512, 0, 0});
	check_constant("upper plate", world_of_text(16, 16, DEPTH("6") SENSOR("0,0.5,0", "0.2,1,0.1") "%s", plates),
		       rho + pow(rho, 3) + pow(rho, 5), (struct effort){1024, 0, 0});
}

/* A lamp on the axis, some 400 times smaller than a pixel: `share` of the film shows its radiance 1. A sample of the
 * film meets it once in 100,000 times, so points of the lamp have to be joined to the lens. */
static void check_small_lamp(const char *name, const char *lamp, double share)
{
	static struct agree_image image;
	const char *const integrators[] = {"bdpt", "bdpt8", "erpt4", "pssmlt"};
	const uint64_t spp[] = {64, 256, 256, 512};
	struct world *w = world_of_text(16, 16, DEPTH("3") SENSOR("0,0,4", "0,0,0") "%s", lamp);
	for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
		char test[64];
		snprintf(test, sizeof test, "%s, %s", name, integrators[i]);
		struct agree_side side = {integrators[i], spp[i], 32, 0, 0};
		agree_render(w, test, integrators[i], &side, &image);
		for (uint32_t g = 0; g < image.groups; g++)
			for (int c = 0; c <= AGREE_CELLS; c++)
				image.mean[g][c] = image.mean[g][AGREE_CELLS] / (share * sum3(w->grey_xyz));
		remove_rounding(&image, 1, 1e-4); /* what samples of the film would add, if one met the lamp */
		agree_expect(test, &image, 1);
	}
	world_free(w);
}

static void test_small_lamp(void **state)
{
	(void)state;
	double slope = tan(20 * M_PI / 180); /* of the film's edge */
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
		cmocka_unit_test(test_furnace),
		cmocka_unit_test(test_furnace_all_around),
		cmocka_unit_test(test_furnace_far_lens),
		cmocka_unit_test(test_invisible),
		cmocka_unit_test(test_absorbing),
		cmocka_unit_test(test_camera_in_medium),
		cmocka_unit_test(test_white_media),
		cmocka_unit_test(test_scattered_once),
		cmocka_unit_test(test_seen_through_layer),
		cmocka_unit_test(test_beam_in_layer),
		cmocka_unit_test(test_lit_floor),
		cmocka_unit_test(test_beam),
		cmocka_unit_test(test_seen_through),
		cmocka_unit_test(test_plates),
		cmocka_unit_test(test_small_lamp),
	};
	const struct CMUnitTest longer[] = {cmocka_unit_test(test_half_space)}; /* half a minute */
	int failed = cmocka_run_group_tests(tests, NULL, NULL);
	return test_full() ? failed + cmocka_run_group_tests(longer, NULL, NULL) : failed;
}
