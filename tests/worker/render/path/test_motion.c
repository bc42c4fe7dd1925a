/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images of moving scenes. The visibility of a card that slides or turns is the share of the time during which it
 * covers a point, which is known: a ramp, and an integral over angles. And the image over the open shutter is the
 * mean of images at the midpoints of 32 parts of this interval, rendered from static worlds placed by transforms that
 * this test computes itself; the midpoint rule errs by 32^-2 of the change. The integrators are tested one by one,
 * except that bdpt also stands for the samples with which erpt starts. Statistics as in tests/support/agreement.h
 * (level 1e-4 over the suite, power printed and bounded). Chains take a minute each and run with FULL=1 only;
 * test_balance.c has a room in which all of this moves. Moving lights over a plane: test_moving_lights.c.
 */
#include "tests/support/agreement.h"
#include "tests/support/dice.h"
#include "tests/support/test_length.h"
#include "tests/support/memory_assets.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/path/path.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define TO(inner) "<transform name='to_world'>" inner "</transform>"
#define KEYS(a, b)                                                                                              \
	"<animation name='to_world'><transform time='1'>" a "</transform><transform time='3'>" b "</transform>" \
	"</animation>"
#define BOX_FILM "<film type='hdrfilm'><rfilter type='box'/></film>"
#define FROM_ABOVE                                                                                                      \
	"<sensor type='orthographic'><float name='shutter_open' value='1'/><float name='shutter_close' value='3'/>" TO( \
		"<lookat origin='0,0,5' target='0,0,0' up='0,1,0'/>") BOX_FILM "</sensor>"

/* ---- what the camera sees ---- */

/* Returns whether the card covers a point of the film at time t. The film spans 2 x 2 around the origin. */
typedef bool covers_fn(double x, double y, double t);

static bool card_slides_over(double x, double y, double t)
{
	double middle = -0.6 + 1.0 * t;
	return fabs(x - middle) < 0.2 && fabs(y) < 0.5;
}

static bool card_turns_over(double x, double y, double t)
{
	double a = M_PI / 2 * t, u = cos(a) * x + sin(a) * y, v = -sin(a) * x + cos(a) * y;
	return fabs(u) < 0.8 && fabs(v) < 0.1;
}

/* Counts the camera rays that meet the card in each cell of the film, and fails unless the counts fit the expected
 * shares. */
static void check_seen(const char *test, struct world *w, covers_fn *covers)
{
	enum { CELLS = 12, FINE = 24, TIMES = 2000 };
	static struct path_context c;
	static uint64_t counters[BATCH_COUNTERS];
	const struct plan p = {
		.width = CELLS, .height = CELLS, .crop_width = CELLS, .crop_height = CELLS, .max_depth = 1};
	static double seen[CELLS][CELLS], drawn[CELLS][CELLS], expected[CELLS * CELLS], got[CELLS * CELLS];
	size_t n = dice_scaled_count(200000), cells = 0;
	path_context_init_for_samples(&c, w, &p, counters);
	memset(seen, 0, sizeof seen);
	memset(drawn, 0, sizeof drawn);
	for (size_t i = 0; i < n; i++) {
		struct sampler_random s;
		double film[2];
		sampler_random_init(&s, 11, RNG_TEST, i, 0);
		path_walk_camera(&c, &s.base, 2, film);
		int x = (int)film[0], y = (int)film[1];
		drawn[y][x]++;
		seen[y][x] += c.camera[1].kind == VERTEX_SURFACE;
		assert_true(c.camera[0].x.prim.time == c.time && c.camera[1].x.prim.time == c.time);
	}
	for (int y = 0; y < CELLS; y++)
		for (int x = 0; x < CELLS; x++) {
			double share = 0;
			for (int i = 0; i < FINE * FINE; i++)
				for (int k = 0; k < TIMES / FINE; k++)
					share += covers(2 * (x + (i % FINE + 0.5) / FINE) / CELLS - 1,
							1 - 2 * (y + (i / FINE + 0.5) / FINE) / CELLS,
							(k + 0.5) / (TIMES / FINE));
			share /= FINE * FINE * (TIMES / FINE);
			if (share == 0) {
				assert_true(seen[y][x] == 0);
				continue;
			}
			expected[cells] = share * drawn[y][x];
			got[cells++] = seen[y][x];
		}
	assert_true(cells > 10);
	double chi2 = 0, most = 0;
	for (size_t i = 0; i < cells; i++) {
		/* Binomial variance, plus the error of the quadrature: half a step of its grid. */
		double p1 = expected[i] * CELLS * CELLS / (double)n, variance = expected[i] * fmax(1 - p1, 0.01) + 1;
		chi2 += (got[i] - expected[i]) * (got[i] - expected[i]) / variance;
		most = fmax(most, fabs(got[i] / expected[i] - 1));
	}
	print_message("%s: chi^2 %.1f of %zu cells\n", test, chi2, cells);
	/* Level 1e-6: at least six standard deviations of chi^2; a card at rest yields hundreds of times as much. */
	assert_true(chi2 < (double)cells + 6 * sqrt(2 * (double)cells) + 12);
	world_free(w);
}

