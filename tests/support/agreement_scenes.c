/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numerically difficult scenes for the comparison of integrators: very small and very large objects, tilted planes,
 * glass inside glass, fibres, poles, clouds, media that contradict each other. Each function makes one world; the table
 * at the end gives the sizes, the numbers of samples, and the bias that must be found.
 */
/* Scenes are laid out by hand. */
/* clang-format off */
#include "tests/support/agreement_scenes.h"

#include "tests/support/memory_assets.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
#define GREY(value) "<bsdf type='diffuse'><rgb name='reflectance' value='" value "'/></bsdf>"
#define FILM "<film type='hdrfilm'><rfilter type='box'/></film>"
#define ALL_INTEGRATORS {"bdpt", "pssmlt", "hslt"}

/* A cube and a ball of metal under a lamp, a few `a` large, on a ground that is `b` wide. TURN rotates all of them,
 * so that nothing is aligned with the axes. */
#define TURN "<rotate x='1' z='0.3' angle='20'/>"
#define SCALED "<scale value='%.17g'/>" TURN
#define SMALL_THINGS                                                                                                            \
	"<sensor type='perspective'><float name='fov' value='40'/><float name='near_clip' value='%.17g'/>" \
		"<float name='far_clip' value='%.17g'/>" \
	AT("<lookat origin='0,2.5,6' target='0,0.6,0' up='0,1,0'/>" SCALED) FILM "</sensor>"                                            \
	"<shape type='cube'>" AT("<scale value='0.5'/><rotate y='1' angle='25'/><translate x='-0.9' y='0.5'/>" SCALED) \
		GREY("0.5") "</shape>" \
	"<shape type='sphere'>" AT("<scale value='0.6'/><translate x='0.8' y='0.6' z='0.3'/>" SCALED)                                   \
	"<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf></shape>"                                                 \
	"<shape type='rectangle'>" AT("<scale value='0.7'/><rotate x='1' angle='90'/><translate y='3'/>" SCALED)                        \
	"<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape>"
#define SMALL_VALUES(s) 0.01 * (s), 1000 * (s), s, s, s, s

static struct world *objects_on_floor(const struct agreement_case *k)
{
	return world_from_text(32, 32, SMALL_THINGS "<shape type='rectangle'>" AT("<rotate x='1' angle='-90'/>" SCALED)
			     GREY("0.7") "</shape>",
			     SMALL_VALUES(k->a), k->b);
}

/* The floor is rotated about an axis that it does not contain, and its centre is elsewhere: each of its vertices is
 * rounded differently. */
static struct world *objects_on_tilted_floor(const struct agreement_case *k)
{
	return world_from_text(32, 32, SMALL_THINGS
			     "<shape type='rectangle'>" AT("<rotate x='1' angle='-90'/><translate x='0.3' z='-0.41'/>" SCALED)
				GREY("0.7") "</shape>",
			     SMALL_VALUES(k->a), k->b);
}

/* The floor is off-centre, a second one hangs far above, and the sun is a ball at the same distance. */
static struct world *objects_on_offset_floor(const struct agreement_case *k)
{
	double b = k->b;
	return world_from_text(32, 32, SMALL_THINGS
			     "<shape type='rectangle'>" AT("<rotate x='1' angle='-90'/><translate x='0.9' z='-0.77'/>" SCALED)
				GREY("0.7") "</shape>"
			     "<shape type='rectangle'>" AT("<rotate x='1' angle='90'/><translate y='1.5'/>" SCALED) GREY("0.7") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.1'/><translate x='0.5' y='1' z='0.5'/>" SCALED)
			     "<emitter type='area'><rgb name='radiance' value='40'/></emitter></shape>",
			     SMALL_VALUES(k->a), b, b, b);
}

static struct world *objects_on_ball(const struct agreement_case *k)
{
	return world_from_text(32, 32, SMALL_THINGS "<shape type='sphere'>" AT("<translate y='-1'/>" SCALED) GREY("0.7") "</shape>",
			     SMALL_VALUES(k->a), k->b);
}

/* The small objects stand on a table, which stands on the floor. */
static struct world *objects_on_table(const struct agreement_case *k)
{
	return world_from_text(32, 32, SMALL_THINGS
			     "<shape type='cube'>" AT("<translate y='-1'/>" SCALED) GREY("0.7") "</shape>"
			     "<shape type='rectangle'>" AT("<rotate x='1' angle='-90'/><translate y='-2e-6'/>" SCALED)
				GREY("0.7") "</shape>",
			     SMALL_VALUES(k->a), sqrt(k->a * k->b), k->b);
}

/* All walls mirror the fraction `a` of the light; a lamp hangs inside. */
static struct world *mirror_box(const struct agreement_case *k)
{
	return world_from_text(32, 32, SENSOR("0,0.2,0.9", "0.1,-0.1,-1")
			     "<shape type='cube'><bsdf type='conductor'><string name='material' value='none'/>"
			     "<rgb name='specular_reflectance' value='%.17g'/></bsdf></shape>"
			     "<shape type='sphere'><point name='center' x='0.3' y='0.2' z='-0.4'/><float name='radius' value='0.15'/>"
			     "<emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>",
			     k->a);
}

/* A glass rod, `a` wide and 2 long, lit at one end and seen at the other, from so near that light has bounced 64
 * times and more. Nothing is lost on the way: roulette would keep one path in thirty, and these would be the noise of
 * the image. */
