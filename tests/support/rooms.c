/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Small rooms for tests of mutations and densities, each with one more kind of transport: glass, mirrors, bent normals,
 * fog, clouds, a sky, point lights, thin lenses, moving objects. Each has few surfaces and a lamp, so that a pass over
 * all rooms takes seconds.
 */
/* Scenes are laid out by hand. */
/* clang-format off */
#include "tests/support/rooms.h"

#include "tests/support/memory_assets.h"
#include "tests/support/sample_images.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
#define PLAIN(rgb) "<bsdf type='diffuse'><rgb name='reflectance' value='" rgb "'/></bsdf>"
#define BOX(rgb) "<shape type='cube'>" AT("<scale value='2'/>") PLAIN(rgb) "</shape>"
#define VIEW SENSOR("0,0.2,1.9", "0,-0.3,-1")
#define ROOM VIEW BOX("0.5,0.45,0.35")
#define SHINES(rgb) "<emitter type='area'><rgb name='radiance' value='" rgb "'/></emitter>"
#define LAMP                                                                                                                    \
	"<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>") SHINES("3,2.5,2")     \
	"</shape>"
#define BALL(bsdf)                                                                                                              \
	"<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>" bsdf "</shape>"
#define METAL(alpha) "<bsdf type='roughconductor'><string name='material' value='Au'/><float name='alpha' value='" alpha "'/></bsdf>"
#define CLOUDY(alpha) "<bsdf type='roughdielectric'><float name='alpha' value='" alpha "'/></bsdf>"
#define GLASS "<bsdf type='dielectric'/>"
#define INSIDE(of) "<medium type='homogeneous' name='interior'>" of "</medium>"
#define MIRROR "<bsdf type='conductor'><string name='material' value='none'/></bsdf>"
#define OBJ(inner) "<shape type='obj'><string name='filename' value='bent.obj'/>" inner "</shape>"

static struct world *cloudy(void)
{
	return world_of_text(32, 32, ROOM LAMP BALL(CLOUDY("0.25")));
}

static struct world *glass(void)
{
	return world_of_text(32, 32, ROOM LAMP BALL("<bsdf type='mask'><float name='opacity' value='0.8'/>" GLASS "</bsdf>"));
}

static struct world *gold(void)
{
	return world_of_text(32, 32, ROOM LAMP BALL(METAL("0.1")));
}

static struct world *mirror(void)
{
	return world_of_text(32, 32, VIEW BOX("0.5,0.5,0.5")
			     "<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>")
				SHINES("3,3,3")
			     "</shape>" BALL(MIRROR)
			     "<shape type='rectangle'>" AT("<rotate y='1' angle='60'/><translate x='-1.5' z='-0.6'/>")
			     "<bsdf type='phong'><float name='exponent' value='60'/></bsdf></shape>"
			     "<shape type='rectangle'>" AT("<scale value='1.2'/><rotate x='1' angle='80'/><translate y='1.2'/>")
			     "<bsdf type='thindielectric'/></shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.5'/><translate x='0.5' y='0.5' z='0.9'/>")
			     "<bsdf type='mask'><float name='opacity' value='0.4'/><bsdf type='diffuse'/></bsdf></shape>");
}

/* Normals of vertices up to 40 degrees from those of the triangles. */
static const char bent_obj[] = "v -3 -1 -3\nv 3 -1.2 -3\nv 3 -1 3\nv -3 -1.1 3\nv 0 -.7 0\n"
			       "vn -.5 1 .3\nvn .4 1 -.4\nvn .6 1 .2\nvn -.2 1 .7\nvn .3 1 -.5\n"
			       "f 1//1 5//5 2//2\nf 2//2 5//5 3//3\nf 3//3 5//5 4//4\nf 4//4 5//5 1//1\n";

static struct world *bent(void)
{
	static const char scene[] =
		"<scene version='3.0.0'>" ROOM LAMP OBJ(AT("<scale value='.6'/><translate y='-.9'/>") METAL("0.3"))
		OBJ(AT("<scale value='.3'/><rotate x='1' angle='80'/><translate x='-.5' y='-.6' z='-.9'/>") CLOUDY("0.4"))
		OBJ(AT("<scale value='.3'/><rotate z='1' angle='15'/><translate x='.8' y='-.5' z='-.5'/>") GLASS)
		OBJ(AT("<scale value='.4'/><rotate z='1' angle='-70'/><translate x='-1.2' y='-.4' z='-.8'/>") METAL("0.2")) "</scene>";
	const struct memory_file files[] = {{"bent.xml", scene, sizeof scene - 1}, {"bent.obj", bent_obj, sizeof bent_obj - 1},
		{NULL, NULL, 0}};
	return world_of_files(32, 32, files);
}

