/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Refracted connections against rays: each path that the walk finds is traced again from z by Snell's law alone and
 * must arrive at the emitter, and T must follow from the arrival points of neighbouring rays. Deterministic.
 */
#include "tests/support/dice.h"
#include "tests/support/worlds.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/math/mat2.h"
#include "worker/render/path/connect.h"
#include "worker/render/path/visible.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static struct path_context c;
static uint64_t counters[BATCH_COUNTERS];

static void begin(const struct world *w)
{
	memset(counters, 0, sizeof counters);
	c = (struct path_context){.w = w, .counters = counters};
	c.wl = world_sample_wavelengths(w, 0.5);
}

static vec3 in_world(const struct world *w, vec3 p)
{
	return vec3_scale(w->scale, vec3_sub(p, w->center));
}

/* Refracts d by Snell's law; the index on the side of the incident ray is larger by the factor `eta`. Returns false
 * for total reflection. */
static bool refract_by_snell(vec3 d, vec3 n, double eta, vec3 *out)
{
	if (vec3_dot(d, n) > 0)
		n = vec3_neg(n);
	double cosine = -vec3_dot(d, n), k = 1 - eta * eta * (1 - cosine * cosine);
	if (!(k > 0))
		return false;
	*out = vec3_normalize(vec3_madd(vec3_scale(eta, d), eta * cosine - sqrt(k), n));
	return true;
}

/* Traces a ray from z along d through `count` surfaces: *p and *out are the ray behind the last one. */
static bool trace_through(const struct path_vertex *z, vec3 d, unsigned count, vec3 *p, vec3 *out)
{
	struct path_vertex v[2];
	const struct path_vertex *from = z;
	for (unsigned i = 0; i < count; i++) {
		struct path_vertex *to = &v[i % 2];
		if (!path_extend(&c, from, d, 0, INFINITY, to))
			return false;
		double eta = bsdf_eta(to->bsdf, &c.wl);
		if (!refract_by_snell(d, to->x.sh.n, vec3_dot(d, to->x.sh.n) < 0 ? 1 / eta : eta, &d))
			return false;
		from = to;
	}
	*p = from->x.p;
	*out = d;
	return true;
}

/* Stores two coordinates of the ray's intersection with the plane through y perpendicular to the frame's normal or,
 * if y is at infinity, of the ray's direction. */
static bool trace_arrival(const struct path_vertex *z, vec3 d, unsigned count, const struct path_vertex *y,
			  const struct frame *f, double at[2])
{
	vec3 p, w;
	if (!trace_through(z, d, count, &p, &w))
		return false;
	vec3 offset =
		y->kind == VERTEX_INFINITE
			? vec3_sub(w, y->x.p)
			: vec3_sub(vec3_madd(p, vec3_dot(vec3_sub(y->x.p, p), f->n) / vec3_dot(w, f->n), w), y->x.p);
	at[0] = vec3_dot(offset, f->s);
	at[1] = vec3_dot(offset, f->t);
	return true;
}

struct tally {
	unsigned found, through_several_surfaces;
	double max_miss, max_transfer_error;
};

/* The ratio of solid angle at z to area (or solid angle) at y, by central differences, and from it T relative to the
 * solid angle of x_m. */
static void check_refraction(const struct path_vertex *z, const struct path_vertex *y, const struct path_refraction *r,
			     struct tally *t)
{
	const double step = 1e-5;
	double distance2, unused, at[2], high[2], low[2];
	vec3 d = path_direction(z, &r->v[0], &distance2), last = path_direction(&r->v[r->count - 1], y, &unused);
	bool has_normal = vec3_dot(y->x.ng, y->x.ng) > 0 && y->kind != VERTEX_INFINITE;
	struct frame ray_frame = frame_around(d), arrival_frame = frame_around(has_normal ? y->x.ng : last);
	mat2 m;
	assert_true(trace_arrival(z, d, r->count, y, &arrival_frame, at));
	t->max_miss = fmax(t->max_miss, fmax(fabs(at[0]), fabs(at[1])));
	if (!trace_arrival(z, vec3_normalize(vec3_madd(d, step, ray_frame.s)), r->count, y, &arrival_frame, high) ||
	    !trace_arrival(z, vec3_normalize(vec3_madd(d, -step, ray_frame.s)), r->count, y, &arrival_frame, low))
		return;
	m.xx = (high[0] - low[0]) / (2 * step);
	m.yx = (high[1] - low[1]) / (2 * step);
	if (!trace_arrival(z, vec3_normalize(vec3_madd(d, step, ray_frame.t)), r->count, y, &arrival_frame, high) ||
	    !trace_arrival(z, vec3_normalize(vec3_madd(d, -step, ray_frame.t)), r->count, y, &arrival_frame, low))
		return;
	m.xy = (high[0] - low[0]) / (2 * step);
	m.yy = (high[1] - low[1]) / (2 * step);
	double transfer = distance2 / (path_cosine(&r->v[0], d) * fabs(m.xx * m.yy - m.xy * m.yx));
	t->max_transfer_error = fmax(t->max_transfer_error, fabs(exp(r->log_transfer) / transfer - 1));
	t->found++;
	t->through_several_surfaces += r->count > 2;
}

