/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Displaced meshes have no cracks, whatever the base mesh; with height 0 they are the base itself; and positions,
 * normals and derivatives of normals converge to those of the analytic surface at the expected order.
 */
#include "common/base/mem.h"
#include "tests/support/failing_memory.h"
#include "tests/support/memory_assets.h"
#include "tests/support/scene_tables.h"
#include "worker/render/shape/displace.h"
#include "worker/render/shape/mesh.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

struct built {
	struct scene scene;
	struct arena arena;
	struct shape_geometry g;
	struct error error;
	int result;
};

static struct built build(const char *type, const char *content, const char *obj, const struct displacement *d)
{
	char xml[2048];
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>\n<shape type='%s'>%s%s</shape></scene>", type,
		 obj ? "<string name='filename' value='m.obj'/>" : "", content);
	const struct memory_file files[] = {
		{"s.xml", xml, strlen(xml)}, {obj ? "m.obj" : NULL, obj, obj ? strlen(obj) : 0}, {0}};
	struct asset_source assets = memory_assets(files);
	struct built b = {0};
	uint64_t dropped;
	if (scene_read(&b.scene, &assets, "s.xml", scene_tables(), NULL, 0, &b.error) ||
	    shape_build(b.scene.objects[0], &assets, &b.arena, &b.g, &dropped, &b.error))
		fail_msg("%s", b.error.text);
	b.result = displace_geometry(&b.g, d, &b.arena, b.scene.objects[0], &b.error);
	return b;
}

static struct built build_ok(const char *type, const char *content, const char *obj, const struct displacement *d)
{
	struct built b = build(type, content, obj, d);
	if (b.result)
		fail_msg("%s", b.error.text);
	assert_int_equal(b.g.kind, SHAPE_MESH);
	return b;
}

static void release_built(struct built *b)
{
	arena_fini(&b->arena);
	scene_fini(&b->scene);
}

/* A height that differs at the two ends of each unit and is smooth nowhere: the hardest case for seams. */
static double rough_height(const void *user, double u, double v)
{
	(void)user;
	double x = sin(127.1 * u + 311.7 * v) * 43758.5;
	return x - floor(x);
}

static double wave_height(const void *user, double u, double v)
{
	(void)user;
	return sin(2 * M_PI * u) * cos(2 * M_PI * v) + 0.3 * u * v;
}

static double unit_height(const void *user, double u, double v)
{
	(void)user, (void)u, (void)v;
	return 1;
}

struct triangle_side {
	double p[2][3];
	int direction; /* +1: from the smaller end to the larger */
};

static int compare_sides(const void *a, const void *b)
{
	const struct triangle_side *x = a, *y = b;
	for (int k = 0; k < 6; k++)
		if (x->p[k / 3][k % 3] != y->p[k / 3][k % 3])
			return x->p[k / 3][k % 3] < y->p[k / 3][k % 3] ? -1 : 1;
	return 0;
}

static int compare_points(const double *a, const double *b)
{
	for (int k = 0; k < 3; k++)
		if (a[k] != b[k])
			return a[k] < b[k] ? -1 : 1;
	return 0;
}

/* Each side of each triangle is also a side of another, in the opposite direction, with exactly the same ends. */
static void assert_closed(const struct mesh *m)
{
	size_t n = 3 * (size_t)m->triangle_count;
	struct triangle_side *s = calloc(n, sizeof *s);
	for (size_t i = 0; i < n; i++) {
		const double *a = m->position[m->index[i / 3][i % 3]], *b = m->position[m->index[i / 3][(i + 1) % 3]];
		bool up = compare_points(a, b) < 0;
		memcpy(s[i].p[0], up ? a : b, sizeof s[i].p[0]);
		memcpy(s[i].p[1], up ? b : a, sizeof s[i].p[1]);
		s[i].direction = up ? 1 : -1;
	}
	qsort(s, n, sizeof *s, compare_sides);
	assert_int_equal(n % 2, 0);
	for (size_t i = 0; i < n; i += 2) {
		if (compare_sides(&s[i], &s[i + 1]) != 0 || s[i].direction + s[i + 1].direction != 0 ||
		    (i + 2 < n && compare_sides(&s[i + 1], &s[i + 2]) == 0))
			fail_msg("a crack at (%g, %g, %g)", s[i].p[0][0], s[i].p[0][1], s[i].p[0][2]);
	}
	free(s);
}

