/* SPDX-License-Identifier: Apache-2.0 */
/*
 * PLY and serialized meshes: every layout of the same solid gives the same mesh; any prefix of a file, and any file
 * with damaged bytes, gives a mesh or an error.
 */
#include "tests/support/built_shape.h"
#include "tests/support/dice.h"
#include "tests/support/mesh_files.h"
#include "tests/support/scene_tables.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct built_shape build(const char *type, const char *content, const void *bytes, size_t size)
{
	char xml[1024];
	snprintf(xml, sizeof xml,
		 "<scene version='3.0.0'>\n<shape type='%s'><string name='filename' value='m'/>%s</shape></scene>",
		 type, content);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"m", bytes, size}, {0}};
	return built_shape_make(files, scene_tables());
}

/* Every vertex is at its position, in the order of the file; values are exact as floats. */
static void assert_solid(const char *type, const char *content, const struct mesh_file *f, double scale, bool normals,
			 bool uv, bool flip)
{
	struct built_shape b = build(type, content, f->bytes, f->size);
	if (b.result)
		fail_msg("%s", b.error.text);
	const struct mesh *m = &b.geometry.mesh;
	assert_int_equal(m->vertex_count, SOLID_VERTICES);
	assert_int_equal(m->triangle_count, SOLID_TRIANGLES);
	assert_memory_equal(m->index, solid_index, sizeof solid_index);
	assert_true((m->normal != NULL) == normals);
	assert_true((m->uv != NULL) == uv);
	for (int i = 0; i < SOLID_VERTICES; i++) {
		for (int k = 0; k < 3; k++) {
			assert_true(m->position[i][k] == scale * solid_position[i][k]);
			assert_true(!normals || fabs(m->normal[i][k] - solid_position[i][k]) < 1e-15);
		}
		if (uv)
			assert_true(m->uv[i][0] == solid_uv[i][0] &&
				    m->uv[i][1] == (flip ? 1 - solid_uv[i][1] : solid_uv[i][1]));
	}
	built_shape_fini(&b);
}

/* Makes lines end in a carriage return alone, as Rhino writes them. */
static void use_carriage_returns(struct mesh_file *f)
{
	const char *last = "end_header\n";
	for (size_t i = 0, stop = f->size; i < stop; i++) {
		if (f->size - i >= strlen(last) && memcmp(f->bytes + i, last, strlen(last)) == 0)
			stop = i + strlen(last);
		if (f->bytes[i] == '\n')
			f->bytes[i] = '\r';
	}
}

static void test_ply_is_read_in_every_format(void **state)
{
	(void)state;
	static struct mesh_file f;
	for (enum ply_kind k = 0; k < PLY_KINDS; k++) {
		mesh_file_make_ply(&f, k);
		use_carriage_returns(&f);
		assert_solid("ply", "", &f, 1, true, true, false);
		mesh_file_make_ply(&f, k);
		assert_solid("ply", "", &f, 1, true, true, false);
		assert_solid("ply", "<boolean name='flip_tex_coords' value='true'/>", &f, 1, true, true, true);
		assert_solid("ply", "<boolean name='face_normals' value='true'/>", &f, 1, false, true, false);
	}
}

#define HEAD "ply\nformat ascii 1.0\n"
#define QUAD HEAD "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"

static void test_ply_polygons_become_triangles(void **state)
{
	(void)state;
	/* Faces before vertices, carriage returns, a polygon of four, no normals. */
	const char *text =
		"ply\r\nformat ascii 1.0\r\nelement face 1\r\nproperty list uchar int vertex_index\r\nelement vertex 4\r\n"
		"property float x\r\nproperty float y\r\nproperty float z\r\nend_header\r\n4 0 1 2 3\r\n"
		"0 0 0\r\n1 0 0\r\n1 1 0\r\n0 1 0";
	struct built_shape b = build("ply", "", text, strlen(text));
	if (b.result)
		fail_msg("%s", b.error.text);
	const uint32_t fan[2][3] = {{0, 1, 2}, {0, 2, 3}};
	assert_int_equal(b.geometry.mesh.triangle_count, 2);
	assert_memory_equal(b.geometry.mesh.index, fan, sizeof fan);
	assert_true(b.geometry.mesh.normal && b.geometry.mesh.normal[0][2] == 1);
	assert_null(b.geometry.mesh.uv);
	built_shape_fini(&b);
}