static struct world *fibre(const struct agreement_case *k)
{
	return world_from_text(32, 32, "<integrator type='path'><integer name='rr_depth' value='128'/></integrator>"
			     "<sensor type='perspective'><float name='fov' value='100'/><float name='near_clip' value='%.17g'/>"
			     AT("<lookat origin='0,0,%.17g' target='0,0,0' up='0,1,0'/>") FILM "</sensor>"
			     "<shape type='cube'>" AT("<scale x='%.17g' y='%.17g' z='1'/>")
			     "<bsdf type='dielectric'><float name='int_ior' value='1.5'/></bsdf></shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.5'/><translate z='-1.25'/>")
			     "<emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>",
			     0.01 * k->a, 1 + 0.1 * k->a, 0.5 * k->a, 0.5 * k->a);
}

#define GLASS(ior) "<bsdf type='dielectric'><float name='int_ior' value='" ior "'/></bsdf>"
#define SKY "<emitter type='constant'><rgb name='radiance' value='0.3'/></emitter>"
#define GROUND "<shape type='rectangle'>" AT("<scale value='3'/><rotate x='1' angle='-90'/>" TURN) GREY("0.6") "</shape>"
#define VIEW \
	"<sensor type='perspective'>" \
		"<float name='fov' value='35'/>" \
		AT("<lookat origin='0.4,2.2,5' target='0,0.7,0' up='0,1,0'/>" TURN) \
		FILM \
	"</sensor>"

/* A lamp that shines down lies in the lower side of a slab of glass and across its rim; another one, `a` times as
 * wide as the slab, shines up from the upper side. */
