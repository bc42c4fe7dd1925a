/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes as meshes: rectangle, cube, sphere, ellipsoid, disk and cylinder have the area, the orientation and the
 * texture coordinates of Mitsuba's shapes; OBJ files become the triangles that they describe; normals missing in a file
 * are computed as documented; and invalid files are refused with the line at fault.
 */
#include "common/base/mem.h"
#include "tests/support/failing_memory.h"
#include "tests/support/memory_assets.h"
#include "tests/support/scene_tables.h"
#include "worker/render/shape/obj_read.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct built {
	struct scene scene;
	struct arena arena;
	struct shape_geometry g;
	uint64_t dropped_count;
	struct error error;
	int result;
};

/* Builds a shape, given its type, the contents of its element, and the text of m.obj. */
static struct built build(const char *type, const char *content, const char *obj)
{
	char xml[2048];
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>\n<shape type='%s'>%s%s</shape></scene>", type,
		 obj ? "<string name='filename' value='m.obj'/>" : "", content);
	const struct memory_file files[] = {
		{"s.xml", xml, strlen(xml)}, {obj ? "m.obj" : NULL, obj, obj ? strlen(obj) : 0}, {0}};
	struct asset_source assets = memory_assets(files);
	struct built b = {0};
	b.result = scene_read(&b.scene, &assets, "s.xml", scene_tables(), NULL, 0, &b.error);
	if (b.result)
		return b;
	b.result = shape_build(b.scene.objects[0], &assets, &b.arena, &b.g, &b.dropped_count, &b.error);
	return b;
}

static void release_built(struct built *b)
{
	arena_fini(&b->arena);
	scene_fini(&b->scene);
}

static struct built build_ok(const char *type, const char *content, const char *obj)
{
	struct built b = build(type, content, obj);
	if (b.result)
		fail_msg("%s", b.error.text);
	return b;
}

static vec3 to_vec3(const double v[3])
{
	return (vec3){v[0], v[1], v[2]};
}

static vec3 triangle_normal(const struct mesh *m, uint32_t i)
{
	vec3 a = to_vec3(m->position[m->index[i][0]]), b = to_vec3(m->position[m->index[i][1]]),
	     c = to_vec3(m->position[m->index[i][2]]);
	return vec3_normalize(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
}

static void assert_vec3(vec3 a, double x, double y, double z)
{
	if (!(vec3_length(vec3_sub(a, (vec3){x, y, z})) < 1e-12))
		fail_msg("(%g, %g, %g) is not (%g, %g, %g)", a.x, a.y, a.z, x, y, z);
}

/* All triangles and normals of a closed body around the origin face away from it, or all towards it. */
static void assert_facing(const struct mesh *m, double sign)
{
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		vec3 g = triangle_normal(m, i);
		for (int k = 0; k < 3; k++) {
			vec3 p = to_vec3(m->position[m->index[i][k]]);
			assert_true(sign * vec3_dot(g, p) > 0);
			if (m->normal) {
				assert_true(sign * vec3_dot(to_vec3(m->normal[m->index[i][k]]), p) > 0);
				assert_true(fabs(vec3_length(to_vec3(m->normal[m->index[i][k]])) - 1) < 1e-12);
			}
		}
	}
}

static void test_rectangle_is_built(void **state)
{
	(void)state;
	struct built b = build_ok("rectangle", "", NULL);
	const struct mesh *m = &b.g.mesh;
	assert_int_equal(m->triangle_count, 2);
	for (uint32_t i = 0; i < 4; i++) {
		assert_true(fabs(m->position[i][0]) == 1 && fabs(m->position[i][1]) == 1 && m->position[i][2] == 0);
		assert_true(m->uv[i][0] == (m->position[i][0] + 1) / 2 && m->uv[i][1] == (m->position[i][1] + 1) / 2);
		assert_vec3(to_vec3(m->normal[i]), 0, 0, 1);
	}
	assert_vec3(triangle_normal(m, 0), 0, 0, 1);
	assert_vec3(triangle_normal(m, 1), 0, 0, 1);
	release_built(&b);
	b = build_ok("rectangle", "<boolean name='flip_normals' value='true'/>", NULL);
	assert_vec3(to_vec3(b.g.mesh.normal[0]), 0, 0, -1);
	assert_vec3(triangle_normal(&b.g.mesh, 0), 0, 0, -1);
	release_built(&b);
}

