/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The texture `wireframe`, against distances to the edges in the file, in scene units; the part of a triangle covered
 * by lines, against its closed form; default widths; shapes that are not meshes; and the range of values that
 * materials see. Invalid uses are refused by name.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define VIEW SENSOR("0.3,0.2,4", "0,0,0")
#define SKY "<emitter type='constant'/>"
#define WIRE(name, inner) "<texture type='wireframe' name='" name "'>" inner "</texture>"
#define DIFFUSE(inner) "<bsdf type='diffuse'>" WIRE("reflectance", inner) "</bsdf>"
#define PLY(inner) "<shape type='ply'><string name='filename' value='m.ply'/>" inner "</shape>"
#define NUMBER(name, value) "<float name='" name "' value='" value "'/>"

enum { CORNERS = 5, FACES = 3 };
static const double corners[CORNERS][3] = {{0, 0, 0}, {2, 0, 0}, {0.5, 1.5, 0.25}, {-1, 0.5, 0}, {3, 2, -0.5}};
static const int faces[FACES][3] = {{0, 1, 2}, {0, 2, 3}, {1, 4, 2}};

static const struct wavelengths grey = {.is_grey = true};

static void write_mesh(char *text, size_t size)
{
	int used = snprintf(text, size,
			    "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
			    "property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n",
			    CORNERS, FACES);
	for (int i = 0; i < CORNERS; i++)
		used += snprintf(text + used, size - (size_t)used, "%g %g %g\n", corners[i][0], corners[i][1],
				 corners[i][2]);
	for (int i = 0; i < FACES; i++)
		used += snprintf(text + used, size - (size_t)used, "3 %d %d %d\n", faces[i][0], faces[i][1],
				 faces[i][2]);
}

enum { FINE_SIDES = 20 };

/* Writes an uneven fan of triangles around a point above its rim. */
static void write_fan(char *text, size_t size)
{
	int used = snprintf(
		text, size,
		"ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
		"property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n0 0 0.5\n",
		FINE_SIDES + 1, FINE_SIDES);
	for (int i = 0; i < FINE_SIDES; i++)
		used += snprintf(text + used, size - (size_t)used, "%.7g %.7g 0\n", cos(0.01 * i * i),
				 sin(0.01 * i * i));
	for (int i = 0; i < FINE_SIDES; i++)
		used += snprintf(text + used, size - (size_t)used, "3 0 %d %d\n", i + 1, (i + 1) % FINE_SIDES + 1);
}

static struct world *make_world(const char *body)
{
	static char xml[1 << 14], mesh[1 << 10], fan[1 << 12];
	write_mesh(mesh, sizeof mesh);
	write_fan(fan, sizeof fan);
	int n = snprintf(xml, sizeof xml, "<scene version='3.0.0'>" VIEW SKY "%s</scene>", body);
	const struct memory_file files[] = {{"s.xml", xml, (size_t)n}, {"m.ply", mesh, strlen(mesh)}, {NULL, NULL, 0}};
	return world_from_files(16, 16, files);
}

static double measured_reflectance(const struct world *w, const struct surface_point *x)
{
	const struct bsdf *b = &w->bsdfs[w->shape_bindings[x->prim.shape].bsdf];
	struct bsdf_point p = world_bsdf_point(x, &grey, TRANSPORT_RADIANCE);
	return M_PI * b->ops->eval(b, &p, (vec3){0, 0, 1}, (vec3){0, 0, 1}).v[0];
}

static vec3 corner_position(int i)
{
	return (vec3){corners[i][0], corners[i][1], corners[i][2]};
}

static double distance_to_segment(vec3 p, vec3 a, vec3 b)
{
	vec3 ab = vec3_sub(b, a), ap = vec3_sub(p, a);
	double t = fmin(fmax(vec3_dot(ap, ab) / vec3_dot(ab, ab), 0), 1);
	return vec3_length(vec3_madd(ap, -t, ab));
}