/* Checks connections from points of the floor to points of each emitter. */
static struct tally check_connections(const char *name, struct world *w, unsigned tries)
{
	struct tally t = {0};
	struct dice dice = dice_for_test(name);
	begin(w);
	for (unsigned i = 0; i < tries; i++) {
		struct path_vertex from = {.kind = VERTEX_CAMERA,
					   .x = {.p = in_world(w, (vec3){0, -1, 0}), .prim = PRIM_NONE}};
		struct path_vertex z, y;
		struct path_refraction r;
		double pdf;
		vec3 d = dice_direction(&dice);
		d.y = -fabs(d.y) - 0.5;
		from.x.ng = (vec3){0, 0, 0};
		if (!path_extend(&c, &from, vec3_normalize(d), 0, INFINITY, &z) || z.kind != VERTEX_SURFACE ||
		    !path_scatters_smoothly(&z))
			continue;
		for (int k = 0; k < 3; k++)
			z.next_event[k] = dice_uniform(&dice);
		if (path_sample_next_event(&c, &z, &y, &pdf) && halfvec_refract(&c, &z, &y, &r))
			check_refraction(&z, &y, &r, &t);
	}
	print_message("%s: %u of %u found, largest miss %.3g, T off by %.3g\n", name, t.found, tries, t.max_miss,
		      t.max_transfer_error);
	assert_true(t.max_miss < 1e-7 && t.max_transfer_error < 1e-4);
	world_free(w);
	return t;
}

/* clang-format off */
#define FLOOR                                                                                                   \
	SENSOR("0,-1,4", "0,-1,0")                                                                                  \
	"<shape type='rectangle'><transform name='to_world'><scale value='6'/><rotate x='1' angle='-90'/>"           \
	"<translate y='-2'/></transform><bsdf type='diffuse'/></shape>"
#define BALL(place, radius, bsdf)                                                                               \
	"<shape type='sphere'><point name='center' " place "/><float name='radius' value='" radius "'/>" bsdf "</shape>"
#define GLASS "<bsdf type='dielectric'/>"
#define WEAK_GLASS "<bsdf type='dielectric'><float name='int_ior' value='1.1'/><float name='ext_ior' value='1'/></bsdf>"
#define LAMP "<emitter type='area'/>"
#define SURFACE                                                                                                 \
	"<shape type='rectangle'><transform name='to_world'><scale value='6'/><rotate x='1' angle='-90'/></transform>" \
	"<bsdf type='dielectric'><float name='int_ior' value='1.33'/><float name='ext_ior' value='1'/></bsdf></shape>"
#define WALL                                                                                                    \
	"<shape type='rectangle'><transform name='to_world'><scale x='6' y='1'/><rotate y='1' angle='-90'/>"          \
	"<translate x='1.5' y='-1'/></transform><bsdf type='twosided'><bsdf type='diffuse'/></bsdf></shape>"
#define SUN "<emitter type='directional'><vector name='direction' x='-.94' y='-.342' z='0'/></emitter>"
/* clang-format on */

static void refracted_connections_arrive_at_lamps(void **state)
{
	(void)state;
	struct tally t = check_connections("a lamp in a ball",
					   world_from_text(8, 8, "%s",
							   FLOOR BALL("x='0' y='1' z='0'", "1", GLASS)
								   BALL("x='.2' y='1.3' z='0'", ".1", LAMP)),
					   400);
	assert_true(t.found > 200);
	t = check_connections(
		"a point behind a ball and a pane",
		world_from_text(
			8, 8, "%s",
			FLOOR BALL(
				"x='0' y='1' z='0'", ".6",
				WEAK_GLASS) "<shape type='cube'><transform name='to_world'><scale x='5' y='.1' z='5'/>"
					    "<rotate z='1' angle='10'/>"
					    "</transform>" GLASS
					    "</shape><emitter type='point'><point name='position' x='.1' y='2' z='0'/>"
					    "</emitter>"),
		400);
	assert_true(t.found > 100 && t.through_several_surfaces > 10);
	t = check_connections(
		"the sun through a ball and a pane",
		world_from_text(
			8, 8, "%s",
			FLOOR BALL(
				"x='0' y='1' z='0'", ".6",
				WEAK_GLASS) "<shape type='cube'><transform name='to_world'><scale x='5' y='.1' z='5'/></transform>" GLASS
					    "</shape><emitter type='directional'><vector name='direction' value='.3,-1,.2'/></emitter>"),
		400);
	assert_true(t.found > 200);
}

