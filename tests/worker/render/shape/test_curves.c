/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Curves: points of the tubes are at the distance of the radius from the curve, found by searching along it; areas and
 * volumes are those of cylinders, cones and spheres; and any file gives a mesh or an error.
 */
#include "tests/support/built_shape.h"
#include "tests/support/dice.h"
#include "tests/support/scene_tables.h"
#include "worker/render/shape/tube.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double pi = 3.14159265358979323846;
#define SCALE (pi / TUBE_SIDES / sin(pi / TUBE_SIDES)) /* factor of radii, tube.h */

static struct built_shape build_curves(const char *type, const char *content, const void *bytes, size_t size)
{
	char xml[1024];
	snprintf(xml, sizeof xml,
		 "<scene version='3.0.0'>\n<shape type='%s'><string name='filename' value='m'/>%s</shape></scene>",
		 type, content);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"m", bytes, size}, {0}};
	struct built_shape b = built_shape_make(files, scene_tables());
	if (!b.result) {
		assert_int_equal(b.geometry.kind, SHAPE_CURVE);
		b.result =
			shape_curves_to_mesh(&b.geometry, b.scene.objects[0], &b.arena, &b.dropped_triangles, &b.error);
	}
	return b;
}

static struct built_shape built_ok(const char *type, const char *content, const char *text)
{
	struct built_shape b = build_curves(type, content, text, strlen(text));
	if (b.result)
		fail_msg("%s: %s", type, b.error.text);
	return b;
}

/* ---- the distance to a curve, by searching ---- */

/* A point of the curve and its radius, at x from 0 to 1. */
typedef void curve_function(const double (*p)[4], int count, double x, vec3 *c, double *r);

static void chain_position(const double (*p)[4], int count, double x, vec3 *c, double *r)
{
	int i = (int)fmin(count - 2, floor(x * (count - 1)));
	double t = x * (count - 1) - i;
	*c = vec3_madd(vec3_scale(1 - t, vec3_load(p[i])), t, vec3_load(p[i + 1]));
	*r = (1 - t) * p[i][3] + t * p[i + 1][3];
}

/* By de Boor's recursion over the uniform knots. */
static void spline_position(const double (*p)[4], int count, double x, vec3 *c, double *r)
{
	int i = (int)fmin(count - 4, floor(x * (count - 3)));
	double t = x * (count - 3) - i, d[4][4];
	memcpy(d, p + i, sizeof d);
	for (int level = 1; level <= 3; level++)
		for (int j = 3; j >= level; j--) {
			double a = (t + 3 - j) / (4 - level);
			for (int k = 0; k < 4; k++)
				d[j][k] = (1 - a) * d[j - 1][k] + a * d[j][k];
		}
	*c = vec3_load(d[3]);
	*r = d[3][3];
}

/* Returns the distance of q from the spheres along the curve, over the radius of the nearest one. */
static double distance_from_curve(curve_function *evaluate, const double (*p)[4], int count, vec3 q)
{
	enum { STEPS = 20000 };
	double least = INFINITY, radius = 1;
	for (int i = 0; i <= STEPS; i++) {
		vec3 c;
		double r;
		evaluate(p, count, (double)i / STEPS, &c, &r);
		double d = vec3_length(vec3_sub(q, c)) - r;
		if (d < least) {
			least = d;
			radius = r;
		}
	}
	return least / radius;
}

static const double points[][4] = {{0, 0, 0, 0.3},	 {1, 0.2, 0.1, 0.3},  {1.5, 1.2, -0.3, 0.2},
				   {1.4, 2.5, 0.5, 0.2}, {-0.5, 3, 0.2, 0.1}, {-1, 1.5, 1, 0.25}};
enum { POINTS = sizeof points / sizeof *points };

static void print_points(char *text, size_t size, int columns)
{
	for (int i = 0; i < POINTS; i++)
		for (int k = 0; k < columns; k++) {
			int used = snprintf(text, size, k + 1 < columns ? "%.17g " : "%.17g\n", points[i][k]);
			text += used;
			size -= (size_t)used;
		}
}

