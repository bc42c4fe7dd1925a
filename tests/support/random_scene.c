/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Writes the XML piece by piece: camera, walls, shapes, environment, lamp, beam. A material's nodes become nested
 * elements. If the text does not fit into the body, the test fails.
 */
#include "tests/support/random_scene.h"

#include "tests/support/append_format.h"
#include "tests/support/dice.h"
#include "tests/support/measured_file.h"
#include "tests/support/memory_assets.h"
#include "tests/support/nodes.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

struct scene_maker {
	struct random_scene *s;
	struct dice d;
	const char *const *materials;
	uint32_t material_count;
	bool has_relief, has_fog;
};

/* clang-format off */
#define PUT(m, ...) append_format((m)->s->body, sizeof (m)->s->body, &(m)->s->used, __VA_ARGS__)
/* clang-format on */

static bool draw_bool(struct scene_maker *m, double p)
{
	return dice_uniform(&m->d) < p;
}

static double draw_between(struct scene_maker *m, double low, double high)
{
	return dice_between(&m->d, low, high);
}

/* Draws one number per call, because the order in which arguments are evaluated is the compiler's choice. */
static void put_between(struct scene_maker *m, const char *before, double low, double high, const char *after)
{
	PUT(m, "%s%.3f%s", before, draw_between(m, low, high), after);
}

static void put_rgb(struct scene_maker *m, const char *name, double low, double high)
{
	PUT(m, "<rgb name='%s' value='", name);
	put_between(m, "", low, high, ",");
	put_between(m, "", low, high, ",");
	put_between(m, "", low, high, "'/>");
}

static void put_node(struct scene_maker *m, const struct scene_node *n, const char *name);

static void put_property(struct scene_maker *m, const struct property *p)
{
	const struct value *v = &p->value;
	switch (v->type) {
	case VALUE_RGB:
		PUT(m, "<rgb name='%s' value='%.17g,%.17g,%.17g'/>", p->name, v->as.rgb[0], v->as.rgb[1], v->as.rgb[2]);
		break;
	case VALUE_FLOAT:
		PUT(m, "<float name='%s' value='%.17g'/>", p->name, v->as.number);
		break;
	case VALUE_BOOL:
		PUT(m, "<boolean name='%s' value='%s'/>", p->name, v->as.boolean ? "true" : "false");
		break;
	case VALUE_STRING:
		PUT(m, "<string name='%s' value='%s'/>", p->name, v->as.string);
		break;
	case VALUE_NODE:
		put_node(m, v->as.node, p->name);
		break;
	default:
		fail_msg("%s has a value that materials of tests have not", p->name);
	}
}

/* name: NULL if it has none. */
static void put_node(struct scene_maker *m, const struct scene_node *n, const char *name)
{
	const char *element = n->cls == PLUGIN_BSDF ? "bsdf" : "texture";
	PUT(m, "<%s type='%s'", element, n->type);
	if (name)
		PUT(m, " name='%s'", name);
	PUT(m, ">");
	for (uint32_t i = 0; i < n->property_count; i++)
		put_property(m, &n->properties[i]);
	for (uint32_t i = 0; i < n->child_count; i++)
		put_node(m, n->children[i], NULL);
	PUT(m, "</%s>", element);
}

/* Begins a normal map of tiles with two normals, up to 60 degrees from the surface's. */
static void begin_relief(struct scene_maker *m)
{
	PUT(m, "<bsdf type='normalmap'><texture type='checkerboard'>");
	for (int i = 0; i < 2; i++) {
		double angle = draw_between(m, 0, 60 * M_PI / 180), around = draw_between(m, 0, 2 * M_PI);
		PUT(m, "<rgb name='color%d' value='%.3f,%.3f,%.3f'/>", i, 0.5 + 0.5 * sin(angle) * cos(around),
		    0.5 + 0.5 * sin(angle) * sin(around), 0.5 + 0.5 * cos(angle));
	}
	PUT(m, "<transform name='to_uv'><scale value='%u'/></transform></texture>", 1 + dice_below(&m->d, 6));
}

static void put_material(struct scene_maker *m)
{
	const char *chosen = m->materials[dice_below(&m->d, m->material_count)];
	bool has_relief =
		m->has_relief && draw_bool(m, 0.6) && !strstr(chosen, "bumpmap") && !strstr(chosen, "normalmap");
	if (has_relief)
		begin_relief(m);
	size_t used = strlen(m->s->materials);
	append_format(m->s->materials, sizeof m->s->materials, &used, "%s%s", used ? "; " : "", chosen);
	struct arena a = {0};
	put_node(m, node_make_bsdf(&a, chosen), NULL);
	arena_fini(&a);
	if (has_relief)
		PUT(m, "</bsdf>");
}

