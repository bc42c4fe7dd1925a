#include "tests/support/agree_scenes.h"

#include "tests/support/worlds.h"

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
#define GREY(value) "<bsdf type='diffuse'><rgb name='reflectance' value='" value "'/></bsdf>"
#define FILM "<film type='hdrfilm'><rfilter type='box'/></film>"
#define ALL {"bdpt", "pssmlt", "hslt"}

/* A cube and a ball of metal under a lamp, a few `a` large, on a ground that is `b` wide. TURN: the same for all, so that nothing
 * is along the axes. */
#define TURN "<rotate x='1' z='0.3' angle='20'/>"
#define SCALED "<scale value='%.17g'/>" TURN
#define SMALL_THINGS                                                                                                            \
	"<sensor type='perspective'><float name='fov' value='40'/><float name='near_clip' value='%.17g'/><float name='far_clip' value='%.17g'/>" \
	AT("<lookat origin='0,2.5,6' target='0,0.6,0' up='0,1,0'/>" SCALED) FILM "</sensor>"                                            \
	"<shape type='cube'>" AT("<scale value='0.5'/><rotate y='1' angle='25'/><translate x='-0.9' y='0.5'/>" SCALED) GREY("0.5") "</shape>" \
	"<shape type='sphere'>" AT("<scale value='0.6'/><translate x='0.8' y='0.6' z='0.3'/>" SCALED)                                   \
	"<bsdf type='roughconductor'><float name='alpha' value='0.2'/></bsdf></shape>"                                                 \
	"<shape type='rectangle'>" AT("<scale value='0.7'/><rotate x='1' angle='90'/><translate y='3'/>" SCALED)                        \
	"<emitter type='area'><rgb name='radiance' value='5'/></emitter></shape>"
#define SMALL_VALUES(s) 0.01 * (s), 1000 * (s), s, s, s, s

static struct world *on_a_floor(const struct agree_case *k)
{
	return world_of_text(32, 32, SMALL_THINGS "<shape type='rectangle'>" AT("<rotate x='1' angle='-90'/>" SCALED) GREY("0.7") "</shape>",
			     SMALL_VALUES(k->a), k->b);
}

/* The floor is not under its own centre, a second one hangs far above, and the sun is a ball as far away as that. */
static struct world *beside_a_floor(const struct agree_case *k)
{
	double b = k->b;
	return world_of_text(32, 32, SMALL_THINGS
			     "<shape type='rectangle'>" AT("<rotate x='1' angle='-90'/><translate x='0.9' z='-0.77'/>" SCALED) GREY("0.7") "</shape>"
			     "<shape type='rectangle'>" AT("<rotate x='1' angle='90'/><translate y='1.5'/>" SCALED) GREY("0.7") "</shape>"
			     "<shape type='sphere'>" AT("<scale value='0.1'/><translate x='0.5' y='1' z='0.5'/>" SCALED)
			     "<emitter type='area'><rgb name='radiance' value='40'/></emitter></shape>",
			     SMALL_VALUES(k->a), b, b, b);
}

static struct world *on_a_ball(const struct agree_case *k)
{
	return world_of_text(32, 32, SMALL_THINGS "<shape type='sphere'>" AT("<translate y='-1'/>" SCALED) GREY("0.7") "</shape>",
			     SMALL_VALUES(k->a), k->b);
}

/* What is small stands on a table, that on the floor. */
static struct world *on_a_table(const struct agree_case *k)
{
	return world_of_text(32, 32, SMALL_THINGS
			     "<shape type='cube'>" AT("<translate y='-1'/>" SCALED) GREY("0.7") "</shape>"
			     "<shape type='rectangle'>" AT("<rotate x='1' angle='-90'/><translate y='-2e-6'/>" SCALED) GREY("0.7") "</shape>",
			     SMALL_VALUES(k->a), sqrt(k->a * k->b), k->b);
}

/* All walls mirror `a` of the light; a lamp hangs within. */
static struct world *mirror_box(const struct agree_case *k)
{
	return world_of_text(32, 32, SENSOR("0,0.2,0.9", "0.1,-0.1,-1")
			     "<shape type='cube'><bsdf type='conductor'><string name='material' value='none'/>"
			     "<rgb name='specular_reflectance' value='%.17g'/></bsdf></shape>"
			     "<shape type='sphere'><point name='center' x='0.3' y='0.2' z='-0.4'/><float name='radius' value='0.15'/>"
			     "<emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>",
			     k->a);
}

/* A rod of glass, `a` wide and 2 long, that is lit at one end and looked into at the other, from so near that light has bounced
 * 64 times and more. */
static struct world *fibre(const struct agree_case *k)
{
	return world_of_text(32, 32,
			     "<sensor type='perspective'><float name='fov' value='100'/><float name='near_clip' value='%.17g'/>"
			     AT("<lookat origin='0,0,%.17g' target='0,0,0' up='0,1,0'/>") FILM "</sensor>"
			     "<shape type='cube'>" AT("<scale x='%.17g' y='%.17g' z='1'/>")
			     "<bsdf type='dielectric'><float name='int_ior' value='1.5'/></bsdf></shape>"
			     "<shape type='rectangle'>" AT("<scale value='0.5'/><translate z='-1.25'/>")
			     "<emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>",
			     0.01 * k->a, 1 + 0.1 * k->a, 0.5 * k->a, 0.5 * k->a);
}

const struct agree_case agree_cases[] = {
	{"mixed scales", "1 on a floor of 10", on_a_floor, 1, 10, 5, 1024, 512, ALL, 0.05},
	{"mixed scales", "1 on a floor of 1e6", on_a_floor, 1, 1e6, 5, 1024, 512, ALL, 0.05},
	{"mixed scales", "1e-6 on a floor of 1e3", on_a_floor, 1e-6, 1e3, 5, 1024, 512, ALL, 0.05},
	{"mixed scales", "1 beside the middle of 1e6", beside_a_floor, 1, 1e6, 5, 1024, 512, ALL, 0.05},
	{"mixed scales", "1 on a ball of 1e6", on_a_ball, 1, 1e6, 5, 1024, 512, ALL, 0.05},
	{"mixed scales", "1e-6 on 1 on 1e6", on_a_table, 1e-6, 1e6, 5, 1024, 512, ALL, 0.05},
	{"mirror box", "0.95 to depth 64", mirror_box, 0.95, 0, 64, 256, 128, {"bdpt", "hslt"}, 0.15},
	{"fibre", "100 times as long as wide", fibre, 0.02, 0, 128, 1024, 256, {"bdpt", "hslt"}, 0.6},
	{NULL, NULL, NULL, 0, 0, 0, 0, 0, {NULL}, 0},
};