static void test_cube_faces_outwards_or_inwards(void **state)
{
	(void)state;
	static const struct {
		const char *content;
		double sign;
	} cases[] = {
		{"", 1},
		{"<boolean name='flip_normals' value='true'/>", -1},
		{"<transform name='to_world'><scale x='-2' y='1' z='3'/></transform>", 1},
		{"<transform name='to_world'><matrix value='0 1 0 1 0 0 0 0 1'/></transform>", 1},
		{"<transform name='to_world'><scale value='1e-60'/></transform>", 1},
		{"<transform name='to_world'><scale x='-1'/></transform><boolean name='flip_normals' value='true'/>",
		 -1}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct built b = build_ok("cube", cases[i].content, NULL);
		assert_int_equal(b.g.mesh.triangle_count, 12);
		assert_facing(&b.g.mesh, cases[i].sign);
		release_built(&b);
	}
}

/* Mitsuba's parametrisation of three of the faces. */
static void test_cube_has_the_uv_of_mitsuba(void **state)
{
	(void)state;
	struct built b = build_ok("cube", "", NULL);
	const struct mesh *m = &b.g.mesh;
	for (uint32_t i = 0; i < 24; i++) {
		const double *p = m->position[i], *n = m->normal[i], *uv = m->uv[i];
		if (n[2] == 1)
			assert_true(uv[0] == (p[1] + 1) / 2 && uv[1] == (p[0] + 1) / 2);
		if (n[2] == -1)
			assert_true(uv[0] == (1 - p[1]) / 2 && uv[1] == (p[0] + 1) / 2);
		if (n[1] == 1)
			assert_true(uv[0] == (1 - p[0]) / 2 && uv[1] == (1 - p[2]) / 2);
	}
	release_built(&b);
}

static void test_sphere_is_built(void **state)
{
	(void)state;
	struct built b = build_ok("sphere",
				  "<point name='center' x='1' y='2' z='3'/><float name='radius' value='0.5'/>"
				  "<transform name='to_world'><rotate z='1' angle='90'/><scale value='2'/>"
				  "<translate x='10'/></transform>",
				  NULL);
	assert_int_equal(b.g.kind, SHAPE_SPHERE);
	assert_vec3(b.g.sphere.center, 6, 2, 6);
	assert_true(fabs(b.g.sphere.radius - 1) < 1e-15);
	assert_false(b.g.sphere.flips_normals);
	assert_vec3(mat4_vector(&b.g.sphere.to_world, (vec3){1, 0, 0}), 0, 1, 0);
	release_built(&b);
	b = build("sphere", "<transform name='to_world'><scale z='0'/></transform>", NULL);
	assert_int_equal(b.result, -EINVAL);
	assert_non_null(strstr(b.error.text, "s.xml:2: <shape type=\"sphere\">: to_world flattens the shape"));
	release_built(&b);
	b = build("sphere",
		  "<float name='radius' value='1e50'/><transform name='to_world'><scale x='1e50'/></transform>", NULL);
	assert_int_equal(b.result, -ERANGE);
	release_built(&b);
}

static double mesh_area(const struct mesh *m)
{
	double sum = 0;
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		vec3 a = to_vec3(m->position[m->index[i][0]]), b = to_vec3(m->position[m->index[i][1]]),
		     c = to_vec3(m->position[m->index[i][2]]);
		sum += 0.5 * vec3_length(vec3_cross(vec3_sub(b, a), vec3_sub(c, a)));
	}
	return sum;
}

/* The points and normals of a sphere that is scaled unevenly, mirrored and sheared are those of x^T A x = 1. */
static void test_ellipsoid_satisfies_its_equation(void **state)
{
	(void)state;
	struct built b = build_ok("sphere",
				  "<float name='radius' value='2'/><transform name='to_world'>"
				  "<matrix value='-2 0 0 0.5 1 0 0 0 3'/></transform>",
				  NULL);
	const struct mesh *m = &b.g.mesh;
	assert_int_equal(b.g.kind, SHAPE_MESH);
	assert_non_null(m->uv);
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		/* o = M^-1 p lies on the sphere, M^-T o is the normal's direction. */
		const double *p = m->position[i];
		vec3 o = {-p[0] / 2, p[1] + p[0] / 4, p[2] / 3};
		assert_true(fabs(vec3_length(o) - 2) < 1e-12);
		vec3 n = vec3_normalize((vec3){-o.x / 2 + o.y / 4, o.y, o.z / 3});
		assert_true(vec3_length(vec3_sub(n, to_vec3(m->normal[i]))) < 1e-6);
	}
	assert_facing(m, 1);
	release_built(&b);
	b = build_ok("sphere",
		     "<boolean name='flip_normals' value='true'/><transform name='to_world'><scale x='2'/></transform>",
		     NULL);
	assert_facing(&b.g.mesh, -1);
	/* The area of a prolate spheroid: 2 pi (1 + c / e asin e), c = 2, e^2 = 3/4. */
	double e = sqrt(0.75);
	assert_true(fabs(mesh_area(&b.g.mesh) / (2 * M_PI * (1 + 2 / e * asin(e))) - 1) < 1e-3);
	release_built(&b);
}