/* Adds a transform for shapes of about the size of the unit ball: stretched, rotated, and moved into a box around
 * (0, y, 0). */
static void put_transform(struct scene_maker *m, double size, double y, double reach)
{
	vec3 axis = dice_direction(&m->d);
	put_between(m, "<transform name='to_world'><scale x='", 0.5 * size, 1.3 * size, "'");
	put_between(m, " y='", 0.5 * size, 1.3 * size, "'");
	put_between(m, " z='", 0.5 * size, 1.3 * size, "'/>");
	PUT(m, "<rotate x='%.3f' y='%.3f' z='%.3f'", axis.x, axis.y, axis.z);
	put_between(m, " angle='", 0, 360, "'/>");
	put_between(m, "<translate x='", -reach, reach, "'");
	put_between(m, " y='", y - reach, y + reach, "'");
	put_between(m, " z='", -reach, reach, "'/></transform>");
}

static const char wedge[] =
	"v -1 -1 -1\nv 1 -1 -1\nv 1 -1 1\nv -1 -1 1\nv -1 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
	"f 1/1 2/2 3/3 4/4\nf 4/1 3/2 6/3 5/4\nf 2/1 1/2 5/3 6/4\nf 1/1 4/2 5/3\nf 3/1 2/2 6/3\n";
static const char curve[] = "-1 -0.5 0 0.2\n-0.4 0.7 0.3 0.3\n0.3 -0.6 0.2 0.2\n1 0.4 -0.4 0.3\n";

static void put_phase(struct scene_maker *m)
{
	unsigned k = dice_below(&m->d, 3);
	PUT(m, "<phase type='%s'>", k == 0 ? "isotropic" : k == 1 ? "rayleigh" : "hg");
	if (k == 2)
		put_between(m, "<float name='g' value='", -0.8, 0.8, "'/>");
	PUT(m, "</phase>");
}

/* Adds a medium that absorbs or, in fog, may scatter. */
static void put_medium(struct scene_maker *m, const char *name)
{
	PUT(m, "<medium type='homogeneous' name='%s'>", name);
	if (m->has_fog && draw_bool(m, 0.8)) {
		put_rgb(m, "albedo", 0.3, 1);
		put_phase(m);
	} else
		PUT(m, "<float name='albedo' value='0'/>");
	put_rgb(m, "sigma_t", 0, 2);
	PUT(m, "</medium>");
}

static const struct {
	const char *type, *inner;
} shapes[] = {
	{"sphere", ""},
	{"cube", ""},
	{"disk", ""},
	{"rectangle", ""},
	{"cylinder", "<point name='p0' x='0' y='0' z='-1'/>"},
	{"obj", "<string name='filename' value='wedge.obj'/>"},
	{"heightfield", "<string name='filename' value='picture.ppm'/><float name='scale' value='0.5'/>"},
	{"linearcurve", "<string name='filename' value='curve.txt'/>"},
	{"bsplinecurve", "<string name='filename' value='curve.txt'/>"},
	{"sphere",
	 "<texture name='displacement' type='checkerboard'><float name='color0' value='0'/><float name='color1' value='1'/>"
	 "<transform name='to_uv'><scale x='6' y='6'/></transform></texture><float name='displacement_scale' value='0.05'/>"
	 "<integer name='displacement_level' value='4'/>"},
};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static void put_shape(struct scene_maker *m)
{
	unsigned k = dice_below(&m->d, SHAPES + 1);
	if (k == SHAPES) { /* the same mesh at two places */
		size_t id = m->s->used;
		PUT(m, "<shape type='shapegroup' id='g%zu'><shape type='cylinder'>", id);
		put_material(m);
		PUT(m, "</shape></shape>");
		for (int i = 0; i < 2; i++) {
			PUT(m, "<shape type='instance'><ref id='g%zu'/>", id);
			put_transform(m, draw_between(m, 0.3, 0.6), -0.2, 1);
			PUT(m, "</shape>");
		}
		return;
	}
	PUT(m, "<shape type='%s'>%s", shapes[k].type, shapes[k].inner);
	if (draw_bool(m, 0.1))
		PUT(m, "<boolean name='flip_normals' value='true'/>");
	put_transform(m, draw_between(m, 0.3, 0.7), -0.2, 1);
	if (m->has_fog && draw_bool(m, 0.4))
		PUT(m, "<bsdf type='null'/>");
	else
		put_material(m);
	/* on either side of any shape, closed or not: most of these media contradict each other */
	if (draw_bool(m, m->has_fog ? 0.7 : 0.2))
		put_medium(m, draw_bool(m, 0.7) ? "interior" : "exterior");
	PUT(m, "</shape>");
}