/* Returns the distance from p to the edges of face f, in units of the file. */
static double distance_to_edges(int f, vec3 p)
{
	double least = INFINITY;
	for (int k = 0; k < 3; k++)
		least = fmin(least, distance_to_segment(p, corner_position(faces[f][k]),
							corner_position(faces[f][(k + 1) % 3])));
	return least;
}

static double expected_value(double d, double width, double step, double edge, double interior)
{
	double x = (d / width - (1 - step)) / step;
	x = fmin(fmax(x, 0), 1);
	return edge + (interior - edge) * (3 * x * x - 2 * x * x * x);
}

/* Number of points with one of the two colours only, or with a mixture. */
struct colour_counts {
	int edge, mixed, interior;
};

/* scale: scene units per unit of the file. The width is in scene units. The tolerance is 1e-4 of the file's unit,
 * because a point in double and vertices in float differ. */
static struct colour_counts compare_values(const struct world *w, uint32_t shape, mat4 from_file, double scale,
					   double width, double step, double edge, double interior)
{
	struct colour_counts c = {0, 0, 0};
	assert_int_equal(w->shapes[shape].triangle_count, FACES);
	for (uint32_t f = 0; f < FACES; f++)
		for (int i = 0; i < 400; i++) {
			double b1 = (i % 20 + 0.5) / 20, b2 = (1 - b1) * (i / 20 + 0.3) / 20;
			struct surface_point x;
			surface_on_triangle(&w->shapes[shape], (struct prim_ref){shape, f, 0}, b1, b2, &x);
			vec3 p = vec3_madd(w->center, 1 / w->scale, x.p), in_file = {0, 0, 0};
			/* The transforms are orthogonal up to their scale. */
			p = vec3_sub(p, (vec3){from_file.m[0][3], from_file.m[1][3], from_file.m[2][3]});
			double *to[3] = {&in_file.x, &in_file.y, &in_file.z};
			for (int k = 0; k < 3; k++)
				*to[k] = (from_file.m[0][k] * p.x + from_file.m[1][k] * p.y + from_file.m[2][k] * p.z) /
					 (scale * scale);
			double d = scale * distance_to_edges((int)f, in_file), a = measured_reflectance(w, &x);
			double e = expected_value(d, width, step, edge, interior);
			if (fabs(a - e) > 1e-4 * scale / (width * step))
				fail_msg("shape %u, face %u, %d: %.9g, not %.9g at distance %g", shape, f, i, a, e, d);
			c.edge += a == edge;
			c.interior += a == interior;
			c.mixed += a != edge && a != interior;
		}
	return c;
}

static const mat4 identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};

static void test_lines_have_their_width(void **state)
{
	(void)state;
#define LINES                         \
	NUMBER("line_width", "0.125") \
	NUMBER("step_width", "0.75") NUMBER("edge_color", "0.75") NUMBER("interior_color", "0.25")
	struct world *w = make_world(PLY(DIFFUSE(LINES)) PLY(
		DIFFUSE(LINES) "<transform name='to_world'><scale value='3'/><rotate z='1' angle='90'/>"
			       "<translate x='5' z='1'/></transform>"));
	struct colour_counts c = compare_values(w, 0, identity, 1, 0.125, 0.75, 0.75, 0.25);
	assert_true(c.edge > 30 && c.mixed > 100 && c.interior > 100);
	const mat4 moved = {{{0, -3, 0, 5}, {3, 0, 0, 0}, {0, 0, 3, 1}, {0, 0, 0, 1}}};
	compare_values(w, 1, moved, 3, 0.125, 0.75, 0.75, 0.25);
	assert_true(w->bsdfs[0].is_textured && w->bsdfs[0].color_kind == COLOR_KIND_CONSTANT);
	world_free(w);
}

/* Without a width: one tenth of the mean over all edges of all triangles; and the other defaults. Two meshes that
 * share a material have different widths. */
