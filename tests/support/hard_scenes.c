/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Small scenes in which one number approaches its limit: smooth metal, thin bubbles, grazing light, narrow gaps,
 * slivers, a distant sun. Each function makes the world for a value of that number; tests let it approach the limit and
 * look for values that are not finite, and for bias.
 */
/* Scenes are laid out by hand. */
/* clang-format off */
#include "tests/support/hard_scenes.h"

#include "tests/support/memory_assets.h"
#include "tests/support/sample_images.h"
#include "tests/support/worlds.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
#define DIFFUSE "<bsdf type='diffuse'><rgb name='reflectance' value='0.5,0.45,0.35'/></bsdf>"
#define METAL "<bsdf type='roughconductor'><string name='material' value='Au'/><float name='alpha' value='%.9g'/></bsdf>"
#define ROUGH_GLASS                                                                                                             \
	"<bsdf type='roughdielectric'><float name='int_ior' value='%.9g'/><float name='ext_ior' value='%.9g'/><float name='alpha' " \
	"value='%.9g'/></bsdf>"
#define GLASS "<bsdf type='dielectric'><float name='int_ior' value='%.9g'/><float name='ext_ior' value='1'/></bsdf>"
#define VIEW SENSOR("0,0.2,1.9", "0,-0.3,-1")
#define WALLS "<shape type='cube'>" AT("<scale value='2'/>") DIFFUSE "</shape>"
#define LAMP                                                                                                                    \
	"<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>")                       \
	"<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>"
#define PLATE(y, bsdf) \
	"<shape type='rectangle'>" \
		AT("<scale value='1.9'/><rotate x='1' angle='-90'/><translate y='" y "'/>") \
		bsdf \
	"</shape>"
#define BALL(bsdf) "<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>" bsdf "</shape>"
/* A camera that looks at the ball's centre with a field of view in degrees. */
#define CLOSE_VIEW(o, t)                                                                                                              \
	"<sensor type='perspective'><float name='fov' value='%.9g'/><transform name='to_world'><lookat origin='" o "' target='" t    \
	"' up='0.1,1,0.05'/></transform><film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"   \
	"<rfilter type='box'/></film></sensor>"
#define DEGREES (180 / M_PI)

static struct world *metal(double alpha)
{
	return world_from_text(32, 32, VIEW WALLS LAMP PLATE("-1.4", METAL), alpha);
}

static struct world *rough_glass(double alpha)
{
	return world_from_text(32, 32, VIEW WALLS LAMP BALL(ROUGH_GLASS), 1.5, 1.0, alpha);
}

/* inside: the index inside; the index outside is 1. */
static struct world *rough_glass_of_index(double inside)
{
	return world_from_text(32, 32, VIEW WALLS LAMP BALL(ROUGH_GLASS), inside, 1.0, 0.1);
}

static struct world *smooth_glass_of_index(double inside)
{
	return world_from_text(32, 32, VIEW WALLS LAMP BALL(GLASS), inside);
}

/* A bubble, with total reflection around its rim. */
static struct world *bubble(double outside)
{
	return world_from_text(32, 32, VIEW WALLS LAMP BALL(ROUGH_GLASS), 1.0, outside, 0.05);
}

/* Under the surface of water, looking up at the critical angle (48.6 degrees from the normal for 1.333). */
static struct world *critical_angle(double alpha)
{
	return world_from_text(32, 32, SENSOR("0,-1.5,1.7", "0,0,0.0") WALLS LAMP
			     "<shape type='rectangle'>" AT("<scale value='2'/><rotate x='1' angle='-90'/>")
				ROUGH_GLASS "</shape>", 1.333, 1.0, alpha);
}

/* A rough plate seen at this angle in radians, with the light low behind it. */
static struct world *grazing_plate(double angle)
{
	return world_from_text(32, 32,
			     "<sensor type='perspective'><float name='fov' value='%.9g'/><transform name='to_world'>"
				"<lookat origin='0,%.9g,5' target='0,0,0' up='0,1,0'/></transform>"
			     "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
			     "<rfilter type='box'/></film></sensor>"
			     "<shape type='rectangle'>" AT("<scale value='20'/><rotate x='1' angle='-90'/>") METAL "</shape>"
			     "<shape type='rectangle'>" AT("<scale value='2'/><translate z='-15'/>")
			     "<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>",
			     1.5 * angle * DEGREES, 5 * angle, 0.3);
}