/* Under water beside a wall, straight lines to a low sun meet the wall, and refracted ones to the left of x = -.5 do
 * not: about a quarter of the points. */
static void refracted_sun_passes_a_wall(void **state)
{
	(void)state;
	static const char *const between[] = {SURFACE WALL, SURFACE WALL BALL("x='0' y='-1.9' z='0'", ".05", GLASS)};
	for (size_t i = 0; i < sizeof between / sizeof *between; i++) {
		struct tally t = check_connections("a pool under a low sun",
						   world_from_text(8, 8, "%s%s%s", FLOOR, between[i], SUN), 400);
		assert_true(t.found > 80);
	}
	/* Points in the air beside a glass ball, in the shadow of a wall, have no refracted connection. */
	struct tally t = check_connections(
		"a ball in the air",
		world_from_text(8, 8, "%s", FLOOR WALL BALL("x='0' y='-1.5' z='0'", ".4", GLASS) SUN), 400);
	assert_int_equal(t.found, 0);
}

/* Light through a glass ball with a focus above the floor: several refracted paths connect points beyond the focus
 * with the lamp, and technique 1 makes the one at which the walk ends. */
static void one_of_several_refracted_paths_is_made_by_technique_1(void **state)
{
	(void)state;
	unsigned made = 0, others = 0;
	double film[2];
	struct world *w = world_from_text(
		8, 8, "%s",
		FLOOR BALL("x='0' y='-.8' z='0'", ".5",
			   GLASS) "<emitter type='point'><point name='position' x='.1' y='1' z='0'/></emitter>");
	begin(w);
	c.window = (struct film_window){0, 0, 8, 8};
	c.max_depth = 8;
	c.refract = halfvec_refract;
	for (uint64_t i = 0; i < 20000; i++) {
		struct sampler_random u;
		const struct path_vertex *v[5];
		struct path_refraction r;
		double log_transfer = 0;
		sampler_random_init(&u, 0x666f637573, RNG_TEST, i, 0);
		path_walk_camera(&c, &u.base, 1, film); /* sets the wavelengths and the time */
		unsigned n = path_walk_light(&c, &u.base, 4);
		if (n < 4 || !path_vertex_is_refracting(&c.light[1]) || !path_vertex_is_refracting(&c.light[2]) ||
		    !path_scatters_smoothly(&c.light[3]))
			continue;
		struct path_vertex above = c.light[3];
		above.x.p = vec3_add(above.x.p, above.x.ng);
		for (unsigned k = 0; k < 4; k++)
			v[k] = &c.light[k];
		v[4] = &above;
		assert_int_equal(path_refracted_end(v, 4), 3);
		bool is_made = path_is_made_by_refraction(&c, v, 3, &log_transfer);
		bool found = halfvec_refract(&c, v[3], v[0], &r);
		double distance = found ? vec3_length(vec3_sub(r.v[0].x.p, v[2]->x.p)) : INFINITY;
		assert_true(is_made ? distance < 1e-4 : distance > 1e-9);
		if (is_made)
			assert_true(log_transfer == r.log_transfer);
		made += is_made;
		others += !is_made;
	}
	print_message("%u made by refraction, %u others\n", made, others);
	assert_true(made > 10 && others > 100);
	world_free(w);
}

/* Returns the number of surfaces through which the floor's point below the origin is connected to a point light at a
 * height of 3; 0: not connected by refraction. */
static unsigned count_joining_surfaces(const char *between)
{
	struct world *w = world_from_text(8, 8, "%s%s%s", FLOOR, between,
					  "<emitter type='point'><point name='position' x='0' y='3' z='0'/></emitter>");
	struct path_vertex from = {.kind = VERTEX_CAMERA,
				   .x = {.p = in_world(w, (vec3){.1, -1.9, 0}), .prim = PRIM_NONE}},
			   z, y;
	struct path_refraction r;
	double pdf;
	begin(w);
	assert_true(path_extend(&c, &from, (vec3){0, -1, 0}, 0, INFINITY, &z));
	memset(z.next_event, 0, sizeof z.next_event);
	assert_true(path_sample_next_event(&c, &z, &y, &pdf));
	unsigned count = halfvec_refract(&c, &z, &y, &r) ? r.count : 0;
	world_free(w);
	return count;
}

enum sight { BLOCKED, OPEN, THROUGH_SHEET, SIGHTS };