static void moving_card_covers_its_share_of_the_time(void **state)
{
	(void)state;
	check_seen("sliding",
		   world_from_text(12, 12,
				   FROM_ABOVE "<shape type='rectangle'>" KEYS(
					   "<scale x='0.2' y='0.5'/><translate x='-0.6'/>",
					   "<scale x='0.2' y='0.5'/><translate x='0.4'/>") "</shape>"),
		   card_slides_over);
	check_seen("turning",
		   world_from_text(12, 12,
				   FROM_ABOVE "<shape type='rectangle'>" KEYS(
					   "<scale x='0.8' y='0.1'/>",
					   "<scale x='0.8' y='0.1'/><rotate z='1' angle='90'/>") "</shape>"),
		   card_turns_over);
}

/* ---- all integrators ---- */

enum { PARTS = 32 };

#define SHUTTER "<float name='shutter_open' value='1'/><float name='shutter_close' value='3'/>"
#define EYE                                                                                                  \
	"<sensor type='thinlens'><float name='fov' value='40'/><float name='aperture_radius' value='0.05'/>" \
	"<float name='focus_distance' value='5'/>" SHUTTER "%s" BOX_FILM "</sensor>"
#define FLOOR                                                                                              \
	"<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/>" \
	"<translate y='-1'/></transform><bsdf type='diffuse'><float name='reflectance' value='0.6'/></bsdf></shape>"
#define SHINES(radiance) "<emitter type='area'><float name='radiance' value='" radiance "'/></emitter>"
#define LAMP                                                                                                \
	"<shape type='rectangle'><transform name='to_world'><scale value='1.5'/><rotate x='1' angle='90'/>" \
	"<translate y='3'/></transform>" SHINES("3") "</shape>"
#define SKY "<emitter type='constant'><float name='radiance' value='0.2'/></emitter>"
#define DEPTH "<integrator type='path'><integer name='max_depth' value='6'/></integrator>"
/* A card in front of the camera, a glass ball that grows, a group of rough metal that turns, and two lights. */
#define CARD "<shape type='rectangle'>%s<bsdf type='diffuse'><float name='reflectance' value='0.3'/></bsdf></shape>"
#define GLASS "<shape type='sphere'>%s<bsdf type='dielectric'/></shape>"
#define GROUP                                                                                            \
	"<shape type='shapegroup' id='g'><shape type='cube'><transform name='to_world'>"                 \
	"<scale x='0.8' y='0.3' z='0.3'/></transform><bsdf type='roughconductor'>"                       \
	"<string name='material' value='none'/><float name='alpha' value='0.2'/></bsdf></shape></shape>" \
	"<shape type='instance'><ref id='g'/>%s</shape>"
#define SPOT \
	"<emitter type='spot'>%s<float name='intensity' value='2'/><float name='cutoff_angle' value='40'/></emitter>"
#define POINT "<emitter type='point'>%s<float name='intensity' value='0.6'/></emitter>"

/* Emitting shapes: a card, a ball, and a group with a cube. The first and the last are stretched as well. */
#define CARD_LAMP "<shape type='rectangle'>%s" SHINES("2") "</shape>"
#define BALL_LAMP "<shape type='sphere'>%s" SHINES("2") "</shape>"
#define GROUP_LAMP                                                                                           \
	"<shape type='shapegroup' id='l'><shape type='cube'><transform name='to_world'><scale value='0.3'/>" \
	"<rotate x='1' y='1' angle='50'/></transform>" SHINES("1") "</shape></shape>"                        \
								   "<shape type='instance'><ref id='l'/>%s</shape>"
/* Lights at infinity. */
#define SUN "<emitter type='directional'>%s<float name='irradiance' value='0.5'/></emitter>"
#define PICTURE "<emitter type='envmap'>%s<string name='filename' value='e.pgm'/></emitter>"
/* A ball of an emitting medium. */
#define GLOW                                                                                    \
	"<shape type='sphere'>%s<bsdf type='null'/><medium type='homogeneous' name='interior'>" \
	"<float name='sigma_t' value='0.5'/><spectrum name='albedo' value='0.3'/></medium>"     \
	"<emitter type='volumelight'><float name='radiance' value='2'/></emitter></shape>"