static void check_distance_from_curve(const char *type, curve_function *evaluate, double inwards,
				      uint32_t min_triangles)
{
	char text[1024];
	uint32_t outside = 0;
	print_points(text, sizeof text, 4);
	struct built_shape b = built_ok(type, "", text);
	const struct mesh *m = &b.geometry.mesh;
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		vec3 q = vec3_load(m->position[i]), n = vec3_load(m->normal[i]);
		double d = distance_from_curve(evaluate, points, POINTS, q);
		if (d > SCALE - 1 + 2e-3)
			fail_msg("%s: vertex %u is %g radii outside", type, i, d);
		if (d < -inwards)
			continue; /* on the inside of a joint or of a bend */
		outside++;
		/* The distance grows along the normal. */
		double further = distance_from_curve(evaluate, points, POINTS, vec3_madd(q, 0.02, n)),
		       nearer = distance_from_curve(evaluate, points, POINTS, vec3_madd(q, -0.02, n));
		if (!(further > d && d > nearer))
			fail_msg("%s: vertex %u: %g, %g, %g radii along its normal", type, i, nearer, d, further);
		assert_true(m->uv[i][0] >= 0 && m->uv[i][0] <= 1 && m->uv[i][1] >= 0 && m->uv[i][1] <= 1 + 1e-12);
	}
	assert_true(outside >= min_triangles);
	built_shape_fini(&b);
}

static void test_surfaces_lie_on_their_curves(void **state)
{
	(void)state;
	check_distance_from_curve("linearcurve", chain_position, 1e-3, 200);
	check_distance_from_curve("bsplinecurve", spline_position, 0.05, 150);
}

/* Normals are those of the surface between the rings, computed as the mean over the triangles around a vertex. The
 * radius changes fast here. */
static void test_normals_are_those_of_the_surface(void **state)
{
	(void)state;
	static const char text[] = "0 0 0 0.1\n1 0 0 0.2\n2 0 0 0.6\n3 1 0 0.7\n3 2 0 0.4\n3 3 1 0.1\n3 4 1 0.1\n";
	struct built_shape b = built_ok("bsplinecurve", "", text);
	const struct mesh *m = &b.geometry.mesh;
	uint32_t last = m->vertex_count - (TUBE_SIDES + 1), steep = 0;
	double(*sum)[3] = calloc(m->vertex_count, sizeof *sum);
	assert_non_null(sum);
	for (uint32_t t = 0; t < m->triangle_count; t++)
		for (int k = 0; k < 3; k++) {
			vec3 a = built_shape_corner(m, t, k),
			     u = vec3_unit_or_zero(vec3_sub(built_shape_corner(m, t, (k + 1) % 3), a)),
			     v = vec3_unit_or_zero(vec3_sub(built_shape_corner(m, t, (k + 2) % 3), a));
			double *evaluate = sum[m->index[t][k]];
			vec3_store(evaluate, vec3_madd(vec3_load(evaluate), vec3_angle(u, v),
						       vec3_unit_or_zero(vec3_cross(u, v))));
		}
	for (uint32_t i = TUBE_SIDES + 1; i < last; i++) {
		uint32_t ring = i / (TUBE_SIDES + 1) * (TUBE_SIDES + 1);
		vec3 n = vec3_load(sum[i]);
		if (i == ring || i == ring + TUBE_SIDES) /* the seam */
			n = vec3_add(vec3_load(sum[ring]), vec3_load(sum[ring + TUBE_SIDES]));
		double angle = vec3_angle(n, vec3_load(m->normal[i])) * 180 / pi;
		if (angle > 2.5)
			fail_msg("vertex %u: its normal is off by %g degrees", i, angle);
		vec3 middle = {0, 0, 0};
		for (uint32_t k = 0; k < TUBE_SIDES; k++)
			middle = vec3_madd(middle, 1.0 / TUBE_SIDES, vec3_load(m->position[ring + k]));
		double lean = vec3_dot(vec3_unit_or_zero(vec3_sub(vec3_load(m->position[i]), middle)),
				       vec3_load(m->normal[i]));
		steep += lean < 0.98;
	}
	assert_true(steep > 50); /* so that normals perpendicular to the axis would be wrong */
	free(sum);
	built_shape_fini(&b);
}