static double enclosed_volume(const struct mesh *m)
{
	double sum = 0;
	for (uint32_t i = 0; i < m->triangle_count; i++)
		sum += vec3_dot(
			vec3_load(m->position[m->index[i][0]]),
			vec3_cross(vec3_load(m->position[m->index[i][1]]), vec3_load(m->position[m->index[i][2]])));
	return sum / 6;
}

/* clang-format off */
#define TETRAHEDRON                                                                                                            \
	"v 1 1 1\nv -1 -1 1\nv -1 1 -1\nv 1 -1 -1\nvt 0 0\nvt 1 0\nvt 0 1\nvt 0.7 0.9\nvt 0.3 0.1\n"                        \
	"f 1/1 3/2 2/3\nf 1/4 2/2 4/5\nf 1/3 4/1 3/5\nf 2/2 3/4 4/3\n"
/* clang-format on */
/* The same, each triangle with vertices of its own. */
/* clang-format off */
#define TETRAHEDRON_UNSHARED \
	"v 1 1 1\nv -1 1 -1\nv -1 -1 1\nv 1 1 1\nv -1 -1 1\nv 1 -1 -1\nv 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\n" \
	"v -1 1 -1\nv 1 -1 -1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf 4/1 5/2 6/3\nf 7/1 8/2 9/3\nf 10/1 11/2 12/3\n"
/* clang-format on */

static void test_displaced_meshes_stay_closed(void **state)
{
	(void)state;
	static const struct {
		const char *type, *content, *obj;
		uint32_t base;
		double sign;
	} cases[] = {
		{"cube", "", NULL, 12, 1},
		{"cube",
		 "<transform name='to_world'><scale x='-2' y='0.3'/><rotate x='1' y='2' angle='33'/></transform>", NULL,
		 12, 1},
		{"sphere", "", NULL, 8, 1},
		{"sphere", "<boolean name='flip_normals' value='true'/>", NULL, 8, -1},
		{"sphere", "<transform name='to_world'><scale x='-1'/><rotate z='1' x='1' angle='70'/></transform>",
		 NULL, 8, 1},
		{"obj", "", TETRAHEDRON, 4, 1},
		{"obj", "<boolean name='face_normals' value='true'/>", TETRAHEDRON, 4, 1},
		{"obj", "", TETRAHEDRON_UNSHARED, 4, 1},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		for (uint32_t level = 0; level < 5; level++) {
			struct displacement d = {rough_height, NULL, false, 0.05, level, 1};
			struct built b = build_ok(cases[i].type, cases[i].content, cases[i].obj, &d);
			const struct mesh *m = &b.g.mesh;
			assert_int_equal(m->triangle_count, cases[i].base << 2 * level);
			assert_closed(m);
			assert_true(cases[i].sign * enclosed_volume(m) > 0);
			for (uint32_t k = 0; k < m->vertex_count; k++)
				assert_true(fabs(vec3_length(vec3_load(m->normal[k])) - 1) < 1e-12);
			release_built(&b);
		}
}

/* Likewise those of triangles without area, such as the second face. */
static void test_unused_vertices_are_not_displaced(void **state)
{
	(void)state;
	struct displacement d = {unit_height, NULL, true, 3, 2, 1};
	struct built b =
		build_ok("obj", "", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nv 9 9 9\nv 9 8 9\nf 1 2 3\nf 4 5 6\n", &d);
	assert_int_equal(b.g.mesh.triangle_count, 16);
	for (uint32_t i = 0; i < b.g.mesh.vertex_count; i++) {
		const double *p = b.g.mesh.position[i];
		assert_true(p[2] == 3 || (p[0] == 9 && p[2] == 9));
	}
	release_built(&b);
}

static void test_height_zero_keeps_the_base_mesh(void **state)
{
	(void)state;
	static const char *const types[] = {"cube", "rectangle", "sphere", "obj", "obj"};
	for (size_t i = 0; i < 5; i++) {
		struct displacement d = {rough_height, NULL, false, 0, 3, 1};
		const char *content = i == 4 ? "<boolean name='face_normals' value='true'/>" : "";
		struct built b = build_ok(types[i], content, i >= 3 ? TETRAHEDRON : NULL, &d);
		const struct mesh *m = &b.g.mesh;
		for (uint32_t k = 0; k < m->triangle_count; k++) {
			vec3 p[3], n[3], g;
			for (int c = 0; c < 3; c++) {
				p[c] = vec3_load(m->position[m->index[k][c]]);
				n[c] = vec3_load(m->normal[m->index[k][c]]);
			}
			g = vec3_normalize(vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0])));
			for (int c = 0; c < 3; c++) {
				double off = 0;
				if (i == 0)
					off = fmax(fabs(p[c].x), fmax(fabs(p[c].y), fabs(p[c].z))) - 1;
				else if (i == 1)
					off = p[c].z;
				else if (i == 2)
					off = vec3_length(vec3_sub(n[c], p[c])) + vec3_length(p[c]) - 1;
				else
					off = vec3_dot(p[c], g) - sqrt(1.0 / 3);
				assert_true(fabs(off) < 1e-14);
				if (i == 0 || i == 1 || i == 4)
					assert_true(vec3_length(vec3_sub(n[c], g)) < 1e-13);
			}
		}
		release_built(&b);
	}
}