static void test_disk_is_built(void **state)
{
	(void)state;
	struct built b =
		build_ok("disk", "<transform name='to_world'><scale value='3'/><translate z='1'/></transform>", NULL);
	const struct mesh *m = &b.g.mesh;
	assert_true(fabs(mesh_area(m) / (9 * M_PI) - 1) < 1e-12);
	for (uint32_t i = 0; i < m->triangle_count; i++)
		assert_vec3(triangle_normal(m, i), 0, 0, 1);
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		vec3 p = to_vec3(m->position[i]);
		double r = hypot(p.x, p.y) / 3, u = m->uv[i][0], turn = atan2(p.y, p.x) / (2 * M_PI);
		assert_true(p.z == 1 && fabs(r - u) < 1e-4 && m->uv[i][1] >= 0 && m->uv[i][1] <= 1);
		assert_true(u == 0 || fabs(m->uv[i][1] - turn - floor(m->uv[i][1] - turn + 0.5)) < 1e-12);
	}
	release_built(&b);
}

static void test_cylinder_is_built(void **state)
{
	(void)state;
	struct built b = build_ok("cylinder",
				  "<point name='p0' x='1' y='0' z='0'/><point name='p1' x='1' y='4' z='0'/>"
				  "<float name='radius' value='0.5'/>",
				  NULL);
	const struct mesh *m = &b.g.mesh;
	assert_true(fabs(mesh_area(m) / (2 * M_PI * 0.5 * 4) - 1) < 1e-4);
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		vec3 p = to_vec3(m->position[i]), out = vec3_normalize((vec3){p.x - 1, 0, p.z});
		assert_true(fabs(hypot(p.x - 1, p.z) - 0.5) < 1e-4);
		assert_true(vec3_length(vec3_sub(out, to_vec3(m->normal[i]))) < 1e-12);
		assert_true(p.y == 4 * m->uv[i][1]);
	}
	for (uint32_t i = 0; i < m->triangle_count; i++)
		assert_true(vec3_dot(triangle_normal(m, i), to_vec3(m->normal[m->index[i][0]])) > 0.99);
	release_built(&b);
	b = build("cylinder", "<point name='p0' x='1' y='0' z='0'/><point name='p1' x='1' y='0' z='0'/>", NULL);
	assert_int_equal(b.result, -EINVAL);
	assert_non_null(strstr(b.error.text, "a cylinder from (1, 0, 0) to (1, 0, 0)"));
	release_built(&b);
}

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

static void test_obj_polygons_become_triangles(void **state)
{
	(void)state;
	struct built b = build_ok("obj", "", "# a comment\no x\n" SQUARE "g a\nusemtl b\ns 1\nf 1 2 3 4\n");
	assert_int_equal(b.g.mesh.triangle_count, 2);
	assert_int_equal(b.g.mesh.vertex_count, 4);
	assert_null(b.g.mesh.uv);
	assert_vec3(triangle_normal(&b.g.mesh, 0), 0, 0, 1);
	assert_vec3(triangle_normal(&b.g.mesh, 1), 0, 0, 1);
	assert_vec3(to_vec3(b.g.mesh.normal[2]), 0, 0, 1);
	release_built(&b);
	/* Negative indices, joined lines, blanks, carriage returns, colours after positions. */
	b = build_ok("obj", "", "v 0 0 0 1 1 1\r\nv 1 0 \\\r\n 0\r\n  v\t1 1 0\r\nf -3 \\\n -2 -1 # end");
	assert_int_equal(b.g.mesh.triangle_count, 1);
	assert_vec3(to_vec3(b.g.mesh.position[b.g.mesh.index[0][1]]), 1, 0, 0);
	release_built(&b);
}