static void put_wall(struct scene_maker *m, const char *turn, const char *move)
{
	PUT(m,
	    "<shape type='rectangle'><transform name='to_world'><scale value='2'/>%s<translate %s/></transform>"
	    "<bsdf type='twosided'><bsdf type='diffuse'>",
	    turn, move);
	if (draw_bool(m, 0.3)) {
		PUT(m, "<texture name='reflectance' type='checkerboard'>");
		put_rgb(m, "color0", 0.05, 0.8);
		put_rgb(m, "color1", 0.05, 0.8);
		PUT(m, "</texture>");
	} else
		put_rgb(m, "reflectance", 0.05, 0.8);
	PUT(m, "</bsdf></bsdf></shape>");
}

static void put_daylight(struct scene_maker *m, const char *type)
{
	PUT(m, "<emitter type='%s'><transform name='to_world'><rotate x='1' angle='-90'/></transform>", type);
	put_between(m, "<vector name='sun_direction' y='1' x='", -1, 1, "'");
	put_between(m, " z='", -1, 1, "'/>");
	PUT(m, "<float name='sun_scale' value='0.02'/><float name='sky_scale' value='0.05'/>"
	       "<float name='sun_radius_scale' value='40'/></emitter>");
}

static void put_environment(struct scene_maker *m)
{
	switch (dice_below(&m->d, 5)) {
	case 0:
		PUT(m, "<emitter type='constant'>");
		put_rgb(m, "radiance", 0.1, 1);
		PUT(m, "</emitter>");
		break;
	case 1:
		PUT(m, "<emitter type='envmap'><string name='filename' value='picture.ppm'/></emitter>");
		break;
	case 2:
		put_daylight(m, "sky");
		break;
	case 3:
		put_daylight(m, "sun");
		break;
	default:
		put_daylight(m, "sunsky");
	}
}

/* Adds an emitter that paths can hit. */
static void put_lamp(struct scene_maker *m)
{
	unsigned k = dice_below(&m->d, SHAPES - 1); /* any shape except the displaced ball */
	PUT(m, "<shape type='%s'>%s<emitter type='area'>", shapes[k].type, shapes[k].inner);
	if (draw_bool(m, 0.2))
		PUT(m,
		    "<texture name='radiance' type='bitmap'><string name='filename' value='picture.ppm'/></texture>");
	else
		put_rgb(m, "radiance", 2, 9);
	PUT(m, "%s</emitter>", draw_bool(m, 0.3) ? "<boolean name='two_sided' value='true'/>" : "");
	put_transform(m, draw_between(m, 0.25, 0.5), 1.2, 0.5);
	if (draw_bool(m, 0.2))
		put_material(m);
	PUT(m, "</shape>");
}

/* Adds an emitter under the ceiling, aimed at the floor. */
static void begin_aimed_emitter(struct scene_maker *m, const char *type)
{
	PUT(m, "<emitter type='%s'><transform name='to_world'><lookat target='0,-1,0' up='0,0,1' origin='", type);
	put_between(m, "", -1, 1, ",1.8,");
	put_between(m, "", -1, 1, "'/></transform>");
}

static void put_beam(struct scene_maker *m)
{
	m->s->needs_light_paths = true;
	switch (dice_below(&m->d, 5)) {
	case 0:
		put_between(m,
			    "<shape type='disk'><transform name='to_world'><scale value='0.4'/><rotate x='1' angle='",
			    70, 110, "'/><translate y='1.7'/></transform><emitter type='directionalarea'>");
		put_rgb(m, "radiance", 2, 9);
		PUT(m, "</emitter></shape>");
		break;
	case 1:
		put_between(m, "<emitter type='point'><point name='position' y='1.6' x='", -1, 1, "'");
		put_between(m, " z='", -1, 1, "'/>");
		put_rgb(m, "intensity", 2, 9);
		PUT(m, "</emitter>");
		break;
	case 2:
		begin_aimed_emitter(m, "spot");
		put_rgb(m, "intensity", 4, 19);
		put_between(m, "<float name='cutoff_angle' value='", 20, 60, "'/></emitter>");
		break;
	case 3:
		begin_aimed_emitter(m, "projector");
		PUT(m,
		    "<texture name='irradiance' type='bitmap'><string name='filename' value='picture.ppm'/></texture>"
		    "<float name='scale' value='20'/>");
		put_between(m, "<float name='fov' value='", 30, 70, "'/></emitter>");
		break;
	default:
		put_between(m, "<emitter type='directional'><vector name='direction' y='-1' x='", -0.8, 0.8, "'");
		put_between(m, " z='", -0.8, 0.8, "'/>");
		put_rgb(m, "irradiance", 1, 3);
		PUT(m, "</emitter>");
	}
}