static void put_card(char *out, size_t size, double t)
{
	snprintf(out, size, "<scale x='0.3' y='0.5'/><translate x='%.17g' y='0.3' z='1.5'/>", -1 + 1.7 * t);
}

static void put_glass(char *out, size_t size, double t)
{
	snprintf(out, size, "<scale value='%.17g'/><translate x='0.9' y='%.17g' z='0.3'/>", 0.4 + 0.3 * t,
		 -0.4 + 0.5 * t);
}

static void put_group(char *out, size_t size, double t)
{
	snprintf(out, size, "<rotate y='1' angle='%.17g'/><translate x='-0.8' y='-0.5'/>", 100 * t);
}

static void put_spot(char *out, size_t size, double t)
{
	snprintf(out, size,
		 "<rotate x='1' angle='90'/><rotate z='1' angle='%.17g'/><translate x='%.17g' y='2.5' z='1'/>",
		 -30 + 60 * t, -0.3 - 0.5 * t);
}

static void put_point(char *out, size_t size, double t)
{
	snprintf(out, size, "<translate x='%.17g' y='1' z='0.5'/>", 1 - 2 * t);
}

static void put_card_lamp(char *out, size_t size, double t)
{
	snprintf(out, size,
		 "<scale x='%.17g' y='%.17g'/><rotate x='1' angle='90'/><rotate z='1' angle='%.17g'/>"
		 "<translate x='%.17g' y='1.6' z='0.3'/>",
		 0.2 + 0.6 * t, 0.5 - 0.3 * t, -40 + 60 * t, -1 + 1.6 * t);
}

static void put_ball_lamp(char *out, size_t size, double t)
{
	snprintf(out, size, "<scale value='%.17g'/><translate x='0.9' y='%.17g' z='0.6'/>", 0.15 + 0.25 * t,
		 -0.3 + 0.9 * t);
}

static void put_group_lamp(char *out, size_t size, double t)
{
	snprintf(out, size,
		 "<scale x='%.17g' z='%.17g'/><rotate y='1' angle='%.17g'/><translate x='-0.9' y='-0.3' z='%.17g'/>",
		 0.5 + t, 1.5 - t, 80 * t, -0.5 + t);
}

static void put_sun(char *out, size_t size, double t)
{
	snprintf(out, size, "<rotate x='1' angle='90'/><rotate z='1' angle='%.17g'/>", -50 + 90 * t);
}

static void put_picture(char *out, size_t size, double t)
{
	snprintf(out, size, "<rotate y='1' angle='%.17g'/><rotate x='1' angle='20'/>", 120 * t);
}

static void put_glow(char *out, size_t size, double t)
{
	snprintf(out, size, "<scale value='%.17g'/><translate x='%.17g' y='-0.2' z='0.3'/>", 0.5 + 0.2 * t, -0.6 + t);
}

static void put_camera(char *out, size_t size, double t)
{
	snprintf(out, size,
		 "<rotate y='1' angle='%.17g'/><rotate x='1' angle='-15'/><translate x='%.17g' y='1.5' z='5'/>",
		 170 + 20 * t, -0.5 + t);
}

typedef void put_part_fn(char *out, size_t size, double t);

static void put_still(char *out, size_t size, put_part_fn *put, double t)
{
	char steps[256];
	put(steps, sizeof steps, t);
	snprintf(out, size, TO("%s"), steps);
}

static void put_moving(char *out, size_t size, put_part_fn *put)
{
	char begin[256], end[256];
	put(begin, sizeof begin, 0);
	put(end, sizeof end, 1);
	snprintf(out, size, KEYS("%s", "%s"), begin, end);
}

enum scene_part {
	EYES,
	CARDS,
	GLASSES,
	GROUPS,
	SPOTS,
	POINTS,
	CARD_LAMPS,
	BALL_LAMPS,
	GROUP_LAMPS,
	SUNS,
	PICTURES,
	GLOWS,
	SCENE_PARTS
};
static put_part_fn *const part_writers[SCENE_PARTS] = {put_camera,     put_card,  put_glass,	 put_group,
						       put_spot,       put_point, put_card_lamp, put_ball_lamp,
						       put_group_lamp, put_sun,	  put_picture,	 put_glow};