static struct world *sky(void)
{
	return world_of_text(32, 32, SENSOR("0,1,5", "0,0,0")
			     "<shape type='rectangle'>" AT("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1.4'/>")
			     METAL("0.2") "</shape>" BALL(CLOUDY("0.3"))
			     "<emitter type='constant'><rgb name='radiance' value='0.8,0.9,1'/></emitter>");
}

/* An environment map that differs on all sides. */
static struct world *picture(void)
{
	static const char scene[] = "<scene version='3.0.0'>" SENSOR("0,1,5", "0,0,0")
		"<shape type='rectangle'>" AT("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1.4'/>") "</shape>"
			BALL(METAL("0.2"))
		"<emitter type='envmap'><string name='filename' value='sky.png'/></emitter></scene>";
	size_t size;
	unsigned char *png = sample_png(16, 8, SAMPLE_RGB, 8, 0, &size);
	const struct memory_file files[] = {{"sky.xml", scene, sizeof scene - 1}, {"sky.png", png, size}, {NULL, NULL, 0}};
	struct world *w = world_of_files(32, 32, files);
	free(png);
	return w;
}

static struct world *prism(void)
{
	return world_of_text(32, 32, ROOM LAMP BALL("<bsdf type='dielectric'><float name='int_ior' value='1.6'/>"
						     "<float name='ext_ior' value='1'/>"
						     "<float name='int_cauchy_b' value='0.05'/></bsdf>")
			     "<shape type='sphere'><point name='center' value='1.1,-1.3,-0.2'/><float name='radius' value='0.6'/>"
			     "<bsdf type='roughdielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
			     "<float name='int_cauchy_b' value='0.03'/><float name='alpha' value='0.2'/></bsdf></shape>");
}

static struct world *lens(void)
{
	return world_of_text(32, 32,
			     "<sensor type='thinlens'><float name='fov' value='40'/><float name='aperture_radius' value='0.25'/>"
			     "<float name='focus_distance' value='2.2'/>" AT("<lookat origin='0,0.2,1.6' target='0,-0.3,-1' up='0,1,0'/>")
			     "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
				"<rfilter type='box'/></film>"
			     "</sensor>" BOX("0.5,0.45,0.35") LAMP BALL(METAL("0.2")));
}

static struct world *deltas(void)
{
	return world_of_text(32, 32, ROOM BALL(CLOUDY("0.3"))
			     "<shape type='rectangle'>"
				AT("<scale value='0.9'/><rotate y='1' angle='70'/><translate x='-1.7' z='-0.6'/>") METAL("0.15") "</shape>"
			     "<emitter type='point'><point name='position' value='0.5,1.5,0.6'/>"
				"<rgb name='intensity' value='4,4,3'/></emitter>"
			     "<emitter type='spot'><rgb name='intensity' value='9,8,8'/><float name='cutoff_angle' value='50'/>"
			     AT("<lookat origin='-1,1.5,1' target='0,-1,-0.3' up='0,1,0'/>") "</emitter>");
}

static struct world *sun(void)
{
	return world_of_text(32, 32, SENSOR("0,1,5", "0,0,0")
			     "<shape type='rectangle'>" AT("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1.4'/>")
			     "</shape>" BALL(CLOUDY("0.3"))
			     "<emitter type='directional'><vector name='direction' value='0.3,-1,-0.4'/>"
				"<rgb name='irradiance' value='3,3,2'/></emitter>");
}

static struct world *dents(void)
{
	return world_of_text(32, 32, ROOM LAMP "<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/>"
			     "<float name='radius' value='0.8'/>"
			     CLOUDY("0.15") "<texture name='displacement' type='checkerboard'><float name='color0' value='0'/>"
			     "<float name='color1' value='1'/>" "<transform name='to_uv'><scale x='6' y='4'/></transform></texture>"
			     "<float name='displacement_scale' value='0.06'/><integer name='displacement_level' value='3'/></shape>");
}

