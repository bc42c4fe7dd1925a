/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images of what moves. What the camera sees of a card that slides, or turns, is the share of the time that it is
 * there, which is known: a ramp, and an integral over angles. And the image while the shutter is open is the mean of
 * images at the middles of 32 parts of that time, of worlds that stand still, placed by transforms that this test
 * writes itself; the rule of midpoints leaves 32^-2 of what changes. The integrators make it; bdpt is what erpt begins
 * with (tests/support/agree.h: level 1e-4 over the suite, power printed and bounded). Chains take a minute each: of
 * those, only hslt with a moving camera runs without FULL=1; test_balance has a room in which all of this moves.
 */
#include "tests/support/agree.h"
#include "tests/support/dice.h"
#include "tests/support/length.h"
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

/* ---- what the camera sees */

/* Whether a point of the film, which spans 2 x 2 around the origin, is on the card at that time. */
typedef bool covers_fn(double x, double y, double t);

static bool slides(double x, double y, double t)
{
	double middle = -0.6 + 1.0 * t;
	return fabs(x - middle) < 0.2 && fabs(y) < 0.5;
}

static bool turns(double x, double y, double t)
{
	double a = M_PI / 2 * t, u = cos(a) * x + sin(a) * y, v = -sin(a) * x + cos(a) * y;
	return fabs(u) < 0.8 && fabs(v) < 0.1;
}

/* Cells of the film: in each as many camera rays as chance wants meet the card. */
static void check_seen(const char *test, struct world *w, covers_fn *covers)
{
	enum { CELLS = 12, FINE = 24, TIMES = 2000 };
	static struct path_context c;
	static uint64_t counters[BATCH_COUNTERS];
	const struct plan p = {
		.width = CELLS, .height = CELLS, .crop_width = CELLS, .crop_height = CELLS, .max_depth = 1};
	static double seen[CELLS][CELLS], drawn[CELLS][CELLS], expected[CELLS * CELLS], got[CELLS * CELLS];
	size_t n = dice_count(200000), cells = 0;
	path_context_for_samples(&c, w, &p, counters);
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
		/* Binomial, with half a grid's step of the quadrature's own error. */
		double p1 = expected[i] * CELLS * CELLS / (double)n, variance = expected[i] * fmax(1 - p1, 0.01) + 1;
		chi2 += (got[i] - expected[i]) * (got[i] - expected[i]) / variance;
		most = fmax(most, fabs(got[i] / expected[i] - 1));
	}
	print_message("%s: chi^2 %.1f of %zu cells\n", test, chi2, cells);
	/* Level 1e-6: six standard deviations of chi^2 and more; a card at rest has hundreds of times that. */
	assert_true(chi2 < (double)cells + 6 * sqrt(2 * (double)cells) + 12);
	world_free(w);
}

static void test_seen(void **state)
{
	(void)state;
	check_seen("sliding",
		   world_of_text(12, 12,
				 FROM_ABOVE "<shape type='rectangle'>" KEYS(
					 "<scale x='0.2' y='0.5'/><translate x='-0.6'/>",
					 "<scale x='0.2' y='0.5'/><translate x='0.4'/>") "</shape>"),
		   slides);
	check_seen("turning",
		   world_of_text(12, 12,
				 FROM_ABOVE "<shape type='rectangle'>" KEYS(
					 "<scale x='0.8' y='0.1'/>",
					 "<scale x='0.8' y='0.1'/><rotate z='1' angle='90'/>") "</shape>"),
		   turns);
}

/* ---- all integrators */

enum { PARTS = 32 };

#define SHUTTER "<float name='shutter_open' value='1'/><float name='shutter_close' value='3'/>"
#define EYE                                                                                                  \
	"<sensor type='thinlens'><float name='fov' value='40'/><float name='aperture_radius' value='0.05'/>" \
	"<float name='focus_distance' value='5'/>" SHUTTER "%s" BOX_FILM "</sensor>"
#define FLOOR                                                                                              \
	"<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/>" \
	"<translate y='-1'/></transform><bsdf type='diffuse'><float name='reflectance' value='0.6'/></bsdf></shape>"
#define LAMP                                                                                                \
	"<shape type='rectangle'><transform name='to_world'><scale value='1.5'/><rotate x='1' angle='90'/>" \
	"<translate y='3'/></transform><emitter type='area'><float name='radiance' value='3'/></emitter></shape>"
#define SKY "<emitter type='constant'><float name='radiance' value='0.2'/></emitter>"
#define DEPTH "<integrator type='path'><integer name='max_depth' value='6'/></integrator>"
/* A card in front of the camera, a ball of glass that grows, a group of rough metal that turns, two lights. */
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

static void put_camera(char *out, size_t size, double t)
{
	snprintf(out, size,
		 "<rotate y='1' angle='%.17g'/><rotate x='1' angle='-15'/><translate x='%.17g' y='1.5' z='5'/>",
		 170 + 20 * t, -0.5 + t);
}

