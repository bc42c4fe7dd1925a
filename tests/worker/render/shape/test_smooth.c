/* SPDX-License-Identifier: Apache-2.0 */
/*
 * max_smooth_angle is compared with the same meshes with explicit normals: the faces that share a normal, weights by
 * angle, the order of faces where three meet, seams of texture coordinates and colours, and angles that are refused.
 */
#include "tests/support/append_format.h"
#include "tests/support/built_shape.h"
#include "tests/support/scene_tables.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static char text[1 << 22];
static size_t used;

#define put(...) append_format(text, sizeof text, &used, __VA_ARGS__)

/* Builds the mesh in `text`. */
static struct built_shape build(const char *content)
{
	char xml[1024];
	snprintf(xml, sizeof xml,
		 "<scene version='0.6.0'>\n<shape type='obj'><string name='filename' value='m.obj'/>%s</shape></scene>",
		 content);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"m.obj", text, used}, {0}};
	return built_shape_make(files, scene_tables());
}

#define ANGLE(x) "<float name='maxSmoothAngle' value='" #x "'/>"

static struct built_shape build_ok(const char *content)
{
	struct built_shape b = build(content);
	if (b.result)
		fail_msg("%s", b.error.text);
	return b;
}

/* All corners of all triangles have the same positions and normals; the numbering of vertices may differ. */
static void expect_same_corners(struct built_shape *a, struct built_shape *b)
{
	const struct mesh *x = &a->geometry.mesh, *y = &b->geometry.mesh;
	assert_int_equal(x->triangle_count, y->triangle_count);
	assert_true(x->normal && y->normal);
	for (uint32_t i = 0; i < x->triangle_count; i++)
		for (int k = 0; k < 3; k++)
			for (int c = 0; c < 3; c++) {
				assert_true(x->position[x->index[i][k]][c] == y->position[y->index[i][k]][c]);
				double difference = x->normal[x->index[i][k]][c] - y->normal[y->index[i][k]][c];
				if (!(fabs(difference) < 1e-12))
					fail_msg("triangle %u, corner %d: component %d of the normal is off by %g", i,
						 k, c, difference);
			}
	built_shape_fini(a);
	built_shape_fini(b);
}

/* A prism with `sides` sides around z, from z = 0 to 1, with lids. ROUND: the sides have the normals of a cylinder;
 * FLAT: each side has its own; NONE: the file has no normals, and corners share positions. */
enum normal_kind { NONE, FLAT, ROUND };
static void put_prism(int sides, enum normal_kind normals)
{
	used = 0;
	for (int i = 0; i < 2 * sides; i++)
		put("v %.17g %.17g %d\n", cos(M_PI * (i / 2) * 2 / sides), sin(M_PI * (i / 2) * 2 / sides), i % 2);
	/* normal_kind: 2 i at corner i, 2 i + 1 between corners; then down, up */
	for (int i = 0; i < 2 * sides; i++)
		put("vn %.17g %.17g 0\n", cos(M_PI * i / sides), sin(M_PI * i / sides));
	put("vn 0 0 -1\nvn 0 0 1\n");
	for (int i = 0; i < sides; i++) {
		int next = (i + 1) % sides, v[4] = {2 * i + 1, 2 * next + 1, 2 * next + 2, 2 * i + 2};
		int here = normals == ROUND ? 2 * i + 1 : 2 * i + 2, there = normals == ROUND ? 2 * next + 1 : here;
		if (normals == NONE)
			put("f %d %d %d\nf %d %d %d\n", v[0], v[1], v[2], v[0], v[2], v[3]);
		else
			put("f %d//%d %d//%d %d//%d\nf %d//%d %d//%d %d//%d\n", v[0], here, v[1], there, v[2], there,
			    v[0], here, v[2], there, v[3], here);
	}
	for (int i = 1; i + 1 < sides; i++)
		for (int lid = 0; lid < 2; lid++) {
			int a = 1 + lid, b = 2 * i + 1 + lid, c = 2 * i + 3 + lid, n = 2 * sides + 1 + lid;
			if (lid == 0) {
				int swap = b;
				b = c;
				c = swap;
			}
			if (normals == NONE)
				put("f %d %d %d\n", a, b, c);
			else
				put("f %d//%d %d//%d %d//%d\n", a, n, b, n, c, n);
		}
}