/* The parts of the scene that move: one stage each, from the first to the last; the remaining parts stand at their
 * position for REST_TIME. Only integrators with light sub-paths find the light that points and spots send through
 * glass, so the scene with these lights has no glass. */
enum stage { SHAPES, CAMERA, LIGHTS, LAMPS, SKIES, MEDIA };
static const struct {
	const char *name;
	enum scene_part first, last;
} stages[] = {{"motion", CARDS, GROUPS},	{"moving camera", EYES, EYES},
	      {"moving lights", SPOTS, POINTS}, {"moving lamps", CARD_LAMPS, GROUP_LAMPS},
	      {"moving skies", SUNS, PICTURES}, {"moving glow", GLOWS, GLOWS}};
#define REST_TIME 0.4

/* A world that has a picture of the sky among its files. */
__attribute__((format(printf, 1, 2))) static struct world *world_from_format(const char *format, ...)
{
	static char xml[1 << 14];
	static const char sky[] = "P5 4 2 255\n\x90\xff\x40\x20\x60\x30\x50\x40";
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(xml, sizeof xml, format, ap);
	va_end(ap);
	assert_true(n > 0 && (size_t)n < sizeof xml);
	const struct memory_file files[] = {{"s.xml", xml, (size_t)n}, {"e.pgm", sky, sizeof sky - 1}, {NULL, NULL, 0}};
	return world_from_files(16, 16, files);
}

/* Returns the static world at time t, or the moving world if t is negative. */
static struct world *world_at(enum stage s, double t)
{
	char place[SCENE_PARTS][768];
	for (enum scene_part i = 0; i < SCENE_PARTS; i++)
		if (i < stages[s].first || i > stages[s].last)
			put_still(place[i], sizeof place[i], part_writers[i], REST_TIME);
		else if (t < 0)
			put_moving(place[i], sizeof place[i], part_writers[i]);
		else
			put_still(place[i], sizeof place[i], part_writers[i], t);
#define SCENE(inner) "<scene version='3.0.0'>" DEPTH EYE FLOOR inner "</scene>", place[EYES]
	switch (s) {
	case LIGHTS:
		return world_from_format(SCENE(SKY CARD SPOT POINT), place[CARDS], place[SPOTS], place[POINTS]);
	case LAMPS:
		return world_from_format(SCENE(SKY CARD CARD_LAMP BALL_LAMP GROUP_LAMP), place[CARDS],
					 place[CARD_LAMPS], place[BALL_LAMPS], place[GROUP_LAMPS]);
	case SKIES:
		return world_from_format(SCENE(CARD SUN PICTURE), place[CARDS], place[SUNS], place[PICTURES]);
	case MEDIA:
		return world_from_format(
			"<scene version='3.0.0'><integrator type='volpath'><integer name='max_depth' value='6'/>"
			"</integrator>" EYE FLOOR SKY CARD GLOW "</scene>",
			place[EYES], place[CARDS], place[GLOWS]);
	default:
		return world_from_format(SCENE(LAMP SKY CARD GLASS GROUP), place[CARDS], place[GLASSES], place[GROUPS]);
	}
}

static void mean_of_stills(enum stage s, struct agreement_image *out)
{
	static struct agreement_image part;
	memset(out, 0, sizeof *out);
	for (int i = 0; i < PARTS; i++) {
		char side[32];
		struct world *w = world_at(s, (i + 0.5) / PARTS);
		const struct agreement_options options = {"bdpt", 320, 32, 0, 0};
		snprintf(side, sizeof side, "still %d", i);
		agreement_render(w, stages[s].name, side, &options, &part);
		out->groups = part.groups;
		for (uint32_t g = 0; g < part.groups; g++)
			for (int c = 0; c <= AGREEMENT_CELLS; c++)
				out->mean[g][c] += part.mean[g][c] / PARTS;
		world_free(w);
	}
}

static void check_integrators(enum stage s, const struct agreement_options *sides, size_t count)
{
	static struct agreement_image stills, image;
	mean_of_stills(s, &stills);
	struct world *w = world_at(s, -1);
	assert_true(w->effects.motion && !w->effects.colour);
	for (size_t i = 0; i < count; i++) {
		char test[64];
		snprintf(test, sizeof test, "%s, %s", stages[s].name, sides[i].integrator);
		agreement_render(w, test, "moving", &sides[i], &image);
		agreement_check(test, &image, &stills);
	}
	world_free(w);
	/* The image of the static world at the opening of the shutter differs, so the comparison can tell them apart.
	 */
	struct agreement_difference d;
	const struct agreement_options options = {"bdpt", test_is_scaled() ? 8192 : 1024, 32, 0, 0};
	w = world_at(s, 0);
	agreement_render(w, "motion", "when it opens", &options, &image);
	agreement_measure(&image, &stills, &d);
	assert_false(d.agrees);
	world_free(w);
}