static void put_camera(struct scene_maker *m)
{
	static const char *const types[] = {"perspective", "perspective", "thinlens", "orthographic"};
	unsigned k = dice_below(&m->d, 4);
	PUT(m, "<sensor type='%s'>", types[k]);
	if (draw_bool(m, 0.3))
		put_between(m, "<float name='near_clip' value='", 0.1, 2, "'/>");
	if (k < 3)
		put_between(m, "<float name='fov' value='", 35, 60, "'/>");
	if (k < 3 && draw_bool(m, 0.2))
		put_between(m, "<float name='principal_point_offset_x' value='", -0.3, 0.3, "'/>");
	if (k == 2) {
		put_between(m, "<float name='aperture_radius' value='", 0.02, 0.2, "'/>");
		put_between(m, "<float name='focus_distance' value='", 2.5, 4.5, "'/>");
	}
	PUT(m, "<transform name='to_world'>%s<lookat up='0,1,0' origin='", k == 3 ? "<scale x='2' y='2' z='1'/>" : "");
	put_between(m, "", -1, 1, ",");
	put_between(m, "", -0.5, 1, ",3.8' target='");
	put_between(m, "", -0.4, 0.4, ",0,0'/></transform>");
	if (m->has_fog && draw_bool(m, 0.3))
		put_medium(m, "medium");
	PUT(m, "<film type='hdrfilm'><rfilter type='%s'/></film></sensor>", draw_bool(m, 0.5) ? "box" : "gaussian");
}

void random_scene_make(struct random_scene *s, uint64_t number, const char *const *materials, uint32_t count)
{
	static const char *const walls[][2] = {
		{"<rotate x='1' angle='90'/>", "y='2'"},    {"", "z='-2'"},
		{"<rotate y='1' angle='90'/>", "x='-2'"},   {"<rotate y='1' angle='-90'/>", "x='2'"},
		{"<rotate y='1' angle='180'/>", "z='4.2'"},
	};
	char name[64];
	snprintf(name, sizeof name, "random scene %llu", (unsigned long long)number);
	*s = (struct random_scene){.used = 0};
	struct scene_maker m = {.s = s,
				.d = dice_for_test(name),
				.materials = materials,
				.material_count = count,
				.has_relief = number >= RANDOM_SCENES_WITH_RELIEF && number < RANDOM_SCENES_WITH_FOG,
				.has_fog = number >= RANDOM_SCENES_WITH_FOG};
	PUT(&m, "<integrator type='volpath'><integer name='max_depth' value='%u'/></integrator>",
	    3 + dice_below(&m.d, 5));
	put_camera(&m);
	bool room = draw_bool(&m, 0.6);
	put_wall(&m, "<rotate x='1' angle='-90'/>", "y='-1.6'");
	for (unsigned i = 0; room && i < sizeof walls / sizeof *walls; i++)
		if (draw_bool(&m, 0.85))
			put_wall(&m, walls[i][0], walls[i][1]);
	for (unsigned i = 0, n = 2 + dice_below(&m.d, 3); i < n; i++)
		put_shape(&m);
	if (!room || draw_bool(&m, 0.2))
		put_environment(&m);
	if (room || draw_bool(&m, 0.5))
		put_lamp(&m);
	if (draw_bool(&m, 0.25))
		put_beam(&m);
}

struct world *random_scene_world(const struct random_scene *s, uint32_t width, uint32_t height)
{
	enum { SIDE = 8, OWN_FILES = 4, MEASURED_FILES = 4 };
	static char xml[sizeof s->body + 64];
	static unsigned char picture[16 + 3 * SIDE * SIDE];
	int n = snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", s->body);
	int head = sprintf((char *)picture, "P6 %d %d 255\n", SIDE, SIDE);
	for (int i = 0; i < 3 * SIDE * SIDE; i++)
		picture[head + i] = (unsigned char)(40 + (i * 37 + i / SIDE * 91) % 200);
	struct memory_file files[OWN_FILES + MEASURED_FILES + 1] = {
		{"test.xml", xml, (size_t)n},
		{"picture.ppm", picture, (size_t)head + 3 * SIDE * SIDE},
		{"wedge.obj", wedge, sizeof wedge - 1},
		{"curve.txt", curve, sizeof curve - 1}};
	assert_null(measured_file_all()[MEASURED_FILES].name);
	memcpy(files + OWN_FILES, measured_file_all(), MEASURED_FILES * sizeof *files);
	return world_from_files(width, height, files);
}

void random_scene_parse_range(const char *text, uint64_t *first, uint64_t *last)
{
	unsigned long long a = 0, b = 0;
	int n = sscanf(text, "%llu-%llu", &a, &b);
	*first = a;
	*last = n == 2 ? b : a;
}