/* A cube enlarged by a constant height: its faces are further out, with their own normals except where they meet. */
static void test_constant_height_enlarges_a_cube(void **state)
{
	(void)state;
	struct displacement d = {unit_height, NULL, true, 0.25, 3, 1};
	struct built b = build_ok("cube", "", NULL, &d);
	const struct mesh *m = &b.g.mesh;
	uint32_t corners = 0, edges = 0, faces = 0;
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		vec3 p = vec3_load(m->position[i]), n = vec3_load(m->normal[i]);
		double a[3] = {fabs(p.x), fabs(p.y), fabs(p.z)};
		int corner = 0, edge = 0, face = 0;
		for (int k = 0; k < 3; k++) {
			corner += fabs(a[k] - 1 - 0.25 / sqrt(3)) < 1e-14;
			edge += fabs(a[k] - 1 - 0.25 / sqrt(2)) < 1e-14;
			face += a[k] == 1.25;
		}
		corners += corner == 3;
		edges += edge == 2;
		faces += face == 1;
		assert_true(corner == 3 || edge == 2 || face == 1);
		if (face)
			assert_true(fmax(fabs(n.x), fmax(fabs(n.y), fabs(n.z))) > 1 - 1e-14);
		else /* turned outwards, by less than half the angle to the neighbour's normal */
			assert_true(vec3_dot(n, vec3_normalize(p)) > 0.5 &&
				    fmax(fabs(n.x), fmax(fabs(n.y), fabs(n.z))) < 0.999);
	}
	assert_int_equal(corners, 24);
	assert_int_equal(edges, 24 * 7);
	assert_int_equal(faces, 6 * 49);
	release_built(&b);
}

/* Largest deviations from the analytic surface over all vertices and triangles. */
struct deviations {
	double position, normal, derivative;
};

typedef void surface(double u, double v, vec3 *p, vec3 *n);

/* Compares the derivatives of the unit normal with respect to u and v inside a triangle, of the mesh and of the
 * surface. */
static double derivative_error(const struct mesh *m, const uint32_t t[3], surface *reference)
{
	const double *c0 = m->uv[t[0]], *c1 = m->uv[t[1]], *c2 = m->uv[t[2]];
	double du1 = c1[0] - c0[0], dv1 = c1[1] - c0[1], du2 = c2[0] - c0[0], dv2 = c2[1] - c0[1],
	       det = du1 * dv2 - dv1 * du2;
	vec3 n0 = vec3_load(m->normal[t[0]]), d1 = vec3_sub(vec3_load(m->normal[t[1]]), n0),
	     d2 = vec3_sub(vec3_load(m->normal[t[2]]), n0);
	vec3 mean = vec3_madd(vec3_madd(n0, 1.0 / 3, d1), 1.0 / 3, d2);
	double length = vec3_length(mean), worst = 0;
	vec3 n = vec3_scale(1 / length, mean);
	for (int k = 0; k < 2; k++) {
		vec3 change = k ? vec3_sub(vec3_scale(du1, d2), vec3_scale(du2, d1))
				: vec3_sub(vec3_scale(dv2, d1), vec3_scale(dv1, d2));
		change = vec3_scale(1 / (det * length), change);
		change = vec3_madd(change, -vec3_dot(change, n), n);
		vec3 p, a, b;
		double u = (c0[0] + c1[0] + c2[0]) / 3, v = (c0[1] + c1[1] + c2[1]) / 3, h = 1e-5;
		reference(k ? u : u + h, k ? v + h : v, &p, &a);
		reference(k ? u : u - h, k ? v - h : v, &p, &b);
		worst = fmax(worst, vec3_length(vec3_sub(change, vec3_scale(0.5 / h, vec3_sub(a, b)))));
	}
	return worst;
}