static bool is_near(double a, double b, double share)
{
	return fabs(a - b) <= share * fabs(b);
}

static void test_areas_and_volumes_are_exact(void **state)
{
	(void)state;
	/* A straight tube with open ends has exactly the right area. */
	struct built_shape b = built_ok("bsplinecurve", "", "0 0 0 0.5\n1 0 0 0.5\n2 0 0 0.5\n3 0 0 0.5\n4 0 0 0.5\n");
	assert_true(is_near(built_shape_area(&b.geometry.mesh), 2 * pi * 0.5 * 2, 1e-12));
	for (uint32_t i = 0; i < b.geometry.mesh.vertex_count; i++)
		assert_true(is_near(b.geometry.mesh.uv[i][1], (b.geometry.mesh.position[i][0] - 1) / 2, 1e-12) ||
			    b.geometry.mesh.position[i][0] == 1);
	built_shape_fini(&b);
	/* With round ends, it is closed and faces outwards. */
	b = built_ok("linearcurve", "", "0 0 0 0.5\n0 0 3 0.5\n");
	assert_true(is_near(built_shape_volume(&b.geometry.mesh), pi * 0.25 * 3 + 4 * pi / 3 * 0.125, 0.05));
	assert_true(is_near(built_shape_area(&b.geometry.mesh), 2 * pi * 0.5 * 3 + 4 * pi * 0.25, 0.03));
	built_shape_fini(&b);
	/* If one sphere is inside another, or a point is given twice, only the larger sphere remains, whichever comes
	 * first. */
	static const char *const spheres[] = {"0 0 0 1\n0.5 0 0 0.25\n", "0.5 0 0 0.25\n0 0 0 1\n",
					      "0 0 0 1\n0 0 0 1\n", "0 0 0 0.5\n0 0 0 1\n", "0 0 0 1\n0 0 0 0.5\n"};
	for (size_t i = 0; i < sizeof spheres / sizeof *spheres; i++) {
		b = built_ok("linearcurve", "", spheres[i]);
		for (uint32_t k = 0; k < b.geometry.mesh.vertex_count; k++)
			assert_true(vec3_length(vec3_load(b.geometry.mesh.position[k])) <= SCALE * (1 + 1e-12));
		double volume = built_shape_volume(&b.geometry.mesh);
		if (!(volume > 0.9 * 4 * pi / 3 && volume < 1.1 * 4 * pi / 3))
			fail_msg("spheres %zu: a volume of %g", i, volume);
		built_shape_fini(&b);
	}
}

/* Cones between the points of a chain, compared with the spline at the same v, deviate by at most a twentieth of the
 * largest radius nearby, in position and radius together. */
static void test_chain_approximates_its_spline(void **state)
{
	(void)state;
	char text[1024];
	print_points(text, sizeof text, 4);
	static const char scene[] =
		"<scene version='3.0.0'><shape type='bsplinecurve'><string name='filename' value='m'/></shape></scene>";
	const struct memory_file files[] = {{"s.xml", scene, sizeof scene - 1}, {"m", text, strlen(text)}, {0}};
	struct built_shape b = built_shape_make(files, scene_tables());
	struct list chain = {.item_size = sizeof(struct chain_point)};
	assert_int_equal(b.result, 0);
	assert_true(b.geometry.kind == SHAPE_CURVE && curve_make_chain(&b.geometry.curve, 0, &chain) == 0);
	assert_int_equal(chain.count, b.geometry.curve.chain_point_count);
	const struct chain_point *p = chain.items;
	double worst = 0;
	for (size_t i = 0; i + 1 < chain.count; i++)
		for (int k = 0; k <= 8; k++) {
			double x = k / 8.0, r, widest = 0;
			vec3 c, q = vec3_madd(vec3_scale(1 - x, p[i].center), x, p[i + 1].center);
			double v = (1 - x) * p[i].v + x * p[i + 1].v;
			spline_position(points, POINTS, v, &c, &r);
			int first = (int)fmin(POINTS - 4, floor(v * (POINTS - 3)));
			for (int j = first; j < first + 4; j++)
				widest = fmax(widest, points[j][3]);
			double off =
				hypot(vec3_length(vec3_sub(c, q)), r - (1 - x) * p[i].radius - x * p[i + 1].radius);
			worst = fmax(worst, off / widest);
		}
	print_message("%zu points for 3 pieces, off by %.4f radii\n", chain.count, worst);
	assert_true(worst <= 0.05 && worst > 0.01 && chain.count < 40);
	list_fini(&chain);
	built_shape_fini(&b);
}

