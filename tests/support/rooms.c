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
#define DIFFUSE(rgb) "<bsdf type='diffuse'><rgb name='reflectance' value='" rgb "'/></bsdf>"
#define BOX(rgb) "<shape type='cube'>" AT("<scale value='2'/>") DIFFUSE(rgb) "</shape>"
#define VIEW SENSOR("0,0.2,1.9", "0,-0.3,-1")
#define ROOM VIEW BOX("0.5,0.45,0.35")
#define AREA_EMITTER(rgb) "<emitter type='area'><rgb name='radiance' value='" rgb "'/></emitter>"
#define LAMP                                                                                                                    \
	"<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>") AREA_EMITTER("3,2.5,2")     \
	"</shape>"
#define BALL(bsdf)                                                                                                              \
	"<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>" bsdf "</shape>"
#define METAL(alpha) "<bsdf type='roughconductor'><string name='material' value='Au'/><float name='alpha' value='" alpha "'/></bsdf>"
#define ROUGH_GLASS(alpha) "<bsdf type='roughdielectric'><float name='alpha' value='" alpha "'/></bsdf>"
#define GLASS "<bsdf type='dielectric'/>"
#define INTERIOR(of) "<medium type='homogeneous' name='interior'>" of "</medium>"
#define MIRROR "<bsdf type='conductor'><string name='material' value='none'/></bsdf>"
#define OBJ(inner) "<shape type='obj'><string name='filename' value='bent.obj'/>" inner "</shape>"

static struct world *rough_glass(void)
{
	return world_from_text(32, 32, ROOM LAMP BALL(ROUGH_GLASS("0.25")));
}

static struct world *glass(void)
{
	return world_from_text(32, 32, ROOM LAMP BALL("<bsdf type='mask'><float name='opacity' value='0.8'/>" GLASS "</bsdf>"));
}

static struct world *gold(void)
{
	return world_from_text(32, 32, ROOM LAMP BALL(METAL("0.1")));
}