static void expect_refused(const char *content, const char *obj, const char *text)
{
	struct built b = build("obj", content, obj);
	if (b.result >= 0 || !strstr(b.error.text, text))
		fail_msg("%s\n gave %d: %s\n not: %s", obj, b.result, b.error.text, text);
	release_built(&b);
}

#define PARTS                                                                                                       \
	SQUARE "vt 0 0.25\nf 1 2 3\nusemtl red paint \nusemtl blue\nf 1/1 2/1 3/1\nusemtl red paint\r\nf 3 4 1 2\n" \
	       "usemtl blue\nv 9 8 0\nf 1/1 3/1 5/1\nusemtl none\n"

static void test_obj_material_selects_faces(void **state)
{
	(void)state;
	struct built b = build_ok("obj", "<string name='material' value='blue'/>", PARTS);
	static const double blue[][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {9, 8, 0}};
	assert_int_equal(b.g.mesh.triangle_count, 2);
	for (int i = 0; i < 6; i++) {
		uint32_t v = b.g.mesh.index[i / 3][i % 3];
		assert_memory_equal(b.g.mesh.position[v], blue[i], sizeof blue[i]);
		assert_true(b.g.mesh.uv[v][1] == 0.75);
	}
	assert_int_equal(b.g.mesh.vertex_count, 4); /* vertices that the faces share are shared in the mesh */
	assert_false(b.g.has_materials);
	release_built(&b);
	b = build_ok("obj", "<string name='material' value='red paint'/>", PARTS);
	assert_true(b.g.mesh.triangle_count == 2 && b.g.mesh.vertex_count == 4 && !b.g.mesh.uv);
	release_built(&b);
	b = build_ok("obj", "<string name='material' value=''/>", PARTS);
	assert_true(b.g.mesh.triangle_count == 1 && b.g.mesh.vertex_count == 3);
	release_built(&b);
	b = build_ok("obj", "", PARTS);
	assert_true(b.g.mesh.triangle_count == 5 && b.g.has_materials);
	release_built(&b);
	expect_refused("<string name='material' value='none'/>", PARTS, "m.obj: has no faces of the material `none`");
	expect_refused("<string name='material' value='red'/>", PARTS, "has no faces of the material `red`");
}

/* The file is read once for all its materials, and again if another file has been requested in between. */
static void test_obj_is_read_once_for_all_materials(void **state)
{
	(void)state;
	/* clang-format off */
	static const char xml[] =
		"<scene version='3.0.0'>"
			"<shape type='obj'>"
				"<string name='filename' value='m.obj'/>"
				"<string name='material' value='blue'/>"
			"</shape>"
			"<shape type='obj'>"
				"<string name='filename' value='m.obj'/>"
				"<string name='material' value=''/>"
			"</shape>"
			"<shape type='obj'>"
				"<string name='filename' value='n.obj'/>"
				"<string name='material' value=''/>"
			"</shape>"
		"</scene>";
	/* clang-format on */
	struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1},
				      {"m.obj", PARTS, sizeof PARTS - 1},
				      {"n.obj", SQUARE "f 1 2 3 4\n", sizeof SQUARE "f 1 2 3 4\n" - 1},
				      {0}};
	struct asset_source assets = memory_assets(files);
	struct obj_cache kept = {.name = NULL};
	struct scene s;
	struct arena arena = {0};
	struct shape_geometry g;
	struct error e;
	uint64_t dropped;
	assert_int_equal(scene_read(&s, &assets, "s.xml", scene_tables(), NULL, 0, &e), 0);
	assets.obj_cache = &kept;
	static const uint32_t triangles[] = {2, 1, 2, 2};
	for (int i = 0; i < 4; i++) {
		if (i == 1)
			files[1].name = "gone.obj";
		if (i == 3)
			files[1].name = "m.obj";
		assert_int_equal(shape_build(s.objects[i % 3], &assets, &arena, &g, &dropped, &e), 0);
		assert_int_equal(g.mesh.triangle_count, triangles[i]);
	}
	obj_cache_fini(&kept);
	arena_fini(&arena);
	scene_fini(&s);
}