static enum sight classify_sight(const struct path_vertex *z, const struct path_vertex *y)
{
	struct path_vertex first;
	double distance2;
	vec3 d = path_direction(z, y, &distance2);
	if (path_is_visible(&c, z, y))
		return OPEN;
	assert_true(path_extend(&c, z, d, 0, sqrt(distance2), &first));
	return bsdf_passes_connections(first.bsdf) ? THROUGH_SHEET : BLOCKED;
}

/* A connection between points that see each other is straight, possibly through the holes of a sheet, and must not be
 * made a second time by refraction. Points of the floor under a bubble in glass, with a point light above: beside the
 * bubble's shadow, light arrives both straight and refracted by the bubble's rim. */
static void points_that_see_each_other_are_not_joined_by_refraction(void **state)
{
	(void)state;
	unsigned count[SIGHTS] = {0}, found[SIGHTS] = {0};
	/* clang-format off */
	struct world *w = world_from_text(8, 8, "%s",
		FLOOR BALL("x='0' y='0' z='0'", ".7", "<bsdf type='dielectric'><float name='int_ior' value='1'/>"
			"<float name='ext_ior' value='1.5'/></bsdf>")
		"<shape type='rectangle'><transform name='to_world'><scale value='3.5'/><rotate x='1' angle='90'/>"
			"<translate x='5.5' y='-1'/></transform><bsdf type='mask'><float name='opacity' value='.5'/>"
			"<bsdf type='diffuse'/></bsdf></shape>"
		"<emitter type='point'><point name='position' x='.3' y='1.5' z='.2'/></emitter>");
	/* clang-format on */
	begin(w);
	for (int i = 0; i < 1600; i++) {
		double across = -3.9 + i % 40 * 0.2, along = -3.9 + i / 40 * 0.2;
		struct path_vertex from = {.kind = VERTEX_CAMERA,
					   .x = {.p = in_world(w, (vec3){across, -1.9, along}), .prim = PRIM_NONE}},
				   z, y;
		struct path_refraction r;
		double pdf;
		assert_true(path_extend(&c, &from, (vec3){0, -1, 0}, 0, INFINITY, &z));
		memset(z.next_event, 0, sizeof z.next_event);
		assert_true(path_sample_next_event(&c, &z, &y, &pdf));
		enum sight sight = classify_sight(&z, &y);
		count[sight]++;
		found[sight] += halfvec_refract(&c, &z, &y, &r);
	}
	print_message("refracted light is found at %u of %u points in shadow\n", found[BLOCKED], count[BLOCKED]);
	assert_true(found[BLOCKED] > 50 && count[OPEN] > 50 && count[THROUGH_SHEET] > 50);
	assert_int_equal(found[OPEN], 0);
	assert_int_equal(found[THROUGH_SHEET], 0);
	world_free(w);
}

static void surfaces_between_decide_whether_refraction_joins(void **state)
{
	(void)state;
	char panes[4096] = "";
#define PANE(bsdf)                                                                                                         \
	"<shape type='rectangle'><transform name='to_world'><scale value='2'/><rotate x='1' angle='90'/></transform>" bsdf \
	"</shape>"
	assert_int_equal(count_joining_surfaces(PANE(GLASS)), 1);
	assert_int_equal(count_joining_surfaces(""), 0);
	assert_int_equal(count_joining_surfaces(PANE("<bsdf type='thindielectric'/>")), 0);
	assert_int_equal(count_joining_surfaces(PANE("<bsdf type='roughdielectric'/>")), 0);
	assert_int_equal(count_joining_surfaces(PANE("<bsdf type='conductor'/>")), 0);
	assert_int_equal(count_joining_surfaces(PANE(GLASS) BALL("x='0' y='1' z='0'", ".5", "<bsdf type='diffuse'/>")),
			 0);
	for (unsigned i = 0; i <= PATH_REFRACTED_VERTICES_MAX; i++) {
		size_t used = strlen(panes);
		snprintf(
			panes + used, sizeof panes - used,
			"<shape type='rectangle'><transform name='to_world'><scale value='2'/><rotate x='1' angle='90'/>"
			"<translate y='%g'/></transform>" GLASS "</shape>",
			0.1 * i);
		assert_int_equal(count_joining_surfaces(panes), i < PATH_REFRACTED_VERTICES_MAX ? i + 1 : 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(refracted_connections_arrive_at_lamps),
		cmocka_unit_test(refracted_sun_passes_a_wall),
		cmocka_unit_test(one_of_several_refracted_paths_is_made_by_technique_1),
		cmocka_unit_test(points_that_see_each_other_are_not_joined_by_refraction),
		cmocka_unit_test(surfaces_between_decide_whether_refraction_joins),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
