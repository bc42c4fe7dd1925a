/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The light that a moving lamp sends to a plane is an integral over time: of the irradiance from a ball, which falls
 * with the square of the distance, from a polygon (Lambert 1760), from a beam, and from a projector. Statistics as in
 * tests/support/agreement.h (level 1e-4 over the suite, power printed and bounded).
 */
#include "tests/support/agreement.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

#define TO(inner) "<transform name='to_world'>" inner "</transform>"
#define KEYS(a, b)                                                                                              \
	"<animation name='to_world'><transform time='1'>" a "</transform><transform time='3'>" b "</transform>" \
	"</animation>"
#define BOX_FILM "<film type='hdrfilm'><rfilter type='box'/></film>"

#define SHUTTER "<float name='shutter_open' value='1'/><float name='shutter_close' value='3'/>"
#define SHINES(radiance) "<emitter type='area'><float name='radiance' value='" radiance "'/></emitter>"

/* The half sides, or the radius, and the position of the light at one time. */
struct light_state {
	double a, b, x, height;
};
typedef struct light_state light_fn(double t);

static struct light_state sliding_light(double t)
{
	return (struct light_state){.a = 0.2, .b = 0.2, .x = -1.5 + 3 * t, .height = 1.5};
}

static struct light_state rising_light(double t)
{
	return (struct light_state){.a = 0.1 + 0.3 * t, .b = 0.1 + 0.3 * t, .height = 1.5 + t};
}

static struct light_state stretching_light(double t)
{
	return (struct light_state){.a = 0.1 + 0.8 * t, .b = 0.6 - 0.4 * t, .height = 1.5 + 0.5 * t};
}

/* Returns the irradiance at the point (x, y, 0), with its normal towards +z, from a light of strength 1. */
typedef double irradiance_fn(const struct light_state *l, double x, double y);

static double irradiance_of_ball(const struct light_state *l, double x, double y)
{
	double d2 = (x - l->x) * (x - l->x) + y * y + l->height * l->height;
	return M_PI * l->a * l->a * l->height / (d2 * sqrt(d2));
}

static double irradiance_of_card(const struct light_state *l, double x, double y)
{
	const double side[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
	double sum = 0;
	for (int i = 0; i < 4; i++) {
		const double *p = side[i], *q = side[(i + 1) % 4];
		vec3 u = {l->x + p[0] * l->a - x, p[1] * l->b - y, l->height},
		     v = {l->x + q[0] * l->a - x, q[1] * l->b - y, l->height}, w = vec3_cross(u, v);
		sum += 0.5 * atan2(vec3_length(w), vec3_dot(u, v)) * w.z / vec3_length(w);
	}
	return sum;
}

/* 1 inside the beam and 0 outside: over time, the mean blurs the moving edge. */
static double irradiance_of_beam(const struct light_state *l, double x, double y)
{
	return fabs(x - l->x) < l->a && fabs(y) < l->b;
}

static double irradiance_of_projector(const struct light_state *l, double x, double y)
{
	(void)x, (void)y;
	return M_PI / (l->height * l->height);
}

static const struct moving_light_case {
	const char *name;
	light_fn *light;
	irradiance_fn *irradiance;
	const char *type, *children;
} moving_light_cases[] = {
	{"a ball slides", sliding_light, irradiance_of_ball, "sphere", SHINES("1")},
	{"a ball rises and grows", rising_light, irradiance_of_ball, "sphere", SHINES("1")},
	{"a card is stretched", stretching_light, irradiance_of_card, "rectangle", SHINES("1")},
	{"a beam is stretched", stretching_light, irradiance_of_beam, "rectangle",
	 "<emitter type='directionalarea'><float name='radiance' value='1'/></emitter>"},
	{"a projector rises", rising_light, irradiance_of_projector, "projector", "<float name='fov' value='60'/>"},
};

/* Returns the mean, over time and over the image, of the radiance of a plane of reflectance 1 that the camera sees
 * from a height of 1. */
static double mean_radiance(const struct moving_light_case *o)
{
	enum { STEPS = 48, TIMES = 512 };
	double sum = 0, half = tan(M_PI / 9);
	for (int k = 0; k < TIMES; k++) {
		struct light_state l = o->light((k + 0.5) / TIMES);
		for (int i = 0; i < STEPS * STEPS; i++)
			sum += o->irradiance(&l, half * (2 * (i % STEPS + 0.5) / STEPS - 1),
					     half * (2 * (i / STEPS + 0.5) / STEPS - 1));
	}
	return sum / (M_PI * STEPS * STEPS * TIMES);
}

static void put_light(char *out, size_t size, const struct moving_light_case *o, double t)
{
	const struct light_state l = o->light(t);
	snprintf(out, size,
		 "<scale x='%.17g' y='%.17g' z='%.17g'/><rotate x='1' angle='180'/><translate x='%.17g' z='%.17g'/>",
		 l.a, l.b, l.a, l.x, l.height);
}

static struct world *make_world_over_plane(const struct moving_light_case *o)
{
	char begin[256], end[256];
	const char *element = o->irradiance == irradiance_of_projector ? "emitter" : "shape";
	put_light(begin, sizeof begin, o, 0);
	put_light(end, sizeof end, o, 1);
	return world_from_text(16, 16,
			       "<integrator type='path'><integer name='max_depth' value='2'/></integrator>"
			       "<sensor type='perspective'><float name='fov' value='40'/>" SHUTTER TO(
				       "<lookat origin='0,0,1' target='0,0,0' up='0,1,0'/>") BOX_FILM
			       "</sensor>"
			       "<shape type='rectangle'>" TO(
				       "<scale value='4'/>") "<bsdf type='diffuse'>"
							     "<float name='reflectance' value='1'/></bsdf></shape>"
							     "<%s type='%s'>" KEYS("%s", "%s") "%s</%s>",
			       element, o->type, begin, end, o->children, element);
}

static void moving_lights_light_the_plane_as_integrated(void **state)
{
	(void)state;
	static const struct agreement_options sides[] = {{"path", 1024, 32, 0, 0}, {"bdpt", 1536, 32, 0, 0}};
	static struct agreement_image image;
	for (size_t k = 0; k < sizeof moving_light_cases / sizeof *moving_light_cases; k++) {
		struct world *w = make_world_over_plane(&moving_light_cases[k]);
		double xyz = w->grey_xyz[0] + w->grey_xyz[1] + w->grey_xyz[2];
		for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
			char test[64];
			snprintf(test, sizeof test, "%s, %s", moving_light_cases[k].name, sides[i].integrator);
			agreement_render(w, test, "moving", &sides[i], &image);
			agreement_check_constant(test, &image, xyz * mean_radiance(&moving_light_cases[k]));
		}
		world_free(w);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(moving_lights_light_the_plane_as_integrated),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