/* Thin plates of alternating index between camera and wall. */
static struct world *plates(double count)
{
	static char text[1 << 14];
	size_t n = 0;
	for (int i = 0; i < (int)count; i++)
		n += (size_t)snprintf(text + n, sizeof text - n,
				      "<shape type='rectangle'>" AT("<scale value='1.9'/>%s<translate z='%.9g'/>") ROUGH_GLASS "</shape>",
				      i % 2 ? "<rotate y='1' angle='180'/>" : "", 1.2 - 2.0 * (i + 0.5) / count, 1.1, 1.0, 0.05);
	return world_from_text(32, 32, "%s%s", VIEW WALLS LAMP, text);
}

/* Two rough mirrors face each other across the room. */
static struct world *facing_mirrors(double alpha)
{
	return world_from_text(32, 32, VIEW WALLS LAMP
			     "<shape type='rectangle'>"
				AT("<scale value='1.95'/><rotate y='1' angle='90'/><translate x='-1.9'/>") METAL "</shape>"
			     "<shape type='rectangle'>"
				AT("<scale value='1.95'/><rotate y='1' angle='-90'/><translate x='1.9'/>") METAL "</shape>",
			     alpha, alpha);
}

/* The camera near the centre of a mirror ball around all, where every ray comes back. */
static struct world *mirror_ball_focus(double offset)
{
	return world_from_text(32, 32,
			     "<sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'>"
				"<lookat origin='%.9g,0,0' target='0,0,-3' up='0,1,0'/></transform>"
			     "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
			     "<rfilter type='box'/></film></sensor>"
			     "<shape type='sphere'><float name='radius' value='2'/><boolean name='flip_normals' value='true'/>"
				METAL "</shape>"
			     "<shape type='sphere'><point name='center' value='0.3,0.3,0.2'/><float name='radius' value='0.2'/>"
			     "<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>",
			     offset, 0.05);
}

/* A ball of this radius fills the image. */
static struct world *curved_ball(double radius)
{
	double distance = fmax(2.2, 1.2 * radius);
	return world_from_text(32, 32,
			     "<sensor type='perspective'><float name='fov' value='%.9g'/><transform name='to_world'>"
				"<lookat origin='0,0,%.9g' target='0,0,0' up='0,1,0'/></transform>"
			     "<film type='hdrfilm'><integer name='width' value='32'/><integer name='height' value='32'/>"
			     "<rfilter type='box'/></film></sensor>"
			     "<shape type='sphere'><point name='center' x='0' y='0' z='%.9g'/>"
				"<float name='radius' value='%.9g'/>" METAL "</shape>"
			     "<emitter type='constant'><rgb name='radiance' value='0.8,0.9,1'/></emitter>"
			     "<shape type='rectangle'>" AT("<scale value='3'/><translate z='4'/><rotate y='1' angle='180'/>")
				DIFFUSE "</shape>",
			     radius > 1 ? 40.0 : 2 * atan(0.9 * radius / distance) * DEGREES, distance,
			     radius > 1 ? -radius : 0.0, radius, 0.2);
}

/* The image contains the pole and is this many radii wide. */
static struct world *sphere_pole(double across)
{
	return world_from_text(32, 32, CLOSE_VIEW("0.4,0.3,1.9", "0,-0.6,0.5") WALLS LAMP BALL(METAL),
			       2 * atan(across * 0.8 / 1.7) * DEGREES, 0.2);
}

/* A ball as a mesh. uv_kind 0: with texture coordinates and a seam; 1: without; 2: the same everywhere. thin: by how
 * much some faces are thinner; there are also faces without area. */