/* Normals are weighted by angles. The two triangles of a quad meet at two of its corners, so each side contributes 90
 * degrees in all there, and the normal between two sides is their mean. */
static void test_prisms_are_smoothed_by_angle(void **state)
{
	(void)state;
	for (int sides = 5; sides <= 40; sides += 7) {
		double edge = 360.0 / sides;
		char below[96], above[96];
		snprintf(below, sizeof below, "<float name='maxSmoothAngle' value='%.6f'/>", 0.99 * edge);
		snprintf(above, sizeof above, "<float name='maxSmoothAngle' value='%.6f'/>", 1.01 * edge);
		struct built_shape smooth, as_written;
		put_prism(sides, NONE);
		smooth = build_ok(below);
		put_prism(sides, FLAT);
		as_written = build_ok("");
		expect_same_corners(&smooth, &as_written);
		put_prism(sides, NONE);
		smooth = build_ok(above);
		put_prism(sides, ROUND);
		as_written = build_ok("");
		expect_same_corners(&smooth, &as_written);
		/* Normals in the file are ignored. */
		put_prism(sides, FLAT);
		smooth = build_ok(above);
		put_prism(sides, ROUND);
		as_written = build_ok("");
		expect_same_corners(&smooth, &as_written);
	}
}

/* Smooth across all edges, which gives the normals of a file whose corners share all vertices; and across none. */
static void test_extreme_angles_smooth_all_or_no_edges(void **state)
{
	(void)state;
	put_prism(7, NONE);
	struct built_shape all = build_ok(ANGLE(180)), shared = build_ok("");
	expect_same_corners(&all, &shared);
	struct built_shape none = build_ok(ANGLE(0));
	put_prism(7, FLAT);
	struct built_shape flat = build_ok("");
	expect_same_corners(&none, &flat);
}

/* Three faces around an edge, each at 40 degrees to the one before: the first is grouped with the second, and the third
 * remains. */
static void test_faces_are_grouped_in_order(void **state)
{
	(void)state;
	used = 0;
	put("v 0 0 0\nv 0 0 1\n");
	double third[3];
	for (int i = 0; i < 3; i++) {
		double a = M_PI / 180 * (90 + 40 * i);
		put("v %.17g %.17g 0.5\n", cos(a), sin(a));
		third[i] = a - M_PI / 2;
	}
	put("f 1 3 2\nf 1 4 2\nf 1 5 2\n");
	struct built_shape b = build_ok(ANGLE(50));
	const struct mesh *m = &b.geometry.mesh;
	for (int i = 0; i < 3; i++) {
		double wanted = i < 2 ? 0.5 * (third[0] + third[1]) : third[2];
		const double *n = m->normal[m->index[i][0]];
		double cosine = fabs(n[0] * cos(wanted) + n[1] * sin(wanted));
		if (!(fabs(cosine - 1) < 1e-12))
			fail_msg("face %d: normal %g %g %g", i, n[0], n[1], n[2]);
	}
	assert_int_equal(m->vertex_count, 2 + 2 + 3); /* two on the edge for the first two faces, two for the third */
	built_shape_fini(&b);
}

/* Edges with different texture coordinates are not smooth, as in Mitsuba. */
static void test_texture_seams_are_not_smoothed(void **state)
{
	(void)state;
	used = 0;
	put("v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0.2\nvt 0 0\nvt 1 0\nvt 0 1\n");
	put("f 1/1 3/2 2/3\nf 1/2 2/3 4/1\n");
	struct built_shape b = build_ok(ANGLE(90));
	const struct mesh *m = &b.geometry.mesh;
	assert_true(m->index[0][0] != m->index[1][0]);
	assert_int_equal(m->index[0][2], m->index[1][1]);
	assert_true(m->normal[m->index[0][0]][2] == 1);
	built_shape_fini(&b);
}