/* Points and lines written as faces become triangles without area; the other faces keep their colours. */
static void test_ply_lines_are_dropped(void **state)
{
	(void)state;
	const char *text =
		"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
		"element face 4\nproperty list uchar int vertex_indices\nproperty float r\nproperty float g\n"
		"property float b\nend_header\n0 0 0\n1 0 0\n1 1 0\n"
		"1 0 .1 .1 .1\n3 0 1 2 .25 .5 .75\n2 0 1 .2 .2 .2\n3 2 1 0 .75 .5 .25\n";
	struct built_shape b = build("ply", "", text, strlen(text));
	if (b.result)
		fail_msg("%s", b.error.text);
	const uint32_t index[2][3] = {{0, 1, 2}, {2, 1, 0}};
	assert_int_equal(b.geometry.mesh.triangle_count, 2);
	assert_int_equal(b.dropped_triangles, 2);
	assert_memory_equal(b.geometry.mesh.index, index, sizeof index);
	assert_int_equal(b.geometry.mesh.attribute_count, 1);
	const float colours[] = {.25F, .5F, .75F, .75F, .5F, .25F};
	assert_memory_equal(b.geometry.mesh.attributes[0].value, colours, sizeof colours);
	built_shape_fini(&b);
}

/* An arrow head, whose fan around the first corner would contain a reversed triangle. */
#define ARROW "-1 -1 0\n0 0.5 0\n1 -1 0\n0 1 0\n"
static void test_concave_faces_are_triangulated(void **state)
{
	(void)state;
	static const struct {
		const char *type, *text;
	} files[] = {
		{"ply", HEAD "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
			     "property list uchar int vertex_index\nend_header\n" ARROW "4 0 1 2 3\n"},
		{"ply",
		 HEAD "element face 1\nproperty list uchar int vertex_index\nelement vertex 4\nproperty float x\n"
		      "property float y\nproperty float z\nend_header\n4 0 1 2 3\n" ARROW},
		{"obj", "v 9 9 9\nv -1 -1 0\nv 0 0.5 0\nv 1 -1 0\nv 0 1 0\nf 2 3 4\nf 2 3 4 5\n"},
	};
	for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
		struct built_shape b = build(files[i].type, "", files[i].text, strlen(files[i].text));
		if (b.result)
			fail_msg("%s", b.error.text);
		const struct mesh *m = &b.geometry.mesh;
		uint32_t first = m->triangle_count - 2;
		double sum = 0;
		for (uint32_t t = first; t < first + 2; t++) {
			vec3 p[3];
			for (int k = 0; k < 3; k++)
				p[k] = vec3_load(m->position[m->index[t][k]]);
			double z = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0])).z;
			assert_true(z > 0);
			sum += z / 2;
		}
		assert_true(fabs(sum - 0.5) < 1e-6);
		built_shape_fini(&b);
	}
}

static void test_serialized_is_read_in_every_version(void **state)
{
	(void)state;
	static struct mesh_file f;
	for (int version = 3; version <= 5; version++)
		for (int doubles = 0; doubles < (version == 5 ? 1 : 2); doubles++)
			for (uint32_t flags = 0; flags < 16; flags++) {
				if (flags & 4)
					continue; /* tangents were never written */
				mesh_file_make_serialized(&f, version, doubles, flags, 3);
				/* Missing normals are computed from the triangles: by symmetry, that of a corner has
				 * the direction of its position. */
				assert_solid("serialized", "", &f, 1, true, flags & 2, false);
				assert_solid("serialized", "<integer name='shape_index' value='2'/>", &f, 3, true,
					     flags & 2, false);
			}
	for (int version = 4; version <= 5; version++) {
		mesh_file_make_serialized(&f, version, 0, 1 | 16, 1);
		assert_solid("serialized", "", &f, 1, false, false, false);
	}
}