/* v grows over all pieces of all curves, by the same amount for each piece. */
static void test_v_grows_evenly_over_all_pieces(void **state)
{
	(void)state;
	static const char *const types[] = {"linearcurve", "bsplinecurve"};
	for (int k = 0; k < 2; k++) {
		struct built_shape b = built_ok(types[k], "",
						"0 0 0 1\n9 0 0 1\n18 0 0 1\n27 0 0 1\n36 0 0 1\n\n"
						"0 9 0 1\n9 9 0 1\n18 9 0 1\n27 9 0 1\n");
		const struct mesh *m = &b.geometry.mesh;
		/* Pieces: 4 and 3 from 0 to 36 and to 27; 2 and 1 from 9 to 27 and to 18. */
		double pieces = k ? 3 : 7, from = k ? 9 : 0;
		for (uint32_t i = 0; i < m->vertex_count; i++) {
			double x = m->position[i][0], evaluate = (fmin(fmax(x, from), k ? 27 : 36) - from) / 9;
			bool second = m->position[i][1] > 4.5, end = !k && (x < 1 || x > 26);
			if (!end && !(fabs(m->uv[i][1] - (evaluate + (second ? k ? 2 : 4 : 0)) / pieces) < 0.02))
				fail_msg("%s: v is %g at x = %g of curve %d", types[k], m->uv[i][1], x, second);
		}
		built_shape_fini(&b);
	}
}

/* to_world transforms the control points, but not their radii. */
static void test_to_world_leaves_radii_unchanged(void **state)
{
	(void)state;
	static const char *const types[] = {"linearcurve", "bsplinecurve"};
	for (int k = 0; k < 2; k++) {
		struct built_shape a = built_ok(types[k],
						"<transform name='to_world'><scale x='4' y='2' z='-1'/>"
						"<translate x='1' y='2' z='3'/></transform>",
						"0 0 0 0.5\n1 0 0 0.5\n2 1 0 0.25\n3 0 1 0.5\n"),
				   b = built_ok(types[k], "", "1 2 3 0.5\n5 2 3 0.5\n9 4 3 0.25\n13 2 2 0.5\n");
		assert_int_equal(a.geometry.mesh.vertex_count, b.geometry.mesh.vertex_count);
		assert_memory_equal(a.geometry.mesh.position, b.geometry.mesh.position,
				    b.geometry.mesh.vertex_count * sizeof *b.geometry.mesh.position);
		built_shape_fini(&a);
		built_shape_fini(&b);
		/* Turned inside out. */
		a = built_ok(types[k], "<boolean name='flip_normals' value='true'/>",
			     "0 0 0 0.5\n0 0 1 0.5\n0 0 2 0.5\n0 0 3 0.5\n");
		for (uint32_t i = 0; i < a.geometry.mesh.vertex_count; i++)
			assert_true(a.geometry.mesh.normal[i][0] * a.geometry.mesh.position[i][0] +
					    a.geometry.mesh.normal[i][1] * a.geometry.mesh.position[i][1] <
				    1e-9);
		built_shape_fini(&a);
	}
}

static size_t store_float(unsigned char *to, float v)
{
	uint32_t bits;
	memcpy(&bits, &v, sizeof bits);
	for (int i = 0; i < 4; i++)
		to[i] = (unsigned char)(bits >> 8 * i);
	return 4;
}