static void test_obj_normals_and_uv_are_read(void **state)
{
	(void)state;
	const char *obj =
		SQUARE "vt 0 0.25\nvt 1 0\nvt 1 1 0\nvn 0 0 2\nvn 0 3 4\nf 1/1/1 2/2/1 3/3/1\nf 1/1/2 3/3/1 4//1\n";
	struct built b = build_ok("obj", "", obj);
	const struct mesh *m = &b.g.mesh;
	assert_int_equal(m->vertex_count, 5); /* vertex 1 has two normals */
	const uint32_t *t = m->index[0], *s = m->index[1];
	assert_true(m->uv[t[0]][0] == 0 && m->uv[t[0]][1] == 0.75); /* v runs downwards in images */
	assert_true(m->uv[t[1]][1] == 1);
	assert_int_equal(t[2], s[1]);
	assert_int_not_equal(t[0], s[0]);
	assert_vec3(to_vec3(m->normal[t[0]]), 0, 0, 1);
	assert_vec3(to_vec3(m->normal[s[0]]), 0, 0.6, 0.8);
	release_built(&b);
	b = build_ok("obj", "<boolean name='flip_tex_coords' value='false'/>", obj);
	assert_true(b.g.mesh.uv[b.g.mesh.index[0][0]][1] == 0.25);
	release_built(&b);
	b = build_ok("obj", "<boolean name='face_normals' value='true'/>", obj);
	assert_null(b.g.mesh.normal);
	release_built(&b);
}

/* clang-format off */
#define OCTAHEDRON                                                                                                             \
	"v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n"                                                           \
	"f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n"
/* clang-format on */

static void test_smooth_normals_are_computed(void **state)
{
	(void)state;
	struct built b = build_ok("obj", "", OCTAHEDRON);
	assert_facing(&b.g.mesh, 1);
	for (uint32_t i = 0; i < 6; i++) /* by symmetry, the normal of a corner is its position */
		assert_vec3(to_vec3(b.g.mesh.normal[i]), b.g.mesh.position[i][0], b.g.mesh.position[i][1],
			    b.g.mesh.position[i][2]);
	release_built(&b);
	b = build_ok("obj", "<transform name='to_world'><scale x='-1' y='2' z='3'/></transform>", OCTAHEDRON);
	assert_facing(&b.g.mesh, 1);
	release_built(&b);
	b = build_ok("obj", "<boolean name='flip_normals' value='true'/>", OCTAHEDRON);
	assert_facing(&b.g.mesh, -1);
	release_built(&b);
}

