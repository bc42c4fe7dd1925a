/* SPDX-License-Identifier: Apache-2.0 */
/* Small closed scenes for tests of mutations, one for each feature. The caller frees the world. */
#ifndef TESTS_WORKER_MUTATION_SCENES_H
#define TESTS_WORKER_MUTATION_SCENES_H

#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"

#include <stdio.h>
#include <string.h>

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
#define DIFFUSE(rgb) "<bsdf type='diffuse'><rgb name='reflectance' value='" rgb "'/></bsdf>"
/* clang-format off */
#define ROUGH_GLASS(alpha)                                                                                                      \
	"<bsdf type='roughdielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/><float name='alpha' "   \
	"value='" alpha "'/></bsdf>"
/* clang-format on */
#define GLASS "<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/></bsdf>"
/* clang-format off */
#define METAL(alpha)                                                                                                            \
	"<bsdf type='roughconductor'><string name='material' value='Au'/><string name='distribution' value='ggx'/>"               \
	"<float name='alpha' value='" alpha "'/></bsdf>"
/* clang-format on */
#define VIEW SENSOR("0,0.2,1.9", "0,-0.3,-1")
/* clang-format off */
#define LENS                                                                                                                    \
	"<sensor type='thinlens'><float name='fov' value='40'/><float name='aperture_radius' value='0.1'/><float "                \
	"name='focus_distance' value='2.4'/><transform name='to_world'><lookat origin='0,0.2,1.9' target='0,-0.3,-1' "             \
	"up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"      \
	"<rfilter type='box'/></film></sensor>"
/* clang-format on */
/* A closed room of side 4; the camera looks from the front wall to the back. */
#define WALLS "<shape type='cube'>" AT("<scale value='2'/>") DIFFUSE("0.5,0.45,0.35") "</shape>"
/* clang-format off */
#define LAMP                                                                                                                    \
	"<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>")                       \
	DIFFUSE("0.2,0.2,0.2") "<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>"
/* clang-format on */
#define BALL(center, radius, bsdf)                                                                                     \
	"<shape type='sphere'><point name='center' value='" center "'/><float name='radius' value='" radius "'/>" bsdf \
	"</shape>"
#define PLATE(y, bsdf)                                                                                              \
	"<shape type='rectangle'>" AT("<scale value='1.9'/><rotate x='1' angle='-90'/><translate y='" y "'/>") bsdf \
		"</shape>"

struct test_scene {
	const char *name, *xml;
	bool uses_mesh; /* the scene uses ball.obj, a file in memory */
};