/* Coloured glass with a stone in it, which states no medium; beside it a lamp in clear glass. */
static struct world *coloured_glass(void)
{
	return world_of_text(32, 32, ROOM LAMP BALL(CLOUDY("0.25") "<medium type='homogeneous' name='interior'>"
						    "<float name='albedo' value='0'/>"
						    "<rgb name='sigma_t' value='0.3,0.8,1.5'/></medium>")
			     "<shape type='sphere'><point name='center' value='0.2,-0.8,-0.3'/>"
				"<float name='radius' value='0.3'/>" METAL("0.2") "</shape>"
			     "<shape type='sphere'><point name='center' value='1.1,-1.2,-0.2'/><float name='radius' value='0.6'/>" GLASS
				"</shape><shape type='sphere'><point name='center' value='1.2,-1.1,-0.2'/>"
				"<float name='radius' value='0.1'/>" SHINES("30,20,30") "</shape>");
}

/* Each part of a material has a normal of its own. */
static struct world *tilted_parts(void)
{
	return world_of_text(32, 32, ROOM LAMP BALL("<bsdf type='blendbsdf'><float name='weight' value='0.5'/>" METAL("0.15")
						    "<bsdf type='normalmap'><texture type='checkerboard'>"
							"<rgb name='color0' value='0.7,0.45,0.9'/>"
						    "<rgb name='color1' value='0.4,0.6,0.85'/></texture><bsdf type='roughplastic'>"
						    "<float name='alpha' value='0.3'/></bsdf></bsdf></bsdf>"));
}

/* Relief so steep that many normals face away from the camera. */
static struct world *turned_normals(void)
{
	return world_of_text(32, 32, ROOM LAMP BALL("<bsdf type='normalmap'><texture type='checkerboard'>"
						    "<rgb name='color0' value='0.9,0.35,0.8'/>"
						    "<rgb name='color1' value='0.15,0.8,0.75'/></texture>" METAL("0.3") "</bsdf>"));
}

/* A cloud of three colours that light enters through its null faces, and milk in rough glass. */
static struct world *clouds(void)
{
	return world_of_text(32, 32, ROOM LAMP
			     "<shape type='cube'>" AT("<scale value='0.6'/><translate x='-0.9' y='-0.6' z='-0.6'/>") "<bsdf type='null'/>"
			     INSIDE("<rgb name='sigma_t' value='2,1.5,1'/><float name='albedo' value='0.9'/>"
				    "<phase type='hg'><float name='g' value='0.5'/></phase>") "</shape>"
			     "<shape type='sphere'><point name='center' value='0.7,-0.7,-0.2'/><float name='radius' value='0.7'/>"
			     CLOUDY("0.25") INSIDE("<float name='sigma_t' value='2'/><rgb name='albedo' value='0.9,0.8,0.6'/>") "</shape>");
}

/* The camera and a ball of smooth glass with milk in it, in fog. */
static struct world *fog(void)
{
	return world_of_text(32, 32,
			     "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.3'/>"
				"<float name='albedo' value='0.8'/></medium>"
			     "<sensor type='perspective'><float name='fov' value='40'/>"
				AT("<lookat origin='0,0.2,1.9' target='0,-0.3,-1' up='0,1,0'/>")
			     "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
			     "<rfilter type='box'/></film><ref name='medium' id='fog'/></sensor>" BOX("0.5,0.45,0.35") LAMP
			     "<shape type='sphere'><point name='center' value='0.2,-0.6,-0.2'/><float name='radius' value='0.7'/>" GLASS
			     INSIDE("<float name='sigma_t' value='2'/><float name='albedo' value='0.9'/>")
				"<ref name='exterior' id='fog'/></shape>");
}

/* Fog that only the camera states: light sub-paths begin outside it, and many paths that the camera could start are
 * made by no technique. The strips before the wall end the fog: there light sub-paths bring the light that a mirror
 * sends, and beside them no technique does, so that a mutation which leaves a strip leaves the paths that are
 * rendered. */
#define STRIP(x)                                                                                                                \
	"<shape type='rectangle'>" AT("<scale x='0.2' y='1.2'/><translate x='" x "' y='-0.5' z='-1.9'/>") PLAIN("0.5,0.45,0.35")  \
	INSIDE("<float name='sigma_t' value='0.3'/><float name='albedo' value='0.8'/>") "</shape>"