/* Version 5 has named attributes, of which the one with spectral coefficients is left out. */
static void test_serialized_attributes_are_read(void **state)
{
	(void)state;
	static struct mesh_file f;
	mesh_file_make_serialized(&f, 5, 0, 11, 1);
	struct built_shape b = build("serialized", "", f.bytes, f.size);
	if (b.result)
		fail_msg("%s", b.error.text);
	const struct mesh *m = &b.geometry.mesh;
	assert_int_equal(m->attribute_count, 2);
	const struct attribute *colour = &m->attributes[0], *heat = &m->attributes[1];
	assert_string_equal(colour->name, "vertex_color");
	assert_true(colour->channels == 3 && !colour->is_per_face && !colour->is_srgb && !colour->has_invalid_value);
	for (int i = 0; i < 3 * SOLID_VERTICES; i++)
		assert_true(colour->value[i] == (float)SOLID_COLOUR(i));
	assert_string_equal(heat->name, "face_heat");
	assert_true(heat->channels == 1 && heat->is_per_face);
	for (int i = 0; i < SOLID_TRIANGLES; i++)
		assert_true(heat->value[i] == (float)SOLID_COLOUR(i));
	built_shape_fini(&b);
}

static void expect_refused(const char *type, const char *content, const void *bytes, size_t size, const char *text)
{
	struct built_shape b = build(type, content, bytes, size);
	if (b.result >= 0 || !strstr(b.error.text, text))
		fail_msg("%d: %s\n not: %s", b.result, b.error.text, text);
	built_shape_fini(&b);
}