static const struct test_scene test_scenes[] = {
	{"diffuse", VIEW WALLS LAMP BALL("0.3,-0.7,-0.3", "0.7", DIFFUSE("0.7,0.2,0.1")), false},
	{"glossy", VIEW WALLS LAMP PLATE("-1.2", METAL("0.15")) BALL("0.4,-0.5,-0.6", "0.6", METAL("0.3")), false},
	{"rough glass", VIEW WALLS LAMP BALL("0,-0.6,-0.3", "0.8", ROUGH_GLASS("0.25")), false},
	{"smooth glass", VIEW WALLS LAMP BALL("0,-0.6,-0.3", "0.8", GLASS), false},
	{"specular chain",
	 VIEW WALLS LAMP PLATE("-1.4", "<bsdf type='conductor'/>") BALL("-0.5,-0.7,-0.3", "0.6", GLASS)
		 BALL("0.7,-0.6,-0.4", "0.5", METAL("0.2")),
	 false},
	{"bent normals",
	 VIEW WALLS LAMP "<shape type='obj'><string name='filename' value='ball.obj'/>" ROUGH_GLASS("0.25") "</shape>",
	 true},
	/* clang-format off */
	{"environment",
	 SENSOR("0,1,5", "0,0,0")
	 PLATE("-1", DIFFUSE("0.5,0.5,0.6"))
	 BALL("0,0,0", "1", ROUGH_GLASS("0.3"))
	 "<emitter type='constant'><rgb name='radiance' value='0.8,0.9,1'/></emitter>",
	 false},
	{"delta emitters",
	 VIEW WALLS
	 BALL("0.2,-0.7,-0.3", "0.7", METAL("0.3"))
	 "<emitter type='point'><point name='position' value='0.5,1.5,0.5'/><rgb name='intensity' value='3,2,1'/></emitter>"
	 "<emitter type='spot'>"
		"<float name='cutoff_angle' value='50'/>"
		"<rgb name='intensity' value='1,2,3'/>"
		AT("<lookat origin='-1,1.6,0' target='0,-1,-0.5' up='1,0,0'/>")
	 "</emitter>",
	 false},
	{"sun",
	 SENSOR("0,1,5", "0,0,0")
	 PLATE("-1", DIFFUSE("0.5,0.5,0.6"))
	 BALL("0,0,0", "1", METAL("0.3"))
	 "<emitter type='directional'>"
		"<vector name='direction' value='0.5,-1,-0.4'/>"
		"<rgb name='irradiance' value='3,2.5,2'/>"
	 "</emitter>",
	 false},
	/* clang-format on */
	{"dispersion",
	 VIEW WALLS LAMP BALL("0,-0.6,-0.3", "0.8",
			      "<bsdf type='roughdielectric'><string name='int_ior' value='sf11'/>"
			      "<boolean name='dispersion' value='true'/><float name='alpha' value='0.25'/></bsdf>"),
	 false},
	{"dispersion, smooth",
	 VIEW WALLS LAMP BALL("0,-0.6,-0.3", "0.8",
			      "<bsdf type='dielectric'><string name='int_ior' value='sf11'/>"
			      "<boolean name='dispersion' value='true'/></bsdf>"),
	 false},
	{"aperture", LENS WALLS LAMP BALL("0,-0.6,-0.3", "0.8", ROUGH_GLASS("0.25")), false},
};
enum { TEST_SCENES = sizeof test_scenes / sizeof *test_scenes };

/* Writes a ball of 8 by 4 faces with the normals of a sphere; returns the size. */
static inline size_t write_ball_obj(char *text, size_t size)
{
	enum { AROUND = 8, UP = 4 };
	size_t n = 0;
	for (int i = 0; i <= UP; i++)
		for (int j = 0; j < AROUND; j++) {
			double t = M_PI * i / UP, p = 2 * M_PI * j / AROUND, x = sin(t) * cos(p), y = cos(t),
			       z = sin(t) * sin(p);
			n += (size_t)snprintf(text + n, size - n, "v %.9g %.9g %.9g\nvn %.9g %.9g %.9g\n", 0.8 * x,
					      0.8 * y - 0.6, 0.8 * z - 0.3, x, y, z);
		}
	for (int i = 0; i < UP; i++)
		for (int j = 0; j < AROUND; j++) {
			int a = i * AROUND + j + 1, b = i * AROUND + (j + 1) % AROUND + 1, c = b + AROUND,
			    d = a + AROUND;
			if (i > 0)
				n += (size_t)snprintf(text + n, size - n, "f %d//%d %d//%d %d//%d\n", a, a, b, b, c, c);
			if (i + 1 < UP)
				n += (size_t)snprintf(text + n, size - n, "f %d//%d %d//%d %d//%d\n", a, a, c, c, d, d);
		}
	return n;
}

static inline struct world *make_test_world(const char *name)
{
	static char xml[1 << 14], obj[1 << 14];
	for (int i = 0; i < TEST_SCENES; i++) {
		const struct test_scene *s = &test_scenes[i];
		if (strcmp(s->name, name) != 0)
			continue;
		if (!s->uses_mesh)
			return world_from_text(32, 32, "%s", s->xml);
		int n = snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", s->xml);
		const struct memory_file files[] = {{"test.xml", xml, (size_t)n},
						    {"ball.obj", obj, write_ball_obj(obj, sizeof obj)},
						    {NULL, NULL, 0}};
		return world_from_files(32, 32, files);
	}
	return NULL;
}

#endif