/* With a margin in v for spheres, since u is undefined at the poles. */
static struct deviations measure_deviations(const struct mesh *m, surface *reference, double margin)
{
	struct deviations r = {0, 0, 0};
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		bool skip = false;
		for (int k = 0; k < 3; k++) {
			uint32_t t = m->index[i][k];
			double u = m->uv[t][0], v = m->uv[t][1];
			skip |= v < margin || v > 1 - margin;
			if (skip)
				continue;
			vec3 p, n;
			reference(u, v, &p, &n);
			r.position = fmax(r.position, vec3_length(vec3_sub(p, vec3_load(m->position[t]))));
			r.normal = fmax(r.normal, vec3_length(vec3_sub(n, vec3_load(m->normal[t]))));
		}
		if (!skip)
			r.derivative = fmax(r.derivative, derivative_error(m, m->index[i], reference));
	}
	return r;
}

/* Returns the normal of a surface, from differences of positions with steps far smaller than those of the meshes. */
static vec3 surface_normal(vec3 (*at)(double, double), double u, double v, double sign)
{
	double h = 1e-4;
	vec3 d[2];
	for (int k = 0; k < 2; k++) {
		double x = k ? 0 : h, y = k ? h : 0;
		d[k] = vec3_sub(vec3_scale(8, vec3_sub(at(u + x, v + y), at(u - x, v - y))),
				vec3_sub(at(u + 2 * x, v + 2 * y), at(u - 2 * x, v - 2 * y)));
	}
	return vec3_scale(sign, vec3_normalize(vec3_cross(d[0], d[1])));
}

static vec3 plane_point(double u, double v)
{
	return (vec3){2 * u - 1, 2 * v - 1, 0.2 * wave_height(NULL, u, v)};
}

static void wavy_plane(double u, double v, vec3 *p, vec3 *n)
{
	*p = plane_point(u, v);
	*n = surface_normal(plane_point, u, v, 1);
}

/* A height that is periodic in u, and has a single value at each pole. */
static double bump_height(const void *user, double u, double v)
{
	(void)user;
	double s = sin(M_PI * v), c = cos(M_PI * v), a = 2 * M_PI * u;
	return s * s * cos(2 * a) + 0.5 * c + s * sin(a);
}

static vec3 ball_point(double u, double v)
{
	double s = sin(M_PI * v), r = 1 + 0.1 * bump_height(NULL, u, v);
	return (vec3){r * s * cos(2 * M_PI * u), r * s * sin(2 * M_PI * u), r * cos(M_PI * v)};
}

static void bumpy_ball(double u, double v, vec3 *p, vec3 *n)
{
	*p = ball_point(u, v);
	*n = surface_normal(ball_point, u, v, -1);
}

/* Positions lie on the surface; the error of normals is proportional to the square of the step (a quarter at the next
 * level), and that of the derivatives of interpolated normals to the step (a half). */
static void expect_convergence(const char *type, double (*height)(const void *, double, double), double scale,
			       surface *reference, double margin)
{
	struct deviations last = {0, 0, 0};
	for (uint32_t level = 5; level <= 7; level++) {
		struct displacement d = {height, NULL, false, scale, level, 1};
		struct built b = build_ok(type, "", NULL, &d);
		struct deviations r = measure_deviations(&b.g.mesh, reference, margin);
		print_message("%s, level %u: positions off by %.1e, normals by %.2e, their derivatives by %.3f\n", type,
			      level, r.position, r.normal, r.derivative);
		assert_true(r.position < 1e-14);
		if (level > 5) {
			assert_true(r.normal < last.normal / 3.6 && r.normal > last.normal / 4.4);
			assert_true(r.derivative < last.derivative / 1.8 && r.derivative > last.derivative / 2.2);
		}
		last = r;
		release_built(&b);
	}
	assert_true(last.normal < 1e-3);
}