/* Two hairs, and between them one of a single point, which is left out. */
static size_t write_binary_hair(unsigned char *to)
{
	static const float v[] = {0, 0, 0, 1, 0, 0, 2, 1, 0, INFINITY, 9, 9, 9, INFINITY, 0, 2, 0, 0, 3, 0};
	size_t size = 15;
	memcpy(to, "BINARY_HAIR\6\0\0\0", size);
	for (size_t i = 0; i < sizeof v / sizeof *v; i++)
		size += store_float(to + size, v[i]);
	return size;
}

static void test_binary_and_text_hair_are_read(void **state)
{
	(void)state;
	unsigned char bytes[256];
	static const char text[] = "0 0 0\n1 0 0\n2 1 0\n\n9 9 9\n\n0 2 0\n0 3 0\n";
	const char *radius = "<float name='radius' value='0.1'/>";
	struct built_shape a = built_ok("hair", radius, text),
			   b = build_curves("hair", radius, bytes, write_binary_hair(bytes)),
			   c = built_ok("linearcurve", "", "0 0 0 0.1\n1 0 0 0.1\n2 1 0 0.1\n\n0 2 0 0.1\n0 3 0 0.1\n"),
			   d = built_ok("hair", "", text),
			   s = built_ok("hair",
					"<float name='radius' value='0.05'/><transform name='to_world'>"
					"<scale x='7' y='7' z='2'/><rotate y='1' angle='30'/></transform>",
					"0 0 0\n0 1 0\n");
	/* to_world scales radii like its z axis. A tube of 12 sides has the area of the cylinder, without the ends. */
	assert_true(is_near(built_shape_area(&s.geometry.mesh), 2 * M_PI * 0.1 * 7, 0.03));
	if (b.result)
		fail_msg("%s", b.error.text);
	assert_int_equal(a.geometry.mesh.vertex_count, b.geometry.mesh.vertex_count);
	assert_int_equal(a.geometry.mesh.vertex_count, c.geometry.mesh.vertex_count);
	assert_memory_equal(a.geometry.mesh.position, b.geometry.mesh.position,
			    b.geometry.mesh.vertex_count * sizeof *b.geometry.mesh.position);
	assert_memory_equal(a.geometry.mesh.position, c.geometry.mesh.position,
			    b.geometry.mesh.vertex_count * sizeof *b.geometry.mesh.position);
	/* 0.025 is the default radius. */
	assert_true(is_near(built_shape_area(&d.geometry.mesh) / built_shape_area(&a.geometry.mesh), 0.25, 0.1));
	built_shape_fini(&a);
	built_shape_fini(&b);
	built_shape_fini(&c);
	built_shape_fini(&d);
	built_shape_fini(&s);
}

static void test_invalid_curve_files_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *type, *text, *error;
	} cases[] = {
		{"linearcurve", "", "m: has no curve"},
		{"linearcurve", "\n\n  \n", "m: has no curve"},
		{"linearcurve", "0 0 0 1\n", "m:1: a curve of 1 control point; it needs 2"},
		{"linearcurve", "0 0 0 1\n1 0 0 1\n\n2 0 0 1\n\n", "m:5: a curve of 1 control point; it needs 2"},
		{"bsplinecurve", "0 0 0 1\n1 0 0 1\n2 0 0 1\n", "m:3: a curve of 3 control points; it needs 4"},
		{"linearcurve", "0 0 0\n1 0 0 1\n", "m:1: a control point has 4 numbers"},
		{"linearcurve", "0 0 0 1\n1 x 0 1\n", "m:2: a control point has 4 numbers"},
		{"linearcurve", "0 0 0 1\n1 0 0 -1\n", "m:2: control point (1, 0, 0) of radius -1"},
		{"linearcurve", "0 0 0 1\n1 nan 0 1\n", "m:2: control point"},
		{"linearcurve", "0 0 0 1\n1 1e99 0 1\n", "m:2: control point"},
		{"linearcurve", "0 0 0 1\n1 0 0 inf\n", "m:2: control point"},
		{"hair", "0 0 0\n", "m: has no curve"},
		{"hair", "0 0\n", "m:1: a control point has 3 numbers"},
		{"hair", "BINARY_HAI 0 0", "m:1: a control point has 3 numbers"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct built_shape b = build_curves(cases[i].type, "", cases[i].text, strlen(cases[i].text));
		if (b.result >= 0 || !strstr(b.error.text, cases[i].error))
			fail_msg("%d: %s\n not: %s", b.result, b.error.text, cases[i].error);
		built_shape_fini(&b);
	}
	unsigned char bytes[256];
	size_t size = write_binary_hair(bytes);
	for (size_t n = 15; n < size; n++) {
		struct built_shape b = build_curves("hair", "", bytes, n);
		if (b.result >= 0 || !strstr(b.error.text, "m: ends before its last"))
			fail_msg("%zu of %zu bytes: %d: %s", n, size, b.result, b.error.text);
		built_shape_fini(&b);
	}
	struct built_shape b = build_curves("hair", "<float name='reduction' value='0.5'/>", bytes, size);
	assert_true(b.result < 0 && strstr(b.error.text, "\"reduction\" is only supported as 0"));
	built_shape_fini(&b);
}