static void test_invalid_ply_is_refused(void **state)
{
	(void)state;
	static const struct {
		const char *text, *error;
	} cases[] = {
		{"", "m:1: this is not a PLY file"},
		{"plyx\n", "this is not a PLY file"},
		{"ply\n", "the header does not end"},
		{"ply\nformat binary 1.0\n", "m:2: the format is neither"},
		{"ply\nelement vertex -1\nend_header\n", "m:2: an element needs a name and a count"},
		{"ply\nproperty float x\nend_header\n", "m:2: a property before any element"},
		{HEAD "element vertex 1\nproperty half x\nend_header\n", "m:4: a property of an unknown type"},
		{HEAD "element vertex 1\nproperty list float int x\nend_header\n", "a property of an unknown type"},
		{HEAD "element vertex 1\nproperty float\nend_header\n", "a property without a name"},
		{HEAD "element vertex 1\nelement vertex 1\nend_header\n", "an element is given twice"},
		{HEAD "what\nend_header\n", "m:3: neither comment"},
		{"ply\nelement vertex 1\nproperty float x\nend_header\n1", "names no format"},
		{HEAD "end_header\n", "m: has no vertices with x, y and z"},
		{QUAD "element strip 1\nproperty int n\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 1", "has no faces"},
		{QUAD "element face 1\nproperty list uchar float vertex_indices\nend_header\n",
		 "indices must be whole numbers"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 4",
		 "m: face 0: an index out of range"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 -1",
		 "an index"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 0.5",
		 "an index"},
		{QUAD "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 0",
		 "m: face 0: a face without corners"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 -3 0 1 2",
		 "without a length"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 3 0 1",
		 "ends here"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 nan 1 0 0 1 1 0 0 1 0 3 0 1 2",
		 "m: vertex 0: a number that is not finite, or beyond 1e60"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 x 1 0 0 1 1 0 0 1 0 3 0 1 2",
		 "m: vertex 0: not a number"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 nan",
		 "m: face 0: not a number"},
		{QUAD
		 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 1e99 1 0 0 1 1 0 0 1 0 3 0 1 2",
		 "m: vertex 0: a number that is not finite, or beyond 1e60"},
		{HEAD
		 "element vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
		 "property list uchar int vertex_indices\nend_header\n0 0 0",
		 "too short for 4000000000 vertices"},
		{HEAD
		 "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 99999999999\n"
		 "property list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 3 0 1 2",
		 "too short for 99999999999"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		expect_refused("ply", "", cases[i].text, strlen(cases[i].text), cases[i].error);
	/* NaN, in formats that can store it. */
	static struct mesh_file f;
	mesh_file_make_ply(&f, PLY_LITTLE);
	const char *end = "end_header\n";
	size_t at = 0;
	while (memcmp(f.bytes + at, end, strlen(end)) != 0)
		at++;
	memcpy(f.bytes + at + strlen(end), "\0\0\xc0\x7f", 4);
	expect_refused("ply", "", f.bytes, f.size, "m: vertex 0: a number that is not finite");
}

/* Programs write NaN if a vertex has no triangle with an area: it counts as a missing normal. */
static void test_nan_normals_count_as_missing(void **state)
{
	(void)state;
	static const char ply[] = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
				  "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
				  "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
				  "0 0 0 nan nan -nan(ind)\n2 0 0 0 0 1\n2 2 0 -1.#IND 0 INF\n0 2 0 0 0.6 0.8\n"
				  "3 0 1 2\n3 0 2 3\n",
			  obj[] = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvn nan nan -nan(ind)\nvn 0 0 1\n"
				  "vn -1.#IND 0 INF\nvn 0 0.6 0.8\nf 1//1 2//2 3//3\nf 1//1 3//3 4//4\n";
	for (int k = 0; k < 2; k++) {
		struct built_shape b = build(k ? "obj" : "ply", "", k ? obj : ply, strlen(k ? obj : ply));
		if (b.result)
			fail_msg("%s", b.error.text);
		const struct mesh *m = &b.geometry.mesh;
		assert_int_equal(m->triangle_count, 2);
		assert_true(m->invalid_normal_count >= 2); /* an OBJ may have a vertex twice */
		for (uint32_t t = 0; t < 2; t++)
			for (int c = 0; c < 3; c++) {
				uint32_t i = m->index[t][c];
				bool leans = m->position[i][0] == 0 && m->position[i][1] == 2;
				vec3 want = leans ? (vec3){0, 0.6, 0.8} : (vec3){0, 0, 1};
				assert_true(vec3_length(vec3_sub(vec3_load(m->normal[i]), want)) < 1e-12);
			}
		built_shape_fini(&b);
	}
}

static void test_invalid_serialized_is_refused(void **state)
{
	(void)state;
	static struct mesh_file f, g;
	mesh_file_make_serialized(&f, 4, 0, 3, 2);
	expect_refused("serialized", "", "", 0, "m: this is not a serialized mesh");
	expect_refused("serialized", "", "plyplyply", 9, "this is not a serialized mesh");
	expect_refused("serialized", "<integer name='shape_index' value='2'/>", f.bytes, f.size,
		       "m: shape_index=2, but the file has 2 meshes, counted from 0");
	mesh_file_make_serialized(&g, 4, 0, 3, 1);
	expect_refused("serialized", "<integer name='shape_index' value='7'/>", g.bytes, g.size,
		       "m: shape_index=7, but the file has 1 mesh, counted from 0");
	g = f;
	g.bytes[2] = 9;
	expect_refused("serialized", "", g.bytes, g.size, "m: version 9 is not supported (supported: 3, 4, 5)");
	g = f;
	g.bytes[g.size - 1] = 0xff;
	expect_refused("serialized", "", g.bytes, g.size, "the table of meshes at its end is damaged");
	g = f;
	g.bytes[g.size - 12] ^= 1; /* the second offset */
	expect_refused("serialized", "<integer name='shape_index' value='1'/>", g.bytes, g.size,
		       "the table of meshes at its end is damaged");
	g = f;
	g.bytes[40] ^= 0x10;
	expect_refused("serialized", "", g.bytes, g.size, "m: the compressed mesh is damaged");
}

/* The corners of mesh i have x = i or 9. */
static const char obj_meshes[] = "g empty\nusemtl a\nv 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 9 1 0\nv 9 0 1\nv 9 1 1\n"
				 "f 1 5 6\nf 1 5 7 6\n"						/* 0 */
				 "g\ng again\no begins none\nf 2 5 6\no begins none\nf 2 6 5\n" /* 1 */
				 "usemtl a\nf 3 5 6\nusemtl b\ng\nusemtl c\n"			/* 2 */
				 "f 4 5 6\nf 4 5 6\nf 4 5 6\nf 4 5 6\nusemtl a\ng last\n";	/* 3 */

static void assert_obj_mesh(const char *content, double x, uint32_t triangles)
{
	struct built_shape b = build("obj", content, obj_meshes, sizeof obj_meshes - 1);
	if (b.result)
		fail_msg("%s: %s", content, b.error.text);
	const struct mesh *m = &b.geometry.mesh;
	assert_int_equal(m->triangle_count, triangles);
	for (uint32_t t = 0; t < triangles; t++)
		for (int k = 0; k < 3; k++) {
			double found = m->position[m->index[t][k]][0];
			assert_true(x < 0 || found == x || found == 9);
		}
	assert_true(x < 0 || m->vertex_count <= 4);
	built_shape_fini(&b);
}

static void test_meshes_of_an_obj_are_selected_by_index(void **state)
{
	(void)state;
	static const uint32_t triangles[] = {3, 2, 1, 4};
	for (int i = 0; i < 4; i++) {
		char content[64];
		snprintf(content, sizeof content, "<integer name='shape_index' value='%d'/>", i);
		assert_obj_mesh(content, i, triangles[i]);
	}
	assert_obj_mesh("", -1, 10);
	assert_obj_mesh("<integer name='shape_index' value='-1'/>", -1, 10);
	assert_obj_mesh("<string name='material' value='a'/>", -1, 6);
	assert_obj_mesh("<integer name='shape_index' value='2'/><string name='material' value='a'/>", 2, 1);
	expect_refused("obj", "<integer name='shape_index' value='4'/>", obj_meshes, sizeof obj_meshes - 1,
		       "m: shape_index=4, but the file has 4 meshes, counted from 0");
	expect_refused("obj", "<integer name='shape_index' value='3'/><string name='material' value='a'/>", obj_meshes,
		       sizeof obj_meshes - 1, "m: mesh 3 has no faces of the material `a`");
	static const char one[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
	expect_refused("obj", "<integer name='shape_index' value='1'/>", one, sizeof one - 1,
		       "m: shape_index=1, but the file has 1 mesh, counted from 0");
	expect_refused("obj", "<integer name='shape_index' value='0'/>", one, 24,
		       "m: shape_index=0, but the file has 0 meshes");
}

/* Returns whether a file gives a mesh, whose indices must be in range, rather than an error. */
static bool is_read_as_valid_mesh(const char *type, const struct mesh_file *f)
{
	struct built_shape b = build(type, "", f->bytes, f->size);
	bool good = b.result == 0;
	assert_true(b.result <= 0);
	for (uint32_t k = 0; good && k < 3 * b.geometry.mesh.triangle_count; k++)
		assert_true(b.geometry.mesh.index[k / 3][k % 3] < b.geometry.mesh.vertex_count);
	built_shape_fini(&b);
	return good;
}

/* Each number of version 5 that can be wrong in a stream with a valid checksum. */
static void test_invalid_numbers_of_version_5_are_refused(void **state)
{
	(void)state;
	enum { RECORDS = 47, FACES = RECORDS + 32 * SOLID_VERTICES, ATTRIBUTES = FACES + 16 * SOLID_TRIANGLES + 48 };
	static const struct {
		size_t at;
		uint32_t value;
		const char *text;
	} bad[] = {
		{0, 0x1007, "m: shading tangents are not supported"},
		{0, 0x0005, "m: the header of the mesh is damaged"},
		{4, 1 << 30, "m: a name that is too long"},
		{15, 0, "m: the header of the mesh is damaged"}, /* no vertices, but places */
		{19, 1, "m: more vertices or triangles than the file can contain"},
		{27, 1, "m: more vertices or triangles than the file can contain"},
		{31, 7, "m: the header of the mesh is damaged"},
		{39, 7, "m: the header of the mesh is damaged"},
		{RECORDS, 0x7f800000, "m: a number that is not finite, or beyond 1e60"},
		{RECORDS + 28, 0x7fc00000, "m: a number that is not finite, or beyond 1e60"},
		{FACES, SOLID_VERTICES, "m: a triangle's index is out of range"},
		{FACES + 12, 1, "m: a mesh with several BSDFs is not supported"},
		{ATTRIBUTES, 65, "m: more than 64 attributes"},
		{ATTRIBUTES, 4, "m: the compressed mesh is damaged or ends too early"},
		{ATTRIBUTES + 4, 200, "m: a name that is too long"},
		{ATTRIBUTES + 8, 0, "m: an attribute that is neither of vertices nor of faces"},
		{ATTRIBUTES + 21, 5, "m: an attribute with more numbers than the file can contain"},
		{ATTRIBUTES + 21, 0, "m: an attribute with more numbers than the file can contain"},
	};
	static struct mesh_file f, good, g;
	mesh_file_make_stream_5(&good, 11, 1);
	mesh_file_from_stream_5(&f, &good);
	assert_solid("serialized", "", &f, 1, true, true, false);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		g = good;
		for (int k = 0; k < 4; k++)
			g.bytes[bad[i].at + (size_t)k] = (unsigned char)(bad[i].value >> 8 * k);
		mesh_file_from_stream_5(&f, &g);
		expect_refused("serialized", "", f.bytes, f.size, bad[i].text);
	}
	/* Any prefix of the uncompressed data, and any of its bytes changed. */
	struct dice d = dice_for_test("damaged streams");
	for (size_t i = 0; i < 3000; i++) {
		g = good;
		if (i < good.size)
			g.size = i;
		else
			g.bytes[dice_below(&d, (uint32_t)g.size)] = (unsigned char)dice_below(&d, 256);
		mesh_file_from_stream_5(&f, &g);
		assert_true(!is_read_as_valid_mesh("serialized", &f) || i >= good.size);
	}
}

/* Any prefix, and any file with some bytes changed, gives a mesh or an error; sanitizers detect anything else. */
static void test_damaged_files_are_read_or_refused(void **state)
{
	(void)state;
	static struct mesh_file f, g;
	for (int kind = 0; kind < PLY_KINDS + 3; kind++) {
		const char *type = kind < PLY_KINDS ? "ply" : "serialized";
		if (kind < PLY_KINDS)
			mesh_file_make_ply(&f, (enum ply_kind)kind);
		else
			mesh_file_make_serialized(&f, kind - PLY_KINDS + 3, 0, 11, 2);
		struct dice d = dice_for_test("damaged meshes");
		size_t meshes = 0;
		for (size_t size = 0; size < f.size; size += 1 + size / 97) {
			struct built_shape b = build(type, "", f.bytes, size);
			assert_true(b.result <= 0);
			built_shape_fini(&b);
		}
		for (int i = 0; i < 300; i++) {
			g = f;
			for (uint32_t n = 1 + (uint32_t)dice_below(&d, 3); n > 0; n--)
				g.bytes[dice_below(&d, (uint32_t)g.size)] = (unsigned char)dice_below(&d, 256);
			meshes += is_read_as_valid_mesh(type, &g);
		}
		assert_true(meshes > 0 || kind >= PLY_KINDS);
	}
}

static void test_failed_allocations_are_reported(void **state)
{
	(void)state;
	static struct mesh_file f;
	for (int kind = 0; kind < 2; kind++) {
		if (kind)
			mesh_file_make_serialized(&f, 4, 0, 0, 1);
		else
			mesh_file_make_ply(&f, PLY_LITTLE);
		struct built_shape b = build(kind ? "serialized" : "ply", "", f.bytes, f.size);
		const struct memory_file files[] = {{"m", f.bytes, f.size}, {0}};
		built_shape_check_out_of_memory(&b.scene, files, 1);
		built_shape_fini(&b);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_ply_is_read_in_every_format),
		cmocka_unit_test(test_ply_polygons_become_triangles),
		cmocka_unit_test(test_ply_lines_are_dropped),
		cmocka_unit_test(test_concave_faces_are_triangulated),
		cmocka_unit_test(test_serialized_is_read_in_every_version),
		cmocka_unit_test(test_serialized_attributes_are_read),
		cmocka_unit_test(test_meshes_of_an_obj_are_selected_by_index),
		cmocka_unit_test(test_invalid_ply_is_refused),
		cmocka_unit_test(test_nan_normals_count_as_missing),
		cmocka_unit_test(test_invalid_serialized_is_refused),
		cmocka_unit_test(test_invalid_numbers_of_version_5_are_refused),
		cmocka_unit_test(test_damaged_files_are_read_or_refused),
		cmocka_unit_test(test_failed_allocations_are_reported),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