static void test_default_width_is_relative_to_the_mesh(void **state)
{
	(void)state;
	double sum = 0;
	for (int f = 0; f < FACES; f++)
		for (int k = 0; k < 3; k++)
			sum += vec3_length(
				vec3_sub(corner_position(faces[f][k]), corner_position(faces[f][(k + 1) % 3])));
	double width = 0.1 * sum / (3 * FACES);
	struct world *w = make_world("<bsdf type='diffuse' id='m'>" WIRE("reflectance", "") "</bsdf>" PLY(
		"<ref id='m'/>") PLY("<ref id='m'/><transform name='to_world'><scale value='2'/></transform>"));
	compare_values(w, 0, identity, 1, width, 0.5, 0.1, 0.5);
	const mat4 twice = {{{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2, 0}, {0, 0, 0, 1}}};
	compare_values(w, 1, twice, 2, 2 * width, 0.5, 0.1, 0.5);
	world_free(w);
}

/* The lines of an instance are those of its mesh and scale with it. */
static void test_lines_scale_with_instances(void **state)
{
	(void)state;
	struct world *w = make_world("<shape type='shapegroup' id='g'>" PLY(DIFFUSE(
		LINES)) "</shape><shape type='instance'><ref id='g'/></shape><shape type='instance'><ref id='g'/>"
			"<transform name='to_world'><scale x='-2' y='2' z='2'/><translate z='4'/></transform></shape>");
	compare_values(w, 0, identity, 1, 0.125, 0.75, 0.75, 0.25);
	const mat4 mirrored = {{{-2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2, 4}, {0, 0, 0, 1}}};
	compare_values(w, 1, mirrored, 2, w->sharing_shape_count ? 0.25 : 0.125, 0.75, 0.75, 0.25);
	world_free(w);
}

/* The part of a triangle without lines is similar to it, smaller by the factor 1 - width / (radius of the inscribed
 * circle). */
static void test_covered_share_follows_the_inscribed_circle(void **state)
{
	(void)state;
	struct world *w = make_world("<shape type='cube'>" DIFFUSE(NUMBER("line_width", "0.2") NUMBER(
		"step_width", "0") NUMBER("edge_color", "1") NUMBER("interior_color", "0")) "</shape>");
	enum { SIDE = 400 };
	double radius = 2 * 2 / (2 + 2 + sqrt(8)), covered = 0;
	for (int i = 0; i < SIDE; i++)
		for (int j = 0; i + j < SIDE; j++) {
			/* The points are centres of equal cells; cells at the long side are cut in half. */
			struct surface_point x;
			surface_on_triangle(&w->shapes[0], (struct prim_ref){0, 5, 0}, (i + 0.5) / SIDE,
					    (j + 0.5) / SIDE, &x);
			covered += measured_reflectance(w, &x) * (i + j + 1 < SIDE ? 2 : 1) / (SIDE * SIDE);
		}
	double part = 1 - (1 - 0.2 / radius) * (1 - 0.2 / radius);
	if (fabs(covered - part) > 2e-3)
		fail_msg("lines cover %g, not %g", covered, part);
	world_free(w);
}

/* Shapes that are not meshes in Mitsuba have no lines, whichever shape refers to the material first. */
static void test_only_meshes_have_lines(void **state)
{
	(void)state;
	struct world *w = make_world("<bsdf type='diffuse' id='m'>" WIRE(
		"reflectance",
		LINES) "</bsdf>"
		       "<shape type='sphere'><ref id='m'/></shape><shape type='rectangle'><ref id='m'/></shape>" PLY(
			       "<ref id='m'/>"));
	struct surface_point x;
	surface_on_sphere(&w->shapes[0], (struct prim_ref){0, 0, 0}, (vec3){0, 0, 1}, &x);
	assert_true(measured_reflectance(w, &x) == 0.25);
	surface_on_triangle(&w->shapes[1], (struct prim_ref){1, 0, 0}, 0.5, 0.5, &x);
	assert_true(measured_reflectance(w, &x) == 0.25);
	compare_values(w, 2, identity, 1, 0.125, 0.75, 0.75, 0.25);
	world_free(w);
}