static struct world *mirror(void)
{
	return world_from_text(32, 32, VIEW BOX("0.5,0.5,0.5")
			     "<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>")
				AREA_EMITTER("3,3,3")
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

static struct world *bent_normals(void)
{
	static const char scene[] =
		"<scene version='3.0.0'>" ROOM LAMP OBJ(AT("<scale value='.6'/><translate y='-.9'/>") METAL("0.3"))
		OBJ(AT("<scale value='.3'/><rotate x='1' angle='80'/><translate x='-.5' y='-.6' z='-.9'/>") ROUGH_GLASS("0.4"))
		OBJ(AT("<scale value='.3'/><rotate z='1' angle='15'/><translate x='.8' y='-.5' z='-.5'/>") GLASS)
		OBJ(AT("<scale value='.4'/><rotate z='1' angle='-70'/><translate x='-1.2' y='-.4' z='-.8'/>") METAL("0.2")) "</scene>";
	const struct memory_file files[] = {{"bent.xml", scene, sizeof scene - 1}, {"bent.obj", bent_obj, sizeof bent_obj - 1},
		{NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

static struct world *sky(void)
{
	return world_from_text(32, 32, SENSOR("0,1,5", "0,0,0")
			     "<shape type='rectangle'>" AT("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1.4'/>")
			     METAL("0.2") "</shape>" BALL(ROUGH_GLASS("0.3"))
			     "<emitter type='constant'><rgb name='radiance' value='0.8,0.9,1'/></emitter>");
}

/* An environment map that differs on all sides. */
static struct world *environment_picture(void)
{
	static const char scene[] = "<scene version='3.0.0'>" SENSOR("0,1,5", "0,0,0")
		"<shape type='rectangle'>" AT("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1.4'/>") "</shape>"
			BALL(METAL("0.2"))
		"<emitter type='envmap'><string name='filename' value='sky.png'/></emitter></scene>";
	size_t size;
	unsigned char *png = sample_png(16, 8, SAMPLE_RGB, 8, 0, &size);
	const struct memory_file files[] = {{"sky.xml", scene, sizeof scene - 1}, {"sky.png", png, size}, {NULL, NULL, 0}};
	struct world *w = world_from_files(32, 32, files);
	free(png);
	return w;
}

static struct world *prism(void)
{
	return world_from_text(32, 32, ROOM LAMP BALL("<bsdf type='dielectric'><float name='int_ior' value='1.6'/>"
						     "<float name='ext_ior' value='1'/>"
						     "<float name='int_cauchy_b' value='0.05'/></bsdf>")
			     "<shape type='sphere'><point name='center' value='1.1,-1.3,-0.2'/><float name='radius' value='0.6'/>"
			     "<bsdf type='roughdielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/>"
			     "<float name='int_cauchy_b' value='0.03'/><float name='alpha' value='0.2'/></bsdf></shape>");
}

static struct world *thin_lens(void)
{
	return world_from_text(32, 32,
			     "<sensor type='thinlens'><float name='fov' value='40'/><float name='aperture_radius' value='0.25'/>"
			     "<float name='focus_distance' value='2.2'/>" AT("<lookat origin='0,0.2,1.6' target='0,-0.3,-1' up='0,1,0'/>")
			     "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
				"<rfilter type='box'/></film>"
			     "</sensor>" BOX("0.5,0.45,0.35") LAMP BALL(METAL("0.2")));
}

static struct world *delta_emitters(void)
{
	return world_from_text(32, 32, ROOM BALL(ROUGH_GLASS("0.3"))
			     "<shape type='rectangle'>"
				AT("<scale value='0.9'/><rotate y='1' angle='70'/><translate x='-1.7' z='-0.6'/>") METAL("0.15") "</shape>"
			     "<emitter type='point'><point name='position' value='0.5,1.5,0.6'/>"
				"<rgb name='intensity' value='4,4,3'/></emitter>"
			     "<emitter type='spot'><rgb name='intensity' value='9,8,8'/><float name='cutoff_angle' value='50'/>"
			     AT("<lookat origin='-1,1.5,1' target='0,-1,-0.3' up='0,1,0'/>") "</emitter>");
}

static struct world *sun(void)
{
	return world_from_text(32, 32, SENSOR("0,1,5", "0,0,0")
			     "<shape type='rectangle'>" AT("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1.4'/>")
			     "</shape>" BALL(ROUGH_GLASS("0.3"))
			     "<emitter type='directional'><vector name='direction' value='0.3,-1,-0.4'/>"
				"<rgb name='irradiance' value='3,3,2'/></emitter>");
}

static struct world *displaced_ball(void)
{
	return world_from_text(32, 32, ROOM LAMP "<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/>"
			     "<float name='radius' value='0.8'/>"
			     ROUGH_GLASS("0.15") "<texture name='displacement' type='checkerboard'><float name='color0' value='0'/>"
			     "<float name='color1' value='1'/>" "<transform name='to_uv'><scale x='6' y='4'/></transform></texture>"
			     "<float name='displacement_scale' value='0.06'/><integer name='displacement_level' value='3'/></shape>");
}

/* Coloured glass with a stone in it, which states no medium; beside it a lamp in clear glass. */
static struct world *coloured_glass(void)
{
	return world_from_text(32, 32, ROOM LAMP BALL(ROUGH_GLASS("0.25") "<medium type='homogeneous' name='interior'>"
						    "<float name='albedo' value='0'/>"
						    "<rgb name='sigma_t' value='0.3,0.8,1.5'/></medium>")
			     "<shape type='sphere'><point name='center' value='0.2,-0.8,-0.3'/>"
				"<float name='radius' value='0.3'/>" METAL("0.2") "</shape>"
			     "<shape type='sphere'><point name='center' value='1.1,-1.2,-0.2'/><float name='radius' value='0.6'/>" GLASS
				"</shape><shape type='sphere'><point name='center' value='1.2,-1.1,-0.2'/>"
				"<float name='radius' value='0.1'/>" AREA_EMITTER("30,20,30") "</shape>");
}

/* Each part of a material has a normal of its own. */
static struct world *tilted_parts(void)
{
	return world_from_text(32, 32, ROOM LAMP BALL("<bsdf type='blendbsdf'><float name='weight' value='0.5'/>" METAL("0.15")
						    "<bsdf type='normalmap'><texture type='checkerboard'>"
							"<rgb name='color0' value='0.7,0.45,0.9'/>"
						    "<rgb name='color1' value='0.4,0.6,0.85'/></texture><bsdf type='roughplastic'>"
						    "<float name='alpha' value='0.3'/></bsdf></bsdf></bsdf>"));
}

/* Relief so steep that many normals face away from the camera. */
static struct world *turned_normals(void)
{
	return world_from_text(32, 32, ROOM LAMP BALL("<bsdf type='normalmap'><texture type='checkerboard'>"
						    "<rgb name='color0' value='0.9,0.35,0.8'/>"
						    "<rgb name='color1' value='0.15,0.8,0.75'/></texture>" METAL("0.3") "</bsdf>"));
}

/* A cloud of three colours that light enters through its null faces, and milk in rough glass. */
static struct world *clouds(void)
{
	return world_from_text(32, 32, ROOM LAMP
			     "<shape type='cube'>" AT("<scale value='0.6'/><translate x='-0.9' y='-0.6' z='-0.6'/>") "<bsdf type='null'/>"
			     INTERIOR("<rgb name='sigma_t' value='2,1.5,1'/><float name='albedo' value='0.9'/>"
				    "<phase type='hg'><float name='g' value='0.5'/></phase>") "</shape>"
			     "<shape type='sphere'><point name='center' value='0.7,-0.7,-0.2'/><float name='radius' value='0.7'/>"
			     ROUGH_GLASS("0.25") INTERIOR("<float name='sigma_t' value='2'/>"
							  "<rgb name='albedo' value='0.9,0.8,0.6'/>") "</shape>");
}

/* The camera and a ball of smooth glass with milk in it, in fog. */
static struct world *fog(void)
{
	return world_from_text(32, 32,
			     "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.3'/>"
				"<float name='albedo' value='0.8'/></medium>"
			     "<sensor type='perspective'><float name='fov' value='40'/>"
				AT("<lookat origin='0,0.2,1.9' target='0,-0.3,-1' up='0,1,0'/>")
			     "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
			     "<rfilter type='box'/></film><ref name='medium' id='fog'/></sensor>" BOX("0.5,0.45,0.35") LAMP
			     "<shape type='sphere'><point name='center' value='0.2,-0.6,-0.2'/><float name='radius' value='0.7'/>" GLASS
			     INTERIOR("<float name='sigma_t' value='2'/><float name='albedo' value='0.9'/>")
				"<ref name='exterior' id='fog'/></shape>");
}

/* Fog that only the camera states: light sub-paths begin outside it, and many paths that the camera could start are
 * made by no technique. The strips before the wall end the fog: there light sub-paths bring the light that a mirror
 * sends, and beside them no technique does, so that a mutation which leaves a strip leaves the paths that are
 * rendered. */
#define STRIP(x)                                                                                                                \
	"<shape type='rectangle'>" AT("<scale x='0.2' y='1.2'/><translate x='" x "' y='-0.5' z='-1.9'/>") DIFFUSE("0.5,0.45,0.35")  \
	INTERIOR("<float name='sigma_t' value='0.3'/><float name='albedo' value='0.8'/>") "</shape>"
static struct world *mismatched_medium(void)
{
	return world_from_text(32, 32,
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

#define KEYFRAME(t, inner) "<transform time='" t "'>" inner "</transform>"
#define ANIMATION(a, b) "<animation name='to_world'>" KEYFRAME("0", a) KEYFRAME("1", b) "</animation>"

/* While the shutter is open, the camera moves a little, a ball of metal rolls and shrinks, cloudy glass turns, a
 * group slides, and the lamp swings and is stretched. */
static struct world *moving_objects(void)
{
	static const char scene[] = "<scene version='3.0.0'>"
		"<sensor type='perspective'><float name='fov' value='40'/><float name='shutter_open' value='0.2'/>"
		"<float name='shutter_close' value='0.9'/>" ANIMATION("<lookat origin='0,0.2,1.9' target='0,-0.3,-1' up='0,1,0'/>",
			"<lookat origin='0.2,0.3,1.8' target='0.1,-0.5,-1' up='0.1,1,0'/>")
		"<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
			"<rfilter type='box'/></film></sensor>"
		BOX("0.5,0.45,0.35")
		"<shape type='rectangle'>" ANIMATION("<scale x='1.7' y='1.3'/><rotate x='1' angle='90'/><translate x='-0.1' y='1.9'/>",
			"<scale x='1.2' y='1.7'/><rotate x='1' angle='90'/><rotate z='1' angle='10'/><translate x='0.2' y='1.6'/>")
				AREA_EMITTER("3,2.5,2") "</shape>"
		"<shape type='sphere'>" ANIMATION("<scale value='0.7'/><translate x='-0.6' y='-1' z='-0.6'/>",
			"<scale value='0.5'/><rotate z='1' angle='-100'/><translate x='0.5' y='-1.2' z='-0.5'/>") METAL("0.2") "</shape>"
		"<shape type='cube'>" ANIMATION("<scale x='0.5' y='0.4' z='0.15'/><translate x='0.5' y='0.3' z='-0.4'/>",
			"<scale x='0.5' y='0.4' z='0.15'/><rotate y='1' angle='70'/><translate x='0.5' y='0.3' z='-0.4'/>")
				ROUGH_GLASS("0.3") "</shape>"
		"<shape type='shapegroup' id='g'>" OBJ(AT("<scale value='.3'/><rotate x='1' angle='80'/>") METAL("0.3"))
		"<shape type='sphere'><float name='radius' value='0.25'/>" GLASS "</shape></shape>"
		"<shape type='instance'><ref id='g'/>" ANIMATION("<translate x='-0.9' y='-0.6' z='-0.9'/>",
			"<scale x='1' y='1' z='1'/><translate x='-0.3' y='-0.1' z='-0.9'/>") "</shape></scene>";
	const struct memory_file files[] = {{"moving.xml", scene, sizeof scene - 1},
		{"bent.obj", bent_obj, sizeof bent_obj - 1}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

const struct room rooms[] = {
	{"rough glass", rough_glass}, {"glass", glass}, {"gold", gold}, {"mirror", mirror}, {"bent normals", bent_normals}, {"sky", sky},
	{"picture", environment_picture}, {"prism", prism}, {"lens", thin_lens}, {"point and spot", delta_emitters}, {"sun", sun},
	{"dents", displaced_ball}, {"coloured glass", coloured_glass}, {"tilted parts", tilted_parts},
	{"turned normals", turned_normals}, {"clouds", clouds}, {"fog", fog}, {"misfit", mismatched_medium},
	{"moving", moving_objects},
	{NULL, NULL},
};

_Static_assert(sizeof rooms / sizeof *rooms <= ROOMS_MAX, "with its end");

struct world *room_build_named(const char *name)
{
	for (const struct room *r = rooms; r->name; r++)
		if (strcmp(r->name, name) == 0)
			return r->build();
	fail_msg("no room is called '%s'", name);
	return NULL;
}