static void test_displaced_plane_converges(void **state)
{
	(void)state;
	expect_convergence("rectangle", wave_height, 0.2, wavy_plane, 0);
}

static void test_displaced_ball_converges(void **state)
{
	(void)state;
	expect_convergence("sphere", bump_height, 0.1, bumpy_ball, 0.1);
}

/* The normal is also right at the poles, where u is undefined. */
static void test_normals_are_right_at_the_poles(void **state)
{
	(void)state;
	struct displacement d = {bump_height, NULL, false, 0.1, 7, 1};
	struct built b = build_ok("sphere", "", NULL, &d);
	uint32_t poles = 0;
	for (uint32_t i = 0; i < b.g.mesh.vertex_count; i++) {
		vec3 p = vec3_load(b.g.mesh.position[i]), n = vec3_load(b.g.mesh.normal[i]);
		if (fabs(p.x) > 1e-12 || fabs(p.y) > 1e-12)
			continue;
		poles++;
		/* r = 1.05 + 0.1 s sin a + O(s^2): a slope of 0.1 over 1.05 towards y; 0.95 below. */
		double z = p.z > 0 ? 1 : -1, r = z > 0 ? 1.05 : 0.95;
		vec3 expected = vec3_normalize((vec3){0, -0.1 / r, z});
		assert_true(fabs(fabs(p.z) - r) < 1e-12);
		assert_true(vec3_length(vec3_sub(n, expected)) < 2e-4);
	}
	assert_int_equal(poles, 8);
	release_built(&b);
}

static void test_invalid_displacements_are_refused(void **state)
{
	(void)state;
	struct displacement d = {wave_height, NULL, false, 1, 13, 1};
	struct built b = build("cube", "", NULL, &d);
	assert_int_equal(b.result, -E2BIG);
	assert_non_null(strstr(
		b.error.text,
		"s.xml:2: <shape type=\"cube\">: displacement_level 13 makes 805306368 triangles; at most 134217728"));
	release_built(&b);
	d.level = 2;
	b = build("obj", "", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", &d);
	assert_int_equal(b.result, -EINVAL);
	assert_non_null(strstr(b.error.text, "needs texture coordinates"));
	release_built(&b);
	d.scale = 1e60;
	b = build("sphere", "<float name='radius' value='9e59'/>", NULL, &d);
	assert_int_equal(b.result, -ERANGE);
	assert_non_null(strstr(b.error.text, "displacement moves a vertex beyond"));
	release_built(&b);
}

static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	struct displacement d = {wave_height, NULL, false, 0.1, 2, 1};
	int r = -1;
	for (long n = 0; r && n < 100; n++) {
		struct scene_node node = {.cls = PLUGIN_SHAPE, .type = "sphere", .file = "s.xml"};
		struct shape_geometry g = {.kind = SHAPE_SPHERE, .sphere = {.radius = 1, .to_world = mat4_identity()}};
		struct arena arena = {0};
		struct error e;
		mem_fail_after(n);
		r = displace_geometry(&g, &d, &arena, &node, &e);
		mem_fail_after(-1);
		assert_true(r == 0 || r == -ENOMEM);
		arena_fini(&arena);
	}
	assert_int_equal(r, 0);
}

/* A million triangles: the time is printed; only an algorithm that is not linear exceeds a limit this wide. */
static void test_million_triangles_take_linear_time(void **state)
{
	(void)state;
	struct displacement d = {wave_height, NULL, false, 0.1, 9, 1};
	clock_t begin = clock();
	struct built b = build_ok("cube", "", NULL, &d);
	double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
	print_message("%u triangles in %.2f s\n", b.g.mesh.triangle_count, seconds);
	assert_true(seconds < 60);
	release_built(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_displaced_meshes_stay_closed),
		cmocka_unit_test(test_unused_vertices_are_not_displaced),
		cmocka_unit_test(test_height_zero_keeps_the_base_mesh),
		cmocka_unit_test(test_constant_height_enlarges_a_cube),
		cmocka_unit_test(test_displaced_plane_converges),
		cmocka_unit_test(test_displaced_ball_converges),
		cmocka_unit_test(test_normals_are_right_at_the_poles),
		cmocka_unit_test(test_invalid_displacements_are_refused),
		cmocka_unit_test(test_failed_allocations_are_reported),
		cmocka_unit_test(test_million_triangles_take_linear_time),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