/* The lines of every triangle but the largest meet in its middle and leave only a little of the interior's colour. */
static void test_wide_lines_cover_all_but_the_largest_triangle(void **state)
{
	(void)state;
	struct world *w = make_world(PLY("<bsdf type='roughconductor'>" WIRE(
		"alpha", NUMBER("line_width", "0.75") NUMBER("step_width", "0.25") NUMBER("edge_color", "0.5")
				 NUMBER("interior_color", "0.1")) "</bsdf>"));
	double widest = 0;
	for (int f = 0; f < FACES; f++) {
		vec3 a = vec3_sub(corner_position(faces[f][1]), corner_position(faces[f][0])),
		     b = vec3_sub(corner_position(faces[f][2]), corner_position(faces[f][0]));
		double around = vec3_length(a) + vec3_length(b) + vec3_length(vec3_sub(a, b));
		widest = fmax(widest, vec3_length(vec3_cross(a, b)) / around);
	}
	double least = expected_value(widest, 0.75, 0.25, 0.5, 0.1);
	assert_true(least > 0.11 && least < 0.49);
	if (fabs(w->bsdfs[0].min_alpha - least) > 1e-4)
		fail_msg("alpha %g, not %g", w->bsdfs[0].min_alpha, least);
	world_free(w);
}

static void test_lights_may_have_lines(void **state)
{
	(void)state;
	struct world *w = make_world(PLY("<emitter type='area'>" WIRE(
		"radiance", NUMBER("edge_color", "20") NUMBER("interior_color", "5")) "</emitter>"));
	const struct emitter *em = &w->emitters[w->shape_bindings[0].emitter];
	struct emitter_point x = {.n = {0, 0, 1}, .texture_point = {.b1 = 0.001, .b2 = 0.4}};
	assert_true(em->is_textured && em->color_kind == COLOR_KIND_D65);
	assert_true(fabs(em->ops->radiance(em, &x, x.n, &grey).v[0] - 20) < 1e-9);
	x.texture_point.b1 = 0.3;
	assert_true(fabs(em->ops->radiance(em, &x, x.n, &grey).v[0] - 5) < 1e-9);
	world_free(w);
}

static void test_invalid_wireframes_are_refused(void **state)
{
	(void)state;
#define CUBE(inner) "<shape type='cube'>" inner "</shape>"
	world_check_refused(CUBE("<bsdf type='bumpmap'>" WIRE("map", "") "<bsdf type='diffuse'/></bsdf>"),
			    "the edges of a mesh cannot be a bump or normal map");
	world_check_refused(CUBE(WIRE("displacement", "") "<integer name='displacement_level' value='1'/>"),
			    "the edges of a mesh cannot displace a surface");
	world_check_refused("<emitter type='projector'>" WIRE("irradiance", "") "</emitter>",
			    "only the material or the light of a shape can show edges");
	world_check_refused(CUBE(DIFFUSE(NUMBER("step_width", "1.5"))), "step_width");
	world_check_refused(CUBE(DIFFUSE(NUMBER("line_width", "-1"))), "line_width");
	world_check_refused(CUBE(DIFFUSE("<rgb name='edge_color' value='2,0,0'/>")), "edge_color");
	world_check_refused(CUBE(DIFFUSE("<texture name='edge_color' type='checkerboard'/>")), "edge_color");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_lines_have_their_width),
		cmocka_unit_test(test_default_width_is_relative_to_the_mesh),
		cmocka_unit_test(test_lines_scale_with_instances),
		cmocka_unit_test(test_covered_share_follows_the_inscribed_circle),
		cmocka_unit_test(test_only_meshes_have_lines),
		cmocka_unit_test(test_wide_lines_cover_all_but_the_largest_triangle),
		cmocka_unit_test(test_lights_may_have_lines),
		cmocka_unit_test(test_invalid_wireframes_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
