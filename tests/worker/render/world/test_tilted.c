/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A normal map of one colour against a rectangle that is really tilted. Seen from one direction and lit from one, both
 * are equally bright all over.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/pictures.h"
#include "tests/support/render_picture.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 16 };

#define VIEW                                                                                                         \
	"<sensor type='orthographic'><transform name='to_world'><lookat origin='2,-1,9' target='0,0,0' up='0,1,0'/>" \
	"</transform><film type='hdrfilm'><rfilter type='box'/></film></sensor>"
#define SUN "<emitter type='directional'><vector name='direction' x='-1' y='-2' z='-4'/></emitter>"
#define WIDE "<scale value='100'/>"

static double brightness(const char *turn, const char *bsdf, const struct picture_file *map)
{
	char xml[2048];
	int n = snprintf(xml, sizeof xml,
			 "<scene version='3.0.0'>" VIEW SUN "<shape type='rectangle'><transform name='to_world'>" WIDE
			 "%s</transform>%s</shape></scene>",
			 turn, bsdf);
	assert_true(n > 0 && (size_t)n < sizeof xml);
	const struct memory_file files[] = {{"s.xml", xml, (size_t)n}, {"p0", map->bytes, map->size}, {NULL, NULL, 0}};
	struct world *w = world_of_files(SIDE, SIDE, files);
	const struct render_picture_how how = {.integrator = "path", .test = "tilted", .spp = 4, .max_depth = 2};
	struct picture p;
	render_picture_xyz(w, &how, &p);
	double middle = (double)p.rgb[1][SIDE * SIDE / 2 + SIDE / 2];
	picture_fini(&p);
	world_free(w);
	assert_true(middle > 0);
	return middle;
}

/* The map's normal leans by x and y for 0.75 of height. */
static void tilts(const char *bsdf, double x, double y)
{
	struct pictures p = {.count = 0};
	char turn[128], bent[1024];
	pictures_add(&p, 1, 1, (const double[]){(1 + x) / 2, (1 + y) / 2, 0.875});
	/* About the axis that is square to (x, y), from z towards it. */
	snprintf(turn, sizeof turn, "<rotate x='%.17g' y='%.17g' z='0' angle='%.17g'/>", -y, x,
		 atan2(hypot(x, y), 0.75) * 180 / acos(-1));
	snprintf(bent, sizeof bent,
		 "<bsdf type='normalmap'><texture type='bitmap'><string name='filename' value='p0'/>"
		 "<boolean name='raw' value='true'/></texture>%s</bsdf>",
		 bsdf);
	double map = brightness("", bent, &p.file[0]), real = brightness(turn, bsdf, &p.file[0]),
	       flat = brightness("", bsdf, &p.file[0]);
	print_message("leaning by %g, %g: map %.9g, tilted %.9g, flat %.9g\n", x, y, map, real, flat);
	if (!(fabs(map - real) <= 1e-5 * real && fabs(flat - real) > 0.02 * real))
		fail_msg("%s: %.9g with the map, %.9g tilted, %.9g flat", bsdf, map, real, flat);
	pictures_fini(&p);
}

static void test_tilted(void **state)
{
	(void)state;
	static const char *const bsdf[] = {
		"<bsdf type='diffuse'/>",
		"<bsdf type='roughconductor'><float name='alpha' value='0.5'/></bsdf>",
		"<bsdf type='roughplastic'><float name='alpha' value='0.4'/></bsdf>",
	};
	static const double lean[][2] = {{0.25, 0}, {-0.25, 0}, {0, 0.25}, {0, -0.25}, {0.375, 0.125}};
	for (size_t i = 0; i < sizeof bsdf / sizeof *bsdf; i++)
		for (size_t k = 0; k < sizeof lean / sizeof *lean; k++)
			tilts(bsdf[i], lean[k][0], lean[k][1]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_tilted)};
	return cmocka_run_group_tests_name("tilted", tests, NULL, NULL);
}