/* Nor are edges with different colours; each corner and each triangle keeps its attributes. */
static void test_edges_of_different_colours_are_not_smoothed(void **state)
{
	(void)state;
	static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
				  "property float z\nproperty float r\nproperty float g\nproperty float b\n"
				  "element face 2\nproperty list uchar int vertex_indices\nproperty float face_heat\n"
				  "end_header\n0 0 0 1 0 0\n0 1 0 0.5 0.5 0\n1 0 0 0 1 0\n-1 0 0.2 0 0 1\n0 0 0 0 1 1\n"
				  "3 0 2 1 7\n3 4 1 3 9\n";
	const char *xml = "<scene version='0.6.0'><shape type='ply'><string name='filename' value='m.ply'/>" ANGLE(
		90) "</shape></scene>";
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"m.ply", ply, sizeof ply - 1}, {0}};
	struct asset_source assets = memory_assets(files);
	struct built_shape b = {0};
	uint64_t dropped;
	assert_int_equal(scene_read(&b.scene, &assets, "s.xml", scene_tables(), NULL, 0, &b.error), 0);
	assert_int_equal(shape_build(b.scene.objects[0], &assets, &b.arena, &b.geometry, &dropped, &b.error), 0);
	const struct mesh *m = &b.geometry.mesh;
	assert_int_equal(m->vertex_count, 5);
	assert_int_equal(m->index[0][2], m->index[1][1]); /* one colour at y = 1 */
	assert_true(m->index[0][0] != m->index[1][0]);	  /* two colours at x = y = 0 */
	assert_int_equal(m->attribute_count, 2);
	for (uint32_t i = 0; i < m->attribute_count; i++) {
		const struct attribute *a = &m->attributes[i];
		if (a->is_per_face) {
			assert_true(a->value[0] == 7 && a->value[1] == 9);
			continue;
		}
		const float *first = a->value + (size_t)m->index[0][0] * a->channels,
			    *second = a->value + (size_t)m->index[1][0] * a->channels,
			    *both = a->value + (size_t)m->index[1][1] * a->channels;
		assert_true(first[0] == 1 && first[1] == 0 && second[1] == 1 && second[2] == 1 && both[0] == 0.5f);
	}
	built_shape_fini(&b);
}

static void expect_refused(const char *content, const char *sentence)
{
	struct built_shape b = build(content);
	if (b.result >= 0 || !strstr(b.error.text, sentence))
		fail_msg("%s gave %d: %s", content, b.result, b.error.text);
	built_shape_fini(&b);
}

static void test_invalid_smoothing_is_refused(void **state)
{
	(void)state;
	put_prism(5, NONE);
	expect_refused(ANGLE(181), "maxSmoothAngle=181 is outside [0, 180]");
	expect_refused(ANGLE(30) "<boolean name='faceNormals' value='true'/>",
		       "max_smooth_angle and face_normals contradict each other");
	/* 40,000 triangles with different directions around a point */
	used = 0;
	put("v 0 0 0\n");
	for (int i = 0; i <= 40000; i++)
		put("v %.9g %.9g %.9g\n", cos(1e-4 * i), sin(1e-4 * i), 0.3 + 1e-9 * i * i);
	for (int i = 0; i < 40000; i++)
		put("f 1 %d %d\n", i + 2, i + 3);
	expect_refused(ANGLE(0), "too many triangles with different directions meet at one point");
	struct built_shape b = build_ok(ANGLE(30));
	built_shape_fini(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_prisms_are_smoothed_by_angle),
		cmocka_unit_test(test_extreme_angles_smooth_all_or_no_edges),
		cmocka_unit_test(test_faces_are_grouped_in_order),
		cmocka_unit_test(test_texture_seams_are_not_smoothed),
		cmocka_unit_test(test_edges_of_different_colours_are_not_smoothed),
		cmocka_unit_test(test_invalid_smoothing_is_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