/* Numbers of any size, repeated points and abrupt turns give a mesh of finite numbers, or an error. */
static void test_extreme_curves_give_finite_meshes(void **state)
{
	(void)state;
	static const char *const numbers[] = {"0",	"1",	"-1",	 "1e60",  "-1e60", "1e-60", "1e-200",
					      "5e-324", "1e30", "1e-30", "0.001", "2",	   "1e-7"};
	struct dice d = dice_for_test("extreme curves");
	uint32_t meshes = 0;
	for (int round = 0; round < 2000; round++) {
		char text[1024];
		size_t used = 0;
		for (uint32_t i = 0, n = 2 + (uint32_t)dice_below(&d, 8); i < n; i++) {
			const char *v[4];
			for (int k = 0; k < 4; k++)
				v[k] = numbers[dice_below(&d, round % 2 ? 3 : sizeof numbers / sizeof *numbers)];
			used += (size_t)snprintf(text + used, sizeof text - used, "%s %s %s %s\n", v[0], v[1], v[2],
						 v[3][0] == '-' ? v[3] + 1 : v[3]);
		}
		struct built_shape b = build_curves(round % 4 < 2 ? "linearcurve" : "bsplinecurve", "", text, used);
		assert_true(b.result <= 0);
		meshes += b.result == 0 && b.geometry.mesh.triangle_count > 0;
		for (uint32_t i = 0; b.result == 0 && i < b.geometry.mesh.vertex_count; i++) {
			assert_true(vec3_is_finite(vec3_load(b.geometry.mesh.position[i])));
			assert_true(vec3_is_finite(vec3_load(b.geometry.mesh.normal[i])));
		}
		built_shape_fini(&b);
	}
	assert_true(meshes > 1000);
}

static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	char text[1024];
	print_points(text, sizeof text, 4);
	static const char *const types[] = {"linearcurve", "bsplinecurve"};
	for (int k = 0; k < 2; k++) {
		struct built_shape b = built_ok(types[k], "", text);
		const struct memory_file files[] = {{"m", text, strlen(text)}, {0}};
		built_shape_check_out_of_memory(&b.scene, files, 3);
		built_shape_fini(&b);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_surfaces_lie_on_their_curves),
		cmocka_unit_test(test_normals_are_those_of_the_surface),
		cmocka_unit_test(test_areas_and_volumes_are_exact),
		cmocka_unit_test(test_to_world_leaves_radii_unchanged),
		cmocka_unit_test(test_v_grows_evenly_over_all_pieces),
		cmocka_unit_test(test_chain_approximates_its_spline),
		cmocka_unit_test(test_binary_and_text_hair_are_read),
		cmocka_unit_test(test_invalid_curve_files_are_refused),
		cmocka_unit_test(test_extreme_curves_give_finite_meshes),
		cmocka_unit_test(test_failed_allocations_are_reported),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