/* Two right angles on one side, one on the other: weights are angles, not areas or counts. */
static void test_normals_are_weighted_by_angle(void **state)
{
	(void)state;
	struct built b =
		build_ok("obj", "", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 9\nv 0.5 0.5 0\nf 1 2 5\nf 1 5 3\nf 1 3 4\n");
	vec3 n = to_vec3(b.g.mesh.normal[b.g.mesh.index[0][0]]);
	assert_vec3(n, sqrt(0.5), 0, sqrt(0.5));
	release_built(&b);
}

static void test_normals_decide_the_outside(void **state)
{
	(void)state;
	struct built b = build_ok("obj", "", SQUARE "vn 0 0 -1\nf 1//1 2//1 3//1\n");
	assert_vec3(triangle_normal(&b.g.mesh, 0), 0, 0, -1);
	release_built(&b);
	b = build_ok("obj", "<transform name='to_world'><scale z='-1'/></transform>",
		     SQUARE "vn 0 0 -1\nf 1//1 2//1 3//1\n");
	assert_vec3(triangle_normal(&b.g.mesh, 0), 0, 0, 1);
	assert_vec3(to_vec3(b.g.mesh.normal[0]), 0, 0, 1);
	release_built(&b);
}

static void test_flat_triangles_are_dropped(void **state)
{
	(void)state;
	struct built b = build_ok("obj", "", SQUARE "f 1 2 3\nf 1 1 2\nf 1 2 2\nv 2 0 0\nf 1 2 5\n");
	assert_int_equal(b.g.mesh.triangle_count, 1);
	assert_int_equal(b.dropped_count, 3);
	release_built(&b);
	/* Points and lines written as faces. */
	b = build_ok("obj", "", SQUARE "f 1\nf 1 2 3\nf 1 2\n");
	assert_int_equal(b.g.mesh.triangle_count, 1);
	assert_int_equal(b.dropped_count, 2);
	release_built(&b);
}

static void test_invalid_objs_are_refused(void **state)
{
	(void)state;
	expect_refused("", "", "m.obj: has no vertices and no faces");
	expect_refused("", "v 0 0 nan\n", "s.xml:2: <shape type=\"obj\">: m.obj:1: `v` needs 3 finite numbers");
	expect_refused("", "v 0 0 inf\n", "finite numbers");
	expect_refused("", "v 0 0 1e99\n", "finite numbers");
	expect_refused("", "v 0 0\nv 1 1 1\n", "m.obj:1: `v` needs");
	expect_refused("", "v 0 0 0x\n", "m.obj:1: `v` needs");
	expect_refused("", SQUARE "vn 0 0 x\n", "m.obj:5: `vn` needs");
	expect_refused("", "v 0 0 NaN\n", "m.obj:1: `v` needs");
	expect_refused("", SQUARE "vt\n", "`vt` needs 1");
	expect_refused("", SQUARE "vt 0 2e12\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n",
		       "a texture coordinate lies beyond 1e+12");
	expect_refused("", SQUARE "\nf 1 2 5\n", "m.obj:6: vertex 5 is out of range; there are 4");
	expect_refused("", SQUARE "f 0 1 2\n", "vertex 0 is out of range");
	expect_refused("", SQUARE "f -5 1 2\n", "vertex -5 is out of range");
	expect_refused("", SQUARE "f 1 2 99999999999999999999\n", "m.obj:5: a face's corners");
	expect_refused("", SQUARE "f 1/1 2/1 3/1\n", "texture coordinate 1 is out of range; there are 0");
	expect_refused("", SQUARE "f 1//1 2//1 3//1\n", "normal 1 is out of range");
	expect_refused("", SQUARE "f\n", "m.obj:5: a face without corners");
	expect_refused("", SQUARE "f 1/ 2/ 3/\n", "a face's corners are");
	expect_refused("", SQUARE "f 1/x 2 3\n", "a face's corners are");
	expect_refused("", SQUARE "f 1.5 2 3\n", "a face's corners are");
	expect_refused("<transform name='to_world'><scale z='0'/></transform>", SQUARE "f 1 2 3\n",
		       "to_world flattens the shape");
	expect_refused("<transform name='to_world'><scale value='1e60'/></transform>",
		       "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nf 1 2 3\n", "a vertex lies beyond");
	struct built b = build("obj", "<string name='filename' value='none.obj'/>", NULL);
	assert_int_equal(b.result, -ENOENT);
	assert_non_null(strstr(b.error.text, "s.xml:2: <shape type=\"obj\">: none.obj: no such file"));
	release_built(&b);
}

static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	struct built b = build_ok("obj", "", OCTAHEDRON);
	const struct memory_file files[] = {{"m.obj", OCTAHEDRON, sizeof OCTAHEDRON - 1}, {0}};
	struct asset_source assets = memory_assets(files);
	int r = -1;
	long n;
	for (n = 0; r && n < 1000; n++) {
		struct arena arena = {0};
		struct shape_geometry g;
		mem_fail_after(n);
		r = shape_build(b.scene.objects[0], &assets, &arena, &g, &b.dropped_count, &b.error);
		mem_fail_after(-1);
		assert_true(r == 0 || r == -ENOMEM);
		arena_fini(&arena);
	}
	assert_int_equal(r, 0);
	assert_true(n > 4);
	release_built(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_rectangle_is_built),
		cmocka_unit_test(test_cube_faces_outwards_or_inwards),
		cmocka_unit_test(test_cube_has_the_uv_of_mitsuba),
		cmocka_unit_test(test_sphere_is_built),
		cmocka_unit_test(test_ellipsoid_satisfies_its_equation),
		cmocka_unit_test(test_disk_is_built),
		cmocka_unit_test(test_cylinder_is_built),
		cmocka_unit_test(test_obj_polygons_become_triangles),
		cmocka_unit_test(test_obj_material_selects_faces),
		cmocka_unit_test(test_obj_is_read_once_for_all_materials),
		cmocka_unit_test(test_obj_normals_and_uv_are_read),
		cmocka_unit_test(test_smooth_normals_are_computed),
		cmocka_unit_test(test_normals_are_weighted_by_angle),
		cmocka_unit_test(test_normals_decide_the_outside),
		cmocka_unit_test(test_flat_triangles_are_dropped),
		cmocka_unit_test(test_invalid_objs_are_refused),
		cmocka_unit_test(test_failed_allocations_are_reported),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