typedef void put_fn(char *out, size_t size, double t);

static void put_still(char *out, size_t size, put_fn *put, double t)
{
	char steps[256];
	put(steps, sizeof steps, t);
	snprintf(out, size, TO("%s"), steps);
}

static void put_moving(char *out, size_t size, put_fn *put)
{
	char begin[256], end[256];
	put(begin, sizeof begin, 0);
	put(end, sizeof end, 1);
	snprintf(out, size, KEYS("%s", "%s"), begin, end);
}

enum thing { EYES, CARDS, GLASSES, GROUPS, SPOTS, POINTS, THINGS };
static put_fn *const puts_of[THINGS] = {put_camera, put_card, put_glass, put_group, put_spot, put_point};

/* What moves; all else stands where it is at STILL. No integrator but those with light sub-paths finds light that
 * points and spots send through glass, so there is none beside them. */
enum stage { SHAPES, CAMERA, LIGHTS };
static const char *const names[] = {"motion", "moving camera", "moving lights"};
#define STILL 0.4

static bool moves(enum stage s, enum thing i)
{
	return s == CAMERA ? i == EYES : s == SHAPES ? i >= CARDS && i <= GROUPS : i == SPOTS || i == POINTS;
}

/* At time t, or, below 0, as it moves. */
static struct world *world_at(enum stage s, double t)
{
	char place[THINGS][768];
	for (enum thing i = 0; i < THINGS; i++)
		if (!moves(s, i))
			put_still(place[i], sizeof place[i], puts_of[i], STILL);
		else if (t < 0)
			put_moving(place[i], sizeof place[i], puts_of[i]);
		else
			put_still(place[i], sizeof place[i], puts_of[i], t);
	return s == LIGHTS ? world_of_text(16, 16, DEPTH EYE FLOOR SKY CARD SPOT POINT, place[EYES], place[CARDS],
					   place[SPOTS], place[POINTS])
			   : world_of_text(16, 16, DEPTH EYE FLOOR LAMP SKY CARD GLASS GROUP, place[EYES], place[CARDS],
					   place[GLASSES], place[GROUPS]);
}

static void mean_of_stills(enum stage s, struct agree_image *out)
{
	static struct agree_image part;
	memset(out, 0, sizeof *out);
	for (int i = 0; i < PARTS; i++) {
		char side[32];
		struct world *w = world_at(s, (i + 0.5) / PARTS);
		const struct agree_side how = {"bdpt", 320, 32, 0, 0};
		snprintf(side, sizeof side, "still %d", i);
		agree_render(w, names[s], side, &how, &part);
		out->groups = part.groups;
		for (uint32_t g = 0; g < part.groups; g++)
			for (int c = 0; c <= AGREE_CELLS; c++)
				out->mean[g][c] += part.mean[g][c] / PARTS;
		world_free(w);
	}
}

static void check_integrators(enum stage s, const struct agree_side *sides, size_t count)
{
	static struct agree_image stills, image;
	mean_of_stills(s, &stills);
	struct world *w = world_at(s, -1);
	assert_true(w->effects.motion && !w->effects.colour);
	for (size_t i = 0; i < count; i++) {
		char test[64];
		snprintf(test, sizeof test, "%s, %s", names[s], sides[i].integrator);
		agree_render(w, test, "moving", &sides[i], &image);
		agree_check(test, &image, &stills);
	}
	world_free(w);
	/* Where everything is when the shutter opens, it is another image: the comparison can tell. */
	struct agree_difference d;
	const struct agree_side how = {"bdpt", 8192, 32, 0, 0};
	w = world_at(s, 0);
	agree_render(w, "motion", "when it opens", &how, &image);
	agree_measure(&image, &stills, &d);
	assert_false(d.holds);
	world_free(w);
}

static void test_shapes(void **state)
{
	(void)state;
	static const struct agree_side sides[] = {{"path", 16384, 32, 0, 0},
						  {"erpt", 12288, 32, 0, 0},
						  {"pssmlt", 65536, 32, 0, 0},
						  {"hslt", 98304, 32, 0, 0}};
	check_integrators(SHAPES, sides, test_full() ? 4 : 2);
}

static void test_camera(void **state)
{
	(void)state;
	static const struct agree_side sides[] = {{"hslt", 98304, 32, 0, 0}};
	check_integrators(CAMERA, sides, sizeof sides / sizeof *sides);
}

static void test_lights(void **state)
{
	(void)state;
	static const struct agree_side sides[] = {
		{"path", 8192, 32, 0, 0}, {"bdpt", 8192, 32, 0, 0}, {"hslt", 163840, 32, 0, 0}};
	check_integrators(LIGHTS, sides, test_full() ? 3 : 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_seen),
		cmocka_unit_test(test_shapes),
		cmocka_unit_test(test_camera),
		cmocka_unit_test(test_lights),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