static struct world *mesh_ball(double uv_kind, double thin, const char *bsdf)
{
	enum { AROUND = 12, UP = 8, SIZE = 1 << 16 };
	static char obj[SIZE], xml[1 << 13];
	size_t n = 0;
	for (int i = 0; i <= UP; i++)
		for (int j = 0; j <= AROUND; j++) {
			/* Every other circle of latitude lies close to the previous one. */
			double t = M_PI * (i % 2 && i < UP ? i - 1 + thin : i) / UP;
			double p = 2 * M_PI * (j % AROUND) / AROUND;
			double x = sin(t) * cos(p), y = cos(t), z = sin(t) * sin(p), shared = uv_kind == 2;
			n += (size_t)snprintf(obj + n, SIZE - n, "v %.9g %.9g %.9g\nvn %.9g %.9g %.9g\nvt %.9g %.9g\n",
					      0.8 * x, 0.8 * y - 0.6, 0.8 * z - 0.3, x, y, z,
					      shared > 0 ? 0.5 : (double)j / AROUND, shared > 0 ? 0.5 : (double)i / UP);
		}
	for (int i = 0; i < UP; i++)
		for (int j = 0; j < AROUND; j++) {
			int a = i * (AROUND + 1) + j + 1, b = a + 1, c = b + AROUND + 1, d = a + AROUND + 1;
			for (int half = 0; half < 2; half++) {
				int q[3] = {a, half ? c : b, half ? d : c};
				n += (size_t)(uv_kind == 1 ? snprintf(obj + n, SIZE - n, "f %d//%d %d//%d %d//%d\n",
								 q[0], q[0], q[1], q[1], q[2], q[2])
						      : snprintf(obj + n, SIZE - n, "f %d/%d/%d %d/%d/%d %d/%d/%d\n",
								 q[0], q[0], q[0], q[1], q[1], q[1], q[2], q[2], q[2]));
			}
		}
	int m = snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s<shape type='obj'>"
			 "<string name='filename' value='ball.obj'/>%s</shape></scene>",
			 VIEW WALLS LAMP, bsdf);
	const struct memory_file files[] = {{"test.xml", xml, (size_t)m}, {"ball.obj", obj, n}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

static struct world *mesh_with_uv(double kind)
{
	char bsdf[400];
	snprintf(bsdf, sizeof bsdf, ROUGH_GLASS, 1.5, 1.0, 0.2);
	return mesh_ball(kind, 1, bsdf);
}

static struct world *mesh_with_slivers(double thin)
{
	char bsdf[400];
	snprintf(bsdf, sizeof bsdf, METAL, 0.2);
	return mesh_ball(0, thin, bsdf);
}

static struct world *displaced_ball(double level)
{
	static char xml[1 << 13];
	size_t size;
	unsigned char *png = sample_png(16, 16, SAMPLE_GREY, 8, 0, &size);
	int m = snprintf(xml, sizeof xml,
			 "<scene version='3.0.0'>" VIEW WALLS LAMP
			 "<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>"
			 "<texture name='displacement' type='bitmap'><string name='filename' value='h.png'/></texture><float "
			 "name='displacement_scale' value='0.02'/><integer name='displacement_level' value='%d'/>"
				ROUGH_GLASS "</shape></scene>",
			 (int)level, 1.5, 1.0, 0.1);
	const struct memory_file files[] = {{"test.xml", xml, (size_t)m}, {"h.png", png, size}, {NULL, NULL, 0}};
	struct world *w = world_from_files(32, 32, files);
	free(png);
	return w;
}

/* A plate of the same material as the floor blocks the light. */
static struct world *occluder(double side)
{
	return world_from_text(32, 32, VIEW "<bsdf type='roughconductor' id='m'><string name='material' value='Au'/>"
			     "<float name='alpha' value='0.2'/></bsdf>"
			     "<shape type='cube'>" AT("<scale value='2'/>") "<ref id='m'/></shape>" LAMP
			     "<shape type='rectangle'>"
				AT("<scale value='%.9g'/><rotate x='1' angle='-90'/><translate y='-1.2' z='-0.6'/>") "<ref id='m'/></shape>"
			     "<shape type='rectangle'>"
				AT("<scale value='%.9g'/><rotate x='1' angle='-90'/><translate y='-0.4' z='-0.9'/>")
				"<ref id='m'/></shape>",
			     side, side);
}

static struct world *small_light(double size)
{
	return world_from_text(32, 32, VIEW WALLS BALL(METAL)
			     "<shape type='sphere'><point name='center' value='0.4,1.2,0'/><float name='radius' value='%.9g'/>"
			     "<emitter type='area'><float name='radiance' value='%.9g'/></emitter></shape>",
			     0.2, 4 * size, 1 / (size * size));
}

/* A light as large as the sun seen from the ground, in a sky of radiance 1. */
static struct world *sun(double radiance)
{
	return world_from_text(32, 32, SENSOR("0,1,5", "0,0,0") "<shape type='rectangle'>"
			     AT("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1'/>")
			     DIFFUSE "</shape><shape type='sphere'>" ROUGH_GLASS "</shape>"
			     "<shape type='sphere'><point name='center' value='300,500,200'/><float name='radius' value='2.9'/>"
			     "<emitter type='area'><float name='radiance' value='%.9g'/></emitter></shape>"
			     "<emitter type='constant'><float name='radiance' value='1'/></emitter>",
			     1.5, 1.0, 0.2, radiance);
}

/* Looks into the corner of the room with this field of view: edges between the walls become arbitrarily short. */
static struct world *room_corner(double degrees)
{
	return world_from_text(32, 32, CLOSE_VIEW("0,0.2,1.5", "-2,-2,-2") LAMP "<shape type='cube'>" AT("<scale value='2'/>")
		METAL "</shape>", degrees, 0.3);
}

/* Two balls that nearly touch, seen at the gap. */
static struct world *gap_between_balls(double width)
{
	return world_from_text(32, 32, CLOSE_VIEW("0,0.2,1.9", "0,-0.6,-0.3") WALLS LAMP
			     "<shape type='sphere'><point name='center' x='%.9g' y='-0.6' z='-0.3'/>"
				"<float name='radius' value='0.6'/>" METAL "</shape>"
			     "<shape type='sphere'><point name='center' x='%.9g' y='-0.6' z='-0.3'/>"
				"<float name='radius' value='0.6'/>" METAL "</shape>",
			     3.0, -0.6 - width / 2, 0.2, 0.6 + width / 2, 0.2);
}

/* A column of this many pixels: the border is everywhere. */
static struct world *narrow_film(double width)
{
	return world_from_text((uint32_t)width, 32, VIEW WALLS LAMP BALL(ROUGH_GLASS), 1.5, 1.0, 0.2);
}

static struct world *thin_lens(double radius)
{
	return world_from_text(32, 32,
			     "<sensor type='thinlens'><float name='fov' value='40'/><float name='aperture_radius' value='%.9g'/><float "
			     "name='focus_distance' value='2.4'/><transform name='to_world'><lookat origin='0,0.2,1.3' target='0,-0.3,-1' "
			     "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='32'/>"
				"<integer name='height' value='32'/>"
			     "<rfilter type='box'/></film></sensor>" WALLS LAMP BALL(ROUGH_GLASS),
			     radius, 1.5, 1.0, 0.2);
}

const struct hard_case hard_cases[] = {
	{"roughness, metal", "1e-6", metal, 1e-6, 2, 4, "hslt"},
	{"roughness, metal", "1e-4", metal, 1e-4, 2, 4, "hslt"},
	{"roughness, metal", "9.99e-4", metal, 9.99e-4, 2, 4, "hslt"},
	{"roughness, metal", "1.001e-3", metal, 1.001e-3, 2, 4, "hslt"},
	{"roughness, metal", "0.01", metal, 0.01, 2, 4, "hslt"},
	{"roughness, metal", "0.1", metal, 0.1, 2, 4, "halfvec"},
	{"roughness, metal", "1", metal, 1, 2, 4, "hslt"},
	{"roughness, glass", "1e-6", rough_glass, 1e-6, 3, 4, "hslt"},
	{"roughness, glass", "1e-4", rough_glass, 1e-4, 3, 4, "hslt"},
	{"roughness, glass", "1e-3", rough_glass, 1e-3, 3, 4, "hslt"},
	{"roughness, glass", "0.01", rough_glass, 0.01, 3, 4, "hslt"},
	{"roughness, glass", "1", rough_glass, 1, 3, 4, "hslt"},
	{"index", "1", rough_glass_of_index, 1, 3, 4, "hslt"},
	{"index", "1 + 1e-6", rough_glass_of_index, 1 + 1e-6, 3, 4, "hslt"},
	{"index", "1 - 1e-6", rough_glass_of_index, 1 - 1e-6, 3, 4, "hslt"},
	{"index", "1 + 1e-4", rough_glass_of_index, 1 + 1e-4, 3, 4, "hslt"},
	{"index", "1 + 1e-3", rough_glass_of_index, 1 + 1e-3, 3, 4, "halfvec"},
	{"index", "1 - 1e-2", rough_glass_of_index, 1 - 1e-2, 3, 4, "hslt"},
	{"index, smooth", "1", smooth_glass_of_index, 1, 4, 4, "hslt"},
	{"index, smooth", "1 + 1e-6", smooth_glass_of_index, 1 + 1e-6, 4, 4, "hslt"},
	{"index, smooth", "1 + 1e-2", smooth_glass_of_index, 1 + 1e-2, 4, 4, "halfvec"},
	{"total reflection", "bubble in 1.5", bubble, 1.5, 3, 4, "hslt"},
	{"total reflection", "critical angle, alpha 0.3", critical_angle, 0.3, 2, 4, "hslt"},
	{"total reflection", "critical angle, alpha 0.01", critical_angle, 0.01, 2, 4, "halfvec"},
	{"grazing", "0.1", grazing_plate, 0.1, 2, 3, "hslt"},
	{"grazing", "1e-3", grazing_plate, 1e-3, 2, 3, "hslt"},
	{"grazing", "1e-4, half vectors", grazing_plate, 1e-4, 2, 3, "halfvec"},
	{"long chains", "4 plates, 6 edges", plates, 4, 6, 6, "halfvec"},
	{"long chains", "8 plates, 10 edges", plates, 8, 10, 10, "hslt"},
	{"long chains", "16 plates, 18 edges", plates, 16, 18, 18, "hslt"},
	{"long chains", "30 plates, 32 edges", plates, 30, 32, 32, "hslt"},
	{"long chains", "30 plates, all half vectors", plates, 30, 32, 32, "halfvec"},
	{"long chains", "mirrors, 20 to 32 edges", facing_mirrors, 0.1, 20, 32, "hslt"},
	{"focus", "at the centre of a mirror ball", mirror_ball_focus, 0, 3, 4, "hslt"},
	{"focus", "1e-3 off", mirror_ball_focus, 1e-3, 3, 4, "hslt"},
	{"focus", "0.1 off, all half vectors", mirror_ball_focus, 0.1, 3, 4, "halfvec"},
	{"curvature", "radius 1e-3 of an edge", curved_ball, 2e-3, 2, 3, "hslt"},
	{"curvature", "0.05", curved_ball, 0.1, 2, 3, "halfvec"},
	{"curvature", "1", curved_ball, 1, 2, 3, "hslt"},
	{"curvature", "1e3", curved_ball, 1e3, 2, 3, "hslt"},
	{"pole of a sphere", "1 radius across", sphere_pole, 1, 2, 3, "hslt"},
	{"pole of a sphere", "1e-2 radii", sphere_pole, 1e-2, 2, 3, "hslt"},
	{"pole of a sphere", "1e-5 radii", sphere_pole, 1e-5, 2, 3, "halfvec"},
	{"mesh", "uv with a seam", mesh_with_uv, 0, 3, 4, "hslt"},
	{"mesh", "no uv", mesh_with_uv, 1, 3, 4, "hslt"},
	{"mesh", "uv all alike", mesh_with_uv, 2, 3, 4, "hslt"},
	{"mesh", "slivers 1e-3", mesh_with_slivers, 1e-3, 2, 4, "hslt"},
	{"mesh", "slivers 1e-6 and no area", mesh_with_slivers, 1e-6, 2, 4, "halfvec"},
	{"displacement", "512 triangles", displaced_ball, 3, 3, 4, "hslt"},
	{"displacement", "32,768 triangles", displaced_ball, 6, 3, 4, "hslt"},
	{"occluder", "same material", occluder, 0.8, 3, 4, "hslt"},
	{"occluder", "same material, half vectors", occluder, 0.8, 3, 4, "halfvec"},
	{"small light", "1e-3 of the scene", small_light, 1e-3, 2, 4, "hslt"},
	{"small light", "1e-6 of the scene", small_light, 1e-6, 2, 4, "hslt"},
	{"sun", "1e5 times the sky", sun, 1e5, 2, 4, "hslt"},
	{"sun", "1e9 times the sky", sun, 1e9, 2, 4, "hslt"},
	{"short edges", "corner, 10 degrees", room_corner, 10, 3, 4, "hslt"},
	{"short edges", "corner, 1e-3 degrees", room_corner, 1e-3, 3, 4, "hslt"},
	{"short edges", "gap of 1e-3", gap_between_balls, 1e-3, 3, 4, "hslt"},
	{"short edges", "gap of 1e-6", gap_between_balls, 1e-6, 3, 4, "halfvec"},
	{"border", "1 x 32 pixels", narrow_film, 1, 3, 4, "hslt"},
	{"border", "2 x 32 pixels", narrow_film, 2, 3, 4, "halfvec"},
	{"aperture", "wide", thin_lens, 0.5, 3, 4, "lens"},
	{"aperture", "wide, everything moves", thin_lens, 0.5, 3, 4, "hslt"},
	{"aperture", "radius 1e-6", thin_lens, 1e-6, 3, 4, "lens"},
	{NULL, NULL, NULL, 0, 0, 0, NULL},
};