static struct world *lamp_in_glass(const struct agreement_case *k)
{
	return world_from_text(32, 32, VIEW GROUND SKY
			     "<shape type='cube'>" AT("<scale x='0.8' y='0.2' z='0.8'/><translate y='1.2'/>" TURN) GLASS("1.5") "</shape>"
			     "<shape type='rectangle'>"
				AT("<scale value='%.17g'/><rotate x='1' angle='90'/><translate x='0.3' y='1'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='2'/></emitter></shape>"
			     "<shape type='rectangle'>"
				AT("<scale value='%.17g'/><rotate x='1' angle='-90'/><translate x='0.3' y='1.4'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='2'/></emitter></shape>",
			     0.8 * k->a, 0.8 * k->a);
}

/* Glass and water, side by side with a common face, on a ground whose plane contains the lower faces of both. */
static struct world *glass_and_water(const struct agreement_case *k)
{
	(void)k;
	return world_from_text(32, 32, VIEW GROUND SKY
			     "<shape type='cube'>" AT("<scale value='0.5'/><translate x='-0.5' y='0.5'/>" TURN) GLASS("1.5") "</shape>"
			     "<shape type='cube'>" AT("<scale x='0.5' y='0.4' z='0.7'/><translate x='0.5' y='0.4'/>" TURN)
				GLASS("1.33") "</shape>");
}

/* A ball of glass contains one of water, which contains one of air, and there is another ball of glass in the same
 * place. */
static struct world *balls_in_balls(const struct agreement_case *k)
{
#define BALL(radius, bsdf) \
	"<shape type='sphere'>" \
		"<point name='center' x='0' y='0.8' z='0'/>" \
		"<float name='radius' value='" radius "'/>" \
		bsdf \
	"</shape>"
#define GLASS_BETWEEN(inner, outer) \
	"<bsdf type='dielectric'>" \
		"<float name='int_ior' value='" inner "'/>" \
		"<float name='ext_ior' value='" outer "'/>" \
	"</bsdf>"
	(void)k;
	return world_from_text(32, 32, VIEW GROUND SKY BALL("0.8", GLASS("1.5")) BALL("0.7", GLASS_BETWEEN("1.33", "1.5"))
			     BALL("0.4", GLASS_BETWEEN("1", "1.33")) BALL("0.8", GLASS("2.4")));
}

/* A ball of water in a shell of glass whose thickness is the fraction `a` of its radius. */
static struct world *balls_in_a_shell(const struct agreement_case *k)
{
	return world_from_text(32, 32, VIEW GROUND SKY BALL("0.8", GLASS("1.5"))
			     "<shape type='sphere'><point name='center' x='0' y='0.8' z='0'/>"
				"<float name='radius' value='%.17g'/>" GLASS_BETWEEN("1.33", "1.5") "</shape>",
			     0.8 * (1 - k->a));
}

/* The same lamp three times, as if pasted by mistake: it shines once. */
static struct world *repeated_lamp(const struct agreement_case *k)
{
#define LAMP "<shape type='rectangle'>" AT("<scale value='0.6'/><rotate x='1' angle='90'/><translate y='1.6'/>" TURN) \
	"<emitter type='area'><rgb name='radiance' value='2'/></emitter></shape>"
	(void)k;
	return world_from_text(32, 32, VIEW GROUND LAMP LAMP LAMP
			     "<shape type='cube'>" AT("<scale value='0.3'/><translate y='0.3'/>" TURN) GREY("0.5") "</shape>");
}

/* The pole of a displaced ball, where the meridians of its texture meet: steps of height `a`, seen from near and
 * above; of metal (b = 0) or glass. */
static struct world *displaced_pole(const struct agreement_case *k)
{
	static const char *const matter[] = {"<bsdf type='roughconductor'><string name='material' value='Au'/>"
					     "<float name='alpha' value='0.2'/></bsdf>",
					     "<bsdf type='roughdielectric'><float name='alpha' value='0.2'/></bsdf>"};
	return world_from_text(32, 32,
			     "<sensor type='perspective'><float name='fov' value='12'/>"
				AT("<lookat origin='0.3,1.2,2.5' target='0,0,0.75' up='0,1,0'/>" TURN) FILM
			     "</sensor><emitter type='constant'><rgb name='radiance' value='0.3'/></emitter>"
			     "<shape type='sphere'>" AT("<scale value='0.8'/>" TURN)
				"<texture name='displacement' type='checkerboard'><float name='color0' value='0'/>"
			     "<float name='color1' value='1'/><transform name='to_uv'><scale x='12' y='12'/></transform></texture>"
			     "<float name='displacement_scale' value='%.17g'/><integer name='displacement_level' value='6'/>%s</shape>"
			     "<shape type='rectangle'>" AT("<scale value='3'/><translate z='-1.5'/>" TURN) GREY("0.5") "</shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.7'/><rotate x='1' angle='90'/><translate y='2.4' z='1'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='4'/></emitter></shape>",
			     k->a, matter[(int)k->b]);
}

/* A lamp lies on a block of glass, touching it in a point; another stands on it on its edge. */
static struct world *lamp_on_glass(const struct agreement_case *k)
{
	(void)k;
	return world_from_text(32, 32, VIEW GROUND SKY
			     "<shape type='cube'>" AT("<scale value='0.5'/><translate y='0.7'/>" TURN) GLASS("1.5") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.2'/><translate x='-0.2' y='1.4'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='3'/></emitter></shape>"
			     "<shape type='rectangle'>"
				AT("<scale value='0.2'/><rotate y='1' angle='-60'/><translate x='0.25' y='1.4'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='3'/></emitter></shape>");
}

/* A sheet that emits from both sides, between balls, and a semitransparent box around an emitting ball, so that
 * light leaves the box. */
static struct world *two_sided_lamps(const struct agreement_case *k)
{
	(void)k;
	return world_from_text(32, 32, VIEW GROUND
			     "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate y='1' angle='80'/><translate y='0.5'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='4'/>"
				"<boolean name='two_sided' value='true'/></emitter></shape>"
			     "<shape type='sphere'>" AT("<scale value='0.3'/><translate x='-0.6' y='0.3' z='0.3'/>" TURN)
				GREY("0.7") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.3'/><translate x='0.6' y='0.3' z='0.2'/>" TURN)
			     "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf></shape>"
			     "<shape type='cube'>" AT("<scale value='0.3'/><translate y='0.5' z='-1'/>" TURN)
			     "<bsdf type='mask'><float name='opacity' value='0.4'/><bsdf type='diffuse'/></bsdf>"
			     "<emitter type='area'><rgb name='radiance' value='1'/>"
				"<boolean name='two_sided' value='true'/></emitter></shape>"
			     "<shape type='sphere'>" AT("<scale value='0.2'/><translate y='0.5' z='-1'/>" TURN) GREY("0.7") "</shape>");
}

/* A square and a disk that emit along their normals, onto a ball and a ground. */
static struct world *beams(const struct agreement_case *k)
{
	(void)k;
	return world_from_text(32, 32, VIEW GROUND
			     "<shape type='sphere'>" AT("<scale value='0.5'/><translate y='0.7'/>" TURN)
			     GREY("0.7") "</shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='70'/><translate y='3' z='-1'/>" TURN)
			     "<emitter type='directionalarea'><rgb name='radiance' value='9'/></emitter></shape>"
			     "<shape type='disk'>" AT("<scale value='0.5'/><rotate y='1' angle='80'/><translate x='-2' y='0.8'/>" TURN)
			     "<emitter type='directionalarea'><rgb name='radiance' value='5'/></emitter></shape>");
}

/* One wall is in front of the near plane and another behind the far plane, which cuts the ground: the camera sees
 * neither. a = 1: the camera is orthographic, and the first wall is behind it. */
static struct world *clipped_view(const struct agreement_case *k)
{
#define CLIPPED(type, more, turn) "<sensor type='" type "'>" more "<float name='near_clip' value='2'/><float name='far_clip' value='7'/>" \
	AT(turn "<lookat origin='0,2,5' target='0,0.7,0' up='0,1,0'/>" TURN) FILM "</sensor>"
	return world_from_text(32, 32, "%s" GROUND SKY
			     "<shape type='rectangle'>" AT("<scale value='2'/><translate y='1' z='%.17g'/>" TURN) GREY("0.5") "</shape>"
			     "<shape type='rectangle'>" AT("<scale value='2'/><translate y='1' z='-3'/>" TURN) GREY("0.8") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.5'/><translate x='-0.5' y='0.5'/>" TURN) GLASS("1.5") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.4'/><translate x='0.6' y='0.4'/>" TURN)
			     "<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf></shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape>",
			     k->a > 0 ? CLIPPED("orthographic", "", "<scale x='1.6' y='1.6' z='1'/>")
				      : CLIPPED("perspective", "<float name='fov' value='35'/>", ""),
			     k->a > 0 ? 6. : 4.);
}

/* A sky of 16 x 8 texels of about 1, except for one of 1.3e8. */
static struct world *bright_texel(const struct agreement_case *k)
{
	enum { WIDTH = 16, HEIGHT = 8 };
	static const char head[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n";
	static char xml[1 << 12];
	unsigned char hdr[sizeof head - 1 + 4 * WIDTH * HEIGHT];
	(void)k;
	memcpy(hdr, head, sizeof head - 1);
	for (size_t i = 0; i < WIDTH * HEIGHT; i++)
		memcpy(hdr + sizeof head - 1 + 4 * i,
		       (unsigned char[]){0x80, 0x80, 0x80, i == 2 * WIDTH + 5 ? 0x9c : 0x81}, 4);
	int n = snprintf(xml, sizeof xml,
			 "<scene version='3.0.0'>" VIEW GROUND
				"<emitter type='envmap'><string name='filename' value='sky.hdr'/></emitter>"
			 "<shape type='sphere'>" AT("<scale value='0.5'/><translate x='-0.6' y='0.6'/>" TURN)
			 "<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf></shape>"
			 "<shape type='cube'>" AT("<scale value='0.4'/><translate x='0.6' y='0.4'/>" TURN) GREY("0.5") "</shape></scene>");
	const struct memory_file files[] = {{"test.xml", xml, (size_t)n}, {"sky.hdr", hdr, sizeof hdr}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

/* The unit sphere, made of 8 meridians and 4 circles of latitude, with its normals and texture coordinates. */
static size_t coarse_sphere(char *out, size_t size)
{
	size_t used = 0;
	for (int j = 0; j <= 4; j++)
		for (int i = 0; i <= 8; i++) {
			double a = M_PI * j / 4, b = M_PI * i / 4, x = sin(a) * cos(b), y = sin(a) * sin(b), z = cos(a);
			used += (size_t)snprintf(out + used, size - used, "v %.9g %.9g %.9g\nvn %.9g %.9g %.9g\nvt %g %g\n", x, y, z,
				x, y, z, i / 8., j / 4.);
		}
	for (int k = 0; k < 32; k++) {
		int a = k / 8 * 9 + k % 8 + 1, b = a + 1, c = a + 9, d = c + 1;
		if (k >= 8)
			used += (size_t)snprintf(out + used, size - used, "f %d/%d/%d %d/%d/%d %d/%d/%d\n", a, a, a, c, c, c, b, b, b);
		if (k < 24)
			used += (size_t)snprintf(out + used, size - used, "f %d/%d/%d %d/%d/%d %d/%d/%d\n", b, b, b, c, c, c, d, d, d);
	}
	return used;
}

/* Anisotropic metal, anisotropic glass, and a normal map on meshes of few triangles, one of them a stretched and
 * mirrored instance: their frames rotate within each triangle. */
static struct world *smooth_tangents(const struct agreement_case *k)
{
	static char xml[1 << 12], obj[1 << 13];
	(void)k;
	size_t size = coarse_sphere(obj, sizeof obj);
#define COARSE_SPHERE(place, bsdf) "<shape type='obj'><string name='filename' value='m.obj'/>" AT(place TURN) bsdf "</shape>"
#define ANISOTROPIC_BSDF(type) "<bsdf type='" type "'><float name='alpha_u' value='0.3'/><float name='alpha_v' value='0.1'/></bsdf>"
	int n = snprintf(xml, sizeof xml,
			 "<scene version='3.0.0'>" VIEW SKY GROUND
			 COARSE_SPHERE("<scale value='0.5'/><translate x='-0.9' y='0.6'/>", ANISOTROPIC_BSDF("roughconductor"))
			 COARSE_SPHERE("<scale value='0.5'/><rotate x='1' angle='70'/><translate x='0.1' y='0.6' z='0.6'/>",
				ANISOTROPIC_BSDF("roughdielectric"))
			 "<shape type='shapegroup' id='g'><shape type='obj'><string name='filename' value='m.obj'/>"
			 "<bsdf type='normalmap'><texture type='checkerboard'><rgb name='color0' value='0.65,0.45,0.9'/>"
				"<rgb name='color1' value='0.4,0.55,0.9'/></texture>"
			 ANISOTROPIC_BSDF("roughconductor") "</bsdf></shape></shape>"
			 "<shape type='instance'><ref id='g'/>"
				AT("<scale x='-0.4' y='0.5' z='0.6'/><translate x='1.1' y='0.6'/>" TURN) "</shape>"
			 "<shape type='instance'><ref id='g'/>" AT("<scale value='0.3'/><translate x='0.5' y='0.4' z='1.5'/>"
				TURN) "</shape>"
			 "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
			 "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape></scene>");
	const struct memory_file files[] = {{"test.xml", xml, (size_t)n}, {"m.obj", obj, size}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

/* Each material has parts with different normals, some from a bump map with 8 x 8 heights. a = 1: some are glass. */
static struct world *tilted_parts(const struct agreement_case *k)
{
	enum { SIDE = 8 };
	static const char head[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 8\n";
	static char xml[1 << 12];
	unsigned char hdr[sizeof head - 1 + 4 * SIDE * SIDE];
	memcpy(hdr, head, sizeof head - 1);
	for (size_t i = 0; i < SIDE * SIDE; i++) {
		unsigned char grey = (unsigned char)(16 + 40 * ((i * i + 3 * i) % 5));
		memcpy(hdr + sizeof head - 1 + 4 * i, (unsigned char[]){grey, grey, grey, 0x80}, 4);
	}
#define BUMP_MAPPED(scale, inner) \
	"<bsdf type='bumpmap'>" \
		"<float name='scale' value='" scale "'/>" \
		"<texture type='bitmap'><string name='filename' value='dents.hdr'/></texture>" \
		inner \
	"</bsdf>"
#define NORMAL_MAPPED(inner) \
	"<bsdf type='normalmap'>" \
		"<texture type='checkerboard'>" \
			"<rgb name='color0' value='0.7,0.4,0.9'/>" \
			"<rgb name='color1' value='0.35,0.6,0.9'/>" \
		"</texture>" \
		inner \
	"</bsdf>"
#define HALF_BLEND(a, b) "<bsdf type='blendbsdf'><float name='weight' value='0.5'/>" a b "</bsdf>"
#define METAL(alpha) "<bsdf type='roughconductor'><float name='alpha' value='" alpha "'/></bsdf>"
	int n = snprintf(xml, sizeof xml,
			 "<scene version='3.0.0'>" VIEW SKY
			 "<shape type='rectangle'>" AT("<scale value='3'/><rotate x='1' angle='-90'/>" TURN)
				HALF_BLEND(BUMP_MAPPED("0.3", GREY("0.7")), NORMAL_MAPPED(METAL("0.3"))) "</shape>"
			 "<shape type='sphere'>" AT("<scale value='0.5'/><translate x='-0.6' y='0.6'/>" TURN)
				HALF_BLEND("%s", BUMP_MAPPED("0.2", "<bsdf type='%s'/>")) "</shape>"
			 "<shape type='cube'>" AT("<scale value='0.4'/><rotate y='1' angle='30'/><translate x='0.6' y='0.4'/>" TURN)
			 "<bsdf type='twosided'>" HALF_BLEND(METAL("0.15"),
				NORMAL_MAPPED("<bsdf type='roughplastic'><float name='alpha' value='0.2'/></bsdf>")) "</bsdf></shape>"
			 "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
			 "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape></scene>",
			 k->a > 0 ? GLASS("1.5") : METAL("0.1"), k->a > 0 ? "diffuse" : "difftrans");
	const struct memory_file files[] = {{"test.xml", xml, (size_t)n}, {"dents.hdr", hdr, sizeof hdr}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

/* Normals bent so far that many face away from the camera. a = 1: some on rough glass. */
static struct world *turned_normals(const struct agreement_case *k)
{
#define STEEP_NORMALS(inner) \
	"<bsdf type='normalmap'>" \
		"<texture type='checkerboard'>" \
			"<rgb name='color0' value='0.9,0.4,0.8'/>" \
			"<rgb name='color1' value='0.2,0.8,0.75'/>" \
			"<transform name='to_uv'><scale value='4'/></transform>" \
		"</texture>" \
		inner \
	"</bsdf>"
	static char xml[1 << 12];
	snprintf(xml, sizeof xml, VIEW SKY
		 "<shape type='rectangle'>" AT("<scale value='3'/><rotate x='1' angle='-90'/>" TURN) STEEP_NORMALS(GREY("0.7")) "</shape>"
		 "<shape type='sphere'>" AT("<scale value='0.6'/><translate x='-0.6' y='0.65'/>" TURN) STEEP_NORMALS("%s") "</shape>"
		 "<shape type='cube'>" AT("<scale value='0.4'/><rotate y='1' angle='30'/><translate x='0.6' y='0.4'/>" TURN)
		 "<bsdf type='twosided'>" STEEP_NORMALS(
		 "<bsdf type='roughplastic'><float name='alpha' value='0.2'/></bsdf>") "</bsdf></shape>"
		 "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
		 "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape>",
		 k->a > 0 ? "<bsdf type='roughdielectric'><float name='alpha' value='0.2'/></bsdf>" : METAL("0.1"));
	return world_from_text(32, 32, "%s", xml);
}

/* A ball of coloured glass around a stone, which states no medium, and a bubble; beside it water with a lamp in it.
 * Everything is in haze of that density, and so is the camera. */
#define ABSORBING_MEDIUM(side, sigma) \
	"<medium type='homogeneous' name='" side "'>" \
		"<rgb name='sigma_a' value='" sigma "'/>" \
		"<spectrum name='sigma_s' value='0'/>" \
	"</medium>"
#define ROUGH(eta) "<bsdf type='roughdielectric'><float name='alpha' value='0.3'/><float name='int_ior' value='" eta "'/></bsdf>"
#define FOG(albedo, phase) \
	"<medium type='homogeneous' id='fog'>" \
		"<float name='sigma_t' value='%g'/>" \
		"<float name='albedo' value='" albedo "'/>" \
		phase \
	"</medium>"
#define FOG_OUTSIDE "<ref name='exterior' id='fog'/>"
#define VIEW_FROM_FOG \
	"<sensor type='perspective'>" \
		"<float name='fov' value='35'/>" \
		AT("<lookat origin='0.4,2.2,5' target='0,0.7,0' up='0,1,0'/>" TURN) \
		FILM \
		"<ref name='medium' id='fog'/>" \
	"</sensor>"
static struct world *absorbing_media(const struct agreement_case *k)
{
	return world_from_text(32, 32, FOG("0", "") VIEW_FROM_FOG GROUND SKY
			     "<shape type='sphere'>" AT("<scale value='0.7'/><translate x='-0.6' y='0.8'/>" TURN) ROUGH("1.5")
				FOG_OUTSIDE ABSORBING_MEDIUM("interior", "0.5,1.5,3") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.25'/><translate x='-0.6' y='0.6'/>" TURN) GREY("0.7") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.2'/><translate x='-0.5' y='1.1'/>" TURN) ROUGH("0.8")
				ABSORBING_MEDIUM("exterior", "0.5,1.5,3") "</shape>"
			     "<shape type='cube'>"
				AT("<scale value='0.4'/><rotate y='1' angle='20'/><translate x='0.7' y='0.5'/>" TURN)
				GLASS("1.33") FOG_OUTSIDE ABSORBING_MEDIUM("interior", "2,0.8,0.4") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.1'/><translate x='0.7' y='0.5'/>" TURN)
				"<emitter type='area'><rgb name='radiance' value='20'/></emitter></shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape>", k->a);
}

/* A coloured cloud around a stone and a lamp, which state no medium, beside milk in rough glass; everything,
 * including the camera, is in fog. */
static struct world *scattering_media(const struct agreement_case *k)
{
#define SCATTERING_MEDIUM(side, sigma, albedo, phase) \
	"<medium type='homogeneous' name='" side "'>" \
		"<rgb name='sigma_t' value='" sigma "'/>" \
		"<rgb name='albedo' value='" albedo "'/>" \
		phase \
	"</medium>"
	return world_from_text(32, 32, FOG("0.8", "<phase type='rayleigh'/>") VIEW_FROM_FOG GROUND SKY
			     "<shape type='sphere'>" AT("<scale value='0.7'/><translate x='-0.6' y='0.8'/>" TURN)
				"<bsdf type='null'/>" FOG_OUTSIDE SCATTERING_MEDIUM("interior", "0.5,1.5,3", "0.9,0.8,0.7",
				"<phase type='hg'><float name='g' value='0.6'/></phase>") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.25'/><translate x='-0.6' y='0.6'/>" TURN) GREY("0.7") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.1'/><translate x='-0.5' y='1.1'/>" TURN)
				"<emitter type='area'><rgb name='radiance' value='20'/></emitter></shape>"
			     "<shape type='cube'>"
				AT("<scale value='0.4'/><rotate y='1' angle='20'/><translate x='0.7' y='0.5'/>" TURN)
				ROUGH("1.33") FOG_OUTSIDE SCATTERING_MEDIUM("interior", "1,2,4", "1,0.95,0.9", "") "</shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape>", k->a);
}

/* A cloud of three colours around a stone and a lamp, with holes, beside rough glass that contains a cloud; a > 0:
 * both only absorb. Their grids are aligned with the axes, the scene is not. */
static double puff_density(double x, double y, double z, uint32_t channel)
{
	return fmax(0, 0.4 + sin(9 * x + 0.3 * channel) * cos(8 * y) * sin(7 * z + channel));
}

static struct world *heterogeneous_media(const struct agreement_case *k)
{
#define GRID(name, params) "<volume type='gridvolume' name='" name "'><string name='filename' value='puffs.vol'/>" params "</volume>"
#define HETEROGENEOUS_MEDIUM(scale, sigma_t, albedo) \
	"<medium type='heterogeneous' name='interior'>" \
		sigma_t albedo \
		"<float name='scale' value='" scale "'/>" \
	"</medium>"
#define GRID_TO_WORLD AT("<translate x='-.5' y='-.4' z='-.5'/><scale value='2.6'/>")
#define BLACK "<float name='albedo' value='0'/>"
#define CLOUD(albedo) HETEROGENEOUS_MEDIUM("3", GRID("sigma_t", GRID_TO_WORLD), albedo)
#define CLOUDED(albedo) HETEROGENEOUS_MEDIUM("4", GRID("sigma_t", GRID_TO_WORLD "<string name='filter_type' value='nearest'/>"), albedo)
	static char xml[1 << 13];
	static struct vol grid;
	bool black = k->a > 0;
	vol_make(&grid, (const uint32_t[3]){6, 5, 7}, 3, puff_density);
	for (size_t i = 0; i < 6 * 5 * 7 * 3; i++)
		grid.value[i] = fminf(grid.value[i], 1);
	vol_write(&grid);
	int n = snprintf(xml, sizeof xml, "<scene version='3.0.0'>" VIEW GROUND SKY
			 "<shape type='sphere'>" AT("<scale value='0.7'/><translate x='-0.6' y='0.8'/>" TURN)
				"<bsdf type='null'/>%s</shape>"
			 "<shape type='sphere'>" AT("<scale value='0.25'/><translate x='-0.6' y='0.6'/>" TURN) GREY("0.7") "</shape>"
			 "<shape type='sphere'>" AT("<scale value='0.1'/><translate x='-0.5' y='1.1'/>" TURN)
				"<emitter type='area'><rgb name='radiance' value='20'/></emitter></shape>"
			 "<shape type='cube'>" AT("<scale value='0.4'/><rotate y='1' angle='20'/><translate x='0.7' y='0.5'/>"
				TURN) ROUGH("1.33") "%s</shape>"
			 "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
			 "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape></scene>",
			 black ? CLOUD(BLACK) : CLOUD(GRID("albedo", GRID_TO_WORLD)),
			 black ? CLOUDED(BLACK) : CLOUDED("<rgb name='albedo' value='1,0.95,0.9'/>"));
	const struct memory_file files[] = {{"s.xml", xml, (size_t)n}, {"puffs.vol", grid.bytes, grid.size}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

/* A cloud of flakes whose orientation varies, around a stone and a lamp, beside rough glass with other flakes
 * inside. */
static double flake_matrix(double x, double y, double z, uint32_t channel)
{
	double c = cos(3 * x + y), s = sin(3 * x + y), thin = 0.05 + 0.4 * z;
	const double m[] = {c * c + thin * s * s, s * s + thin * c * c, 0.3, (1 - thin) * c * s, 0, 0};
	return m[channel];
}

static struct world *flake_media(const struct agreement_case *k)
{
	(void)k;
	static char xml[1 << 13];
	static struct vol grid, matrices;
	vol_make(&grid, (const uint32_t[3]){6, 5, 7}, 1, puff_density);
	vol_make(&matrices, (const uint32_t[3]){6, 5, 7}, 6, flake_matrix);
#define SGGX(volume) "<phase type='sggx'>" volume "</phase>"
	int n = snprintf(xml, sizeof xml, "%s", "<scene version='3.0.0'>" VIEW GROUND SKY
			 "<shape type='sphere'>" AT("<scale value='0.7'/><translate x='-0.6' y='0.8'/>" TURN)
				"<bsdf type='null'/>" HETEROGENEOUS_MEDIUM("4", GRID("sigma_t", GRID_TO_WORLD),
				"<rgb name='albedo' value='0.9,0.8,0.7'/>" SGGX("<volume type='gridvolume' name='S'>"
				"<string name='filename' value='flakes.vol'/>" GRID_TO_WORLD "</volume>")) "</shape>"
			 "<shape type='sphere'>" AT("<scale value='0.25'/><translate x='-0.6' y='0.6'/>" TURN) GREY("0.7") "</shape>"
			 "<shape type='sphere'>" AT("<scale value='0.1'/><translate x='-0.5' y='1.1'/>" TURN)
				"<emitter type='area'><rgb name='radiance' value='20'/></emitter></shape>"
			 "<shape type='cube'>" AT("<scale value='0.4'/><rotate y='1' angle='20'/><translate x='0.7' y='0.5'/>"
				TURN) ROUGH("1.33") SCATTERING_MEDIUM("interior", "1,2,4", "1,0.95,0.9",
				SGGX("<volume type='constvolume' name='S'><string name='value' value='.8,.3,.5,.2,-.1,.1'/>"
				"</volume>")) "</shape>"
			 "<shape type='rectangle'>" AT("<scale value='0.4'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
			 "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape></scene>");
	const struct memory_file files[] = {{"s.xml", xml, (size_t)n}, {"puffs.vol", grid.bytes, grid.size},
					    {"flakes.vol", matrices.bytes, matrices.size}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

/* A lamp in a cloud that states a different medium around itself, and a lamp outside, whose light enters the cloud
 * through a face that states haze there. Most light sub-paths are in other media than the camera's. */
static struct world *mismatched_media(const struct agreement_case *k)
{
	(void)k;
	return world_from_text(32, 32, VIEW GROUND
			     "<medium type='homogeneous' id='haze'><float name='sigma_t' value='0.8'/>"
				"<float name='albedo' value='0.6'/></medium>"
			     "<shape type='sphere'>" AT("<scale value='0.8'/><translate y='0.85'/>" TURN)
				"<bsdf type='null'/><ref name='exterior' id='haze'/>"
				SCATTERING_MEDIUM("interior", "1.5,1,0.5", "0.9,0.9,0.9", "") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.2'/><translate x='-0.2' y='0.8'/>" TURN)
				"<emitter type='area'><rgb name='radiance' value='9'/></emitter><ref name='exterior' id='haze'/></shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.5'/><rotate x='1' angle='90'/><translate y='2.4'/>" TURN)
			     "<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape>");
}

const struct agreement_case agreement_cases[] = {
	{"mixed scales", "1 on a floor of 10", objects_on_floor, 1, 10, 5, 1024, 512, ALL_INTEGRATORS, 0.02},
	{"mixed scales", "1 on a floor of 1e6", objects_on_floor, 1, 1e6, 5, 1024, 512, ALL_INTEGRATORS, 0.02},
	{"mixed scales", "1e-6 on a floor of 1e3", objects_on_floor, 1e-6, 1e3, 5, 1024, 512, ALL_INTEGRATORS, 0.02},
	{"mixed scales", "1 beside the middle of 1e6", objects_on_offset_floor, 1, 1e6, 5, 1024, 512, ALL_INTEGRATORS, 0.02},
	{"mixed scales", "1 on a ball of 1e6", objects_on_ball, 1, 1e6, 5, 1024, 512, ALL_INTEGRATORS, 0.02},
	{"mixed scales", "1e-6 on 1 on 1e6", objects_on_table, 1e-6, 1e6, 5, 1024, 512, ALL_INTEGRATORS, 0.02},
	{"mirror box", "0.95 to depth 64", mirror_box, 0.95, 0, 64, 256, 128, {"bdpt", "hslt"}, 0.02},
	{"fibre", "100 times as long as wide", fibre, 0.02, 0, 128, 64, 64, {"bdpt", "hslt"}, 0.02},
	{"coinciding surfaces", "lamps in the planes of glass", lamp_in_glass, 0.7, 0, 6, 256, 256, ALL_INTEGRATORS, 0.02},
	{"coinciding surfaces", "lamps wider than the glass", lamp_in_glass, 1.3, 0, 6, 256, 1024, ALL_INTEGRATORS, 0.02},
	{"coinciding surfaces", "glass beside water on a ground", glass_and_water, 0, 0, 8, 256, 256, ALL_INTEGRATORS, 0.02},
	{"coinciding surfaces", "balls of glass, water and air", balls_in_balls, 0, 0, 8, 256, 256, ALL_INTEGRATORS, 0.02},
	{"coinciding surfaces", "balls 1e-7 apart", balls_in_a_shell, 1e-7, 0, 8, 256, 256, ALL_INTEGRATORS, 0.02},
	{"coinciding surfaces", "a lamp three times", repeated_lamp, 0, 0, 5, 256, 768, ALL_INTEGRATORS, 0.02},
	{"emitter touches glass", "in a point and in an edge", lamp_on_glass, 0, 0, 6, 256, 256, ALL_INTEGRATORS, 0.02},
	{"bright texel", "1.3e8 in a sky of 1", bright_texel, 0, 0, 5, 256, 512, ALL_INTEGRATORS, 0.02},
	{"two-sided lamps", "a sheet, and a box around a ball", two_sided_lamps, 0, 0, 6, 512, 1024, ALL_INTEGRATORS, 0.02},
	{"beams", "of a square and of a disk", beams, 0, 0, 5, 2048, 1024, ALL_INTEGRATORS, 0.02},
	{"clipped view", "a wall before the near plane", clipped_view, 0, 0, 6, 512, 512, ALL_INTEGRATORS, 0.02},
	{"clipped view", "a wall behind an orthographic camera", clipped_view, 1, 0, 6, 512, 512, ALL_INTEGRATORS, 0.02},
	{"tilted parts", "rough metal, paper and plastic", tilted_parts, 0, 0, 5, 512, 512, ALL_INTEGRATORS, 0.02},
	{"tilted parts", "chalk and glass", tilted_parts, 1, 0, 6, 1024, 1024, ALL_INTEGRATORS, 0.02},
	{"smooth tangents", "brushed metal and glass", smooth_tangents, 0, 0, 6, 1024, 1024, ALL_INTEGRATORS, 0.02},
	{"absorbing media", "glass and water", absorbing_media, 0, 0, 8, 2048, 1024, ALL_INTEGRATORS, 0.02},
	{"absorbing media", "glass and water in haze", absorbing_media, 0.3, 0, 8, 2048, 1024, ALL_INTEGRATORS, 0.07},
	{"absorbing media", "that vary", heterogeneous_media, 1, 0, 8, 1024, 1024, ALL_INTEGRATORS, 0.02},
	{"scattering media", "that vary", heterogeneous_media, 0, 0, 10, 1024, 512, {"bdpt", "pssmlt", "hslt", "erpt"}, 0.03},
	{"scattering media", "of flakes", flake_media, 0, 0, 10, 1024, 512, {"bdpt", "pssmlt", "hslt", "erpt"}, 0.03},
	{"scattering media", "a cloud and milk", scattering_media, 0, 0, 10, 1024, 512, {"bdpt", "pssmlt", "hslt", "erpt"}, 0.03},
	{"scattering media", "a cloud and milk in fog", scattering_media, 0.2, 0, 10, 4096, 2048, {"bdpt", "pssmlt", "hslt", "erpt"}, 0.04},
	{"scattering media", "that do not fit together", mismatched_media, 0, 0, 6, 1024, 1024,
		{"bdpt", "pssmlt", "hslt", "erpt"}, 0.02},
	{"displaced pole", "rough metal, steps of 0.02", displaced_pole, 0.02, 0, 6, 256, 256, ALL_INTEGRATORS, 0.02},
	{"displaced pole", "rough metal, steps of 0.2", displaced_pole, 0.2, 0, 6, 512, 512, ALL_INTEGRATORS, 0.02},
	{"displaced pole", "rough glass, steps of 0.2", displaced_pole, 0.2, 1, 8, 1024, 1024, ALL_INTEGRATORS, 0.02},
	{"turned normals", "metal, chalk and plastic", turned_normals, 0, 0, 5, 512, 512, ALL_INTEGRATORS, 0.02},
	{"turned normals", "glass, chalk and plastic", turned_normals, 1, 0, 6, 1024, 1024, ALL_INTEGRATORS, 0.02},
	{"mixed scales", "1 on a tilted floor of 1e8", objects_on_tilted_floor, 1, 1e8, 5, 1024, 512, {"bdpt", "hslt"}, 0.02},
	{"mixed scales", "1 on a floor of 1e12", objects_on_floor, 1, 1e12, 5, 1024, 512, ALL_INTEGRATORS, 0.02},
	{"mixed scales", "1e18 on a floor of 1e19", objects_on_floor, 1e18, 1e19, 5, 1024, 512, ALL_INTEGRATORS, 0.02},
	{NULL, NULL, NULL, 0, 0, 0, 0, 0, {NULL}, 0},
};