static void integrators_agree_on_moving_shapes(void **state)
{
	(void)state;
	static const struct agreement_options sides[] = {{"path", 16384, 32, 0, 0},
							 {"erpt", 12288, 32, 0, 0},
							 {"pssmlt", 65536, 32, 0, 0},
							 {"hslt", 98304, 32, 0, 0}};
	check_integrators(SHAPES, sides, test_is_full() ? 4 : 2);
}

static void integrators_agree_for_a_moving_camera(void **state)
{
	(void)state;
	static const struct agreement_options sides[] = {{"path", 8192, 32, 0, 0}, {"hslt", 98304, 32, 0, 0}};
	check_integrators(CAMERA, sides, test_is_full() ? 2 : 1);
}

static void integrators_agree_on_moving_delta_lights(void **state)
{
	(void)state;
	static const struct agreement_options sides[] = {
		{"path", 1280, 32, 0, 0}, {"bdpt", 1280, 32, 0, 0}, {"hslt", 163840, 32, 0, 0}};
	check_integrators(LIGHTS, sides, test_is_full() ? 3 : 2);
}

static void integrators_agree_on_moving_lamps(void **state)
{
	(void)state;
	static const struct agreement_options sides[] = {
		{"path", 8704, 32, 0, 0},   {"bdpt", 8192, 32, 0, 0},	{"erpt", 8192, 32, 0, 0},
		{"bdpt8", 12288, 32, 0, 0}, {"erpt4", 12288, 32, 0, 0}, {"pssmlt", 65536, 32, 0, 0},
		{"hslt", 458752, 32, 0, 0},
	};
	check_integrators(LAMPS, sides, test_is_full() ? 7 : 2);
}

static void integrators_agree_on_moving_skies(void **state)
{
	(void)state;
	static const struct agreement_options sides[] = {
		{"path", 1664, 32, 0, 0}, {"bdpt", 2688, 32, 0, 0}, {"hslt", 163840, 32, 0, 0}};
	check_integrators(SKIES, sides, test_is_full() ? 3 : 2);
}

static void integrators_agree_on_a_moving_glow(void **state)
{
	(void)state;
	static const struct agreement_options sides[] = {{"bdpt", 11520, 32, 0, 0}, {"path", 16384, 32, 0, 0}};
	check_integrators(MEDIA, sides, test_is_full() ? 2 : 1);
}

/* ---- at rest ---- */

/* A lamp whose transforms are all equal, and one that would move only while the shutter is closed, give the same bits
 * as static lamps. */
static void equal_keyframes_give_the_bits_of_a_static_lamp(void **state)
{
	(void)state;
	static struct agreement_image still, image;
	static const char *const places[] = {
		TO("<translate x='0.25' z='1.5'/>"),
		KEYS("<translate x='0.25' z='1.5'/>", "<translate x='0.25' z='1.5'/>"),
		("<animation name='to_world'><transform time='3'><translate x='0.25' z='1.5'/></transform>"
		 "<transform time='4'><translate x='2'/></transform></animation>")};
	for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
		struct world *w =
			world_from_format("<scene version='3.0.0'>" DEPTH EYE FLOOR CARD_LAMP "</scene>",
					  TO("<lookat origin='0,1,5' target='0,0,0' up='0,1,0'/>"), places[i]);
		const struct agreement_options options = {"bdpt", 16, 16, 0, 0};
		assert_false(w->effects.motion);
		agreement_render(w, "at rest", "a lamp", &options, i ? &image : &still);
		assert_true(i == 0 || memcmp(image.mean, still.mean, sizeof still.mean) == 0);
		world_free(w);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(moving_card_covers_its_share_of_the_time),
		cmocka_unit_test(integrators_agree_on_moving_shapes),
		cmocka_unit_test(integrators_agree_for_a_moving_camera),
		cmocka_unit_test(integrators_agree_on_moving_delta_lights),
		cmocka_unit_test(integrators_agree_on_moving_lamps),
		cmocka_unit_test(integrators_agree_on_moving_skies),
		cmocka_unit_test(integrators_agree_on_a_moving_glow),
		cmocka_unit_test(equal_keyframes_give_the_bits_of_a_static_lamp),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