static struct world *misfit(void)
{
	return world_of_text(32, 32,
			     "<sensor type='perspective'><float name='fov' value='40'/>"
				AT("<lookat origin='0,0.2,1.9' target='0,-0.3,-1' up='0,1,0'/>")
			     "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
				"<rfilter type='box'/></film>"
			     "<medium type='homogeneous'><float name='sigma_t' value='0.3'/>"
				"<float name='albedo' value='0.8'/></medium></sensor>"
			     BOX("0.5,0.45,0.35") "<emitter type='point'><point name='position' value='0,1.5,0'/>"
				"<rgb name='intensity' value='3,2.5,2'/></emitter>"
			     "<shape type='rectangle'>"
				AT("<scale value='1.9'/><rotate y='1' angle='90'/><translate x='-1.8'/>") MIRROR "</shape>"
			     STRIP("-0.9") STRIP("0") STRIP("0.9")
			     "<shape type='sphere'><point name='center' value='0.2,-0.6,-0.2'/>"
				"<float name='radius' value='0.7'/>" GLASS "</shape>");
}

#define FROM(t, inner) "<transform time='" t "'>" inner "</transform>"
#define MOVES(a, b) "<animation name='to_world'>" FROM("0", a) FROM("1", b) "</animation>"

/* While the shutter is open, the camera moves a little, a ball of metal rolls and shrinks, cloudy glass turns, a
 * group slides, and the lamp swings and is stretched. */
static struct world *moving(void)
{
	static const char scene[] = "<scene version='3.0.0'>"
		"<sensor type='perspective'><float name='fov' value='40'/><float name='shutter_open' value='0.2'/>"
		"<float name='shutter_close' value='0.9'/>" MOVES("<lookat origin='0,0.2,1.9' target='0,-0.3,-1' up='0,1,0'/>",
			"<lookat origin='0.2,0.3,1.8' target='0.1,-0.5,-1' up='0.1,1,0'/>")
		"<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
			"<rfilter type='box'/></film></sensor>"
		BOX("0.5,0.45,0.35")
		"<shape type='rectangle'>" MOVES("<scale x='1.7' y='1.3'/><rotate x='1' angle='90'/><translate x='-0.1' y='1.9'/>",
			"<scale x='1.2' y='1.7'/><rotate x='1' angle='90'/><rotate z='1' angle='10'/><translate x='0.2' y='1.6'/>")
				SHINES("3,2.5,2") "</shape>"
		"<shape type='sphere'>" MOVES("<scale value='0.7'/><translate x='-0.6' y='-1' z='-0.6'/>",
			"<scale value='0.5'/><rotate z='1' angle='-100'/><translate x='0.5' y='-1.2' z='-0.5'/>") METAL("0.2") "</shape>"
		"<shape type='cube'>" MOVES("<scale x='0.5' y='0.4' z='0.15'/><translate x='0.5' y='0.3' z='-0.4'/>",
			"<scale x='0.5' y='0.4' z='0.15'/><rotate y='1' angle='70'/><translate x='0.5' y='0.3' z='-0.4'/>")
				CLOUDY("0.3") "</shape>"
		"<shape type='shapegroup' id='g'>" OBJ(AT("<scale value='.3'/><rotate x='1' angle='80'/>") METAL("0.3"))
		"<shape type='sphere'><float name='radius' value='0.25'/>" GLASS "</shape></shape>"
		"<shape type='instance'><ref id='g'/>" MOVES("<translate x='-0.9' y='-0.6' z='-0.9'/>",
			"<scale x='1' y='1' z='1'/><translate x='-0.3' y='-0.1' z='-0.9'/>") "</shape></scene>";
	const struct memory_file files[] = {{"moving.xml", scene, sizeof scene - 1},
		{"bent.obj", bent_obj, sizeof bent_obj - 1}, {NULL, NULL, 0}};
	return world_of_files(32, 32, files);
}

const struct room rooms[] = {
	{"rough glass", cloudy}, {"glass", glass}, {"gold", gold}, {"mirror", mirror}, {"bent normals", bent}, {"sky", sky},
	{"picture", picture}, {"prism", prism}, {"lens", lens}, {"point and spot", deltas}, {"sun", sun}, {"dents", dents},
	{"coloured glass", coloured_glass}, {"tilted parts", tilted_parts},
	{"turned normals", turned_normals}, {"clouds", clouds}, {"fog", fog}, {"misfit", misfit},
	{"moving", moving},
	{NULL, NULL},
};

_Static_assert(sizeof rooms / sizeof *rooms <= ROOMS_MOST, "with its end");

struct world *room_of(const char *name)
{
	for (const struct room *r = rooms; r->name; r++)
		if (strcmp(r->name, name) == 0)
			return r->build();
	fail_msg("no room is called '%s'", name);
	return NULL;
}
