/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes without any surface are left out and counted, whatever their format, together with their emitters; the other
 * shapes keep their materials and lights. Files that are not meshes remain errors.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <zlib.h>

#include <cmocka.h>

#define VIEW SENSOR("0,0,4", "0,0,0")
#define LAMP "<emitter type='area'/>"
#define FILE_OF(type, name, inside) \
	"<shape type='" type "'><string name='filename' value='" name "'/>" inside "</shape>"
#define PLY_HEAD "ply\nformat ascii 1.0\n"
#define PLY_VERTICES "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
#define PLY_FACES(count) "element face " count "\nproperty list uchar int vertex_indices\n"
#define PLY_POINTS "0 0 0\n1 0 0\n0 1 0\n"

static const char points_obj[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
		  faceless_ply[] = PLY_HEAD PLY_VERTICES PLY_FACES("0") "end_header\n" PLY_POINTS,
		  cloud_ply[] = PLY_HEAD PLY_VERTICES "end_header\n" PLY_POINTS,
		  empty_ply[] =
			  PLY_HEAD "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n" PLY_FACES(
				  "0") "end_header\n",
		  /* each is also too small for a world that contains the others */
	small_obj[3][80] = {"v 1 1 1\nv 1.000000001 1 1\nv 1 1.000000001 1\nf 1 2 3\n",
			    "v -1 0.7 0.3\nv -1.000000001 0.7 0.3\nv -1 0.700000001 0.3\nf 1 2 3\n",
			    "v 0.3 -1 0.1\nv 0.300000001 -1 0.1\nv 0.3 -1.000000001 0.1\nf 1 2 3\n"};

/* Writes a .serialized file of version 4 with the given number of vertices and no triangles; returns its size. */
static size_t write_faceless_serialized(unsigned char *file, size_t capacity, unsigned vertices)
{
	unsigned char raw[64] = {0x00, 0x10, 0, 0, 'm', 0};
	raw[6] = (unsigned char)vertices;
	unsigned long size = capacity - 4;
	assert_int_equal(compress(file + 4, &size, raw, 22 + 12UL * vertices), Z_OK);
	memcpy(file, (unsigned char[4]){0x1c, 0x04, 4, 0}, 4);
	memset(file + 4 + size, 0, 12);
	file[4 + size + 8] = 1;
	return 4 + size + 12;
}

static struct world *world_with(const char *body)
{
	static char xml[4096];
	static unsigned char serialized[2][256];
	const size_t size[2] = {write_faceless_serialized(serialized[0], 200, 3),
				write_faceless_serialized(serialized[1], 200, 0)};
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>" VIEW "%s</scene>", body);
	const struct memory_file files[] = {{"scene.xml", xml, strlen(xml)},
					    {"points.obj", points_obj, strlen(points_obj)},
					    {"faceless.ply", faceless_ply, strlen(faceless_ply)},
					    {"cloud.ply", cloud_ply, strlen(cloud_ply)},
					    {"empty.ply", empty_ply, strlen(empty_ply)},
					    {"faceless.serialized", serialized[0], size[0]},
					    {"empty.serialized", serialized[1], size[1]},
					    {"small0.obj", small_obj[0], strlen(small_obj[0])},
					    {"small1.obj", small_obj[1], strlen(small_obj[1])},
					    {"small2.obj", small_obj[2], strlen(small_obj[2])},
					    {NULL, NULL, 0}};
	return world_from_files(8, 8, files);
}

static void test_meshes_without_triangles_are_left_out(void **state)
{
	(void)state;
	static const char *const alone[] = {
		FILE_OF("obj", "points.obj", ""),
		FILE_OF("ply", "faceless.ply", ""),
		FILE_OF("ply", "cloud.ply", ""),
		FILE_OF("ply", "empty.ply", ""),
		FILE_OF("serialized", "faceless.serialized", ""),
		FILE_OF("serialized", "empty.serialized", ""),
		FILE_OF("obj", "points.obj", "<float name='max_smooth_angle' value='30'/>"),
		FILE_OF("ply", "faceless.ply", "<boolean name='flip_normals' value='true'/>"),
	};
	for (size_t i = 0; i < sizeof alone / sizeof *alone; i++) {
		char body[512];
		snprintf(body, sizeof body, "<emitter type='constant'/>%s<shape type='sphere'/>", alone[i]);
		struct world *w = world_with(body);
		if (w->shape_count != 1 || !w->shapes[0].is_sphere ||
		    !strstr(w->notes.empty_meshes, "1 mesh without triangles is left out (first: the "))
			fail_msg("%s: %u shapes, \"%s\"", alone[i], w->shape_count, w->notes.empty_meshes);
		assert_string_equal(w->notes.no_light, "");
		world_free(w);
	}
	struct world *w = world_with("<shape type='sphere'/>" FILE_OF("obj", "points.obj", LAMP)
					     FILE_OF("ply", "faceless.ply", ""));
	assert_string_equal(w->notes.empty_meshes,
			    "2 meshes without triangles are left out (first: the obj in scene.xml:1)");
	assert_string_equal(w->notes.no_light, "the scene has no emitter with an area: the image is black");
	world_free(w);
}

/* Normals that are not finite are counted, in files of all meshes. */
static void test_invalid_normals_are_counted(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'><emitter type='constant'/>" FILE_OF(
		"obj", "a.obj", "") "\n" FILE_OF("obj", "b.obj", "") FILE_OF("obj", "a.obj", "") "</scene>",
			  odd[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn nan 0 0\nvn 0 0 1\nf 1//1 2//2 3//1\n",
			  even[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n";
	const struct memory_file files[] = {{"scene.xml", xml, sizeof xml - 1},
					    {"a.obj", odd, sizeof odd - 1},
					    {"b.obj", even, sizeof even - 1},
					    {NULL, NULL, 0}};
	struct world *w = world_from_files(8, 8, files);
	assert_string_equal(
		w->notes.bad_normals,
		"4 normals in 2 meshes (first: the obj in scene.xml:1) are not finite and count as missing");
	world_free(w);
	w = world_with("<emitter type='constant'/><shape type='sphere'/>");
	assert_string_equal(w->notes.bad_normals, "");
	world_free(w);
}

/* The glTF specification forbids such meshes, but some exporters write them: here with 0 indices. */
static void test_gltf_meshes_without_triangles_are_left_out(void **state)
{
	(void)state;
	static const char text[] =
		"{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"mesh\""
		":0},{\"mesh\":1}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":"
		"2}]},{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],\"accessors\":[{\""
		"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":["
		"1,1,0]},{\"bufferView\":1,\"componentType\":5123,\"count\":0,\"byteOffset\":0,\"type\":\"SC"
		"ALAR\"},{\"bufferView\":1,\"componentType\":5123,\"count\":3,\"type\":\"SCALAR\"}],\"bufferV"
		"iews\":[{\"buffer\":0,\"byteOffset\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,\""
		"byteLength\":12}],\"buffers\":[{\"byteLength\":48,\"uri\":\"data:application/octet-strea"
		"m;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAAAAAEA\"}]}";
	const struct memory_file files[] = {{"scene.gltf", text, strlen(text)}, {NULL, NULL, 0}};
	struct world *w = world_from_files(8, 8, files);
	assert_int_equal(w->shape_count, 1);
	assert_non_null(strstr(w->notes.empty_meshes, "1 mesh without triangles is left out (first: "));
	world_free(w);
}

/* Three shapes, and four that are too small for a world that contains the former: the four are left out. */
static void test_too_small_shapes_are_left_out(void **state)
{
	(void)state;
	struct world *w =
		world_with("<bsdf type='diffuse' id='d'/>" FILE_OF(
			"obj", "small0.obj", LAMP) "<shape type='sphere'>" LAMP "</shape>" FILE_OF("obj", "small1.obj",
												   "")
				   FILE_OF("obj", "small2.obj",
					   "") "<shape type='cube'>"
					       "<ref id='d'/></shape>" FILE_OF(
						       "obj", "small2.obj",
						       "") "<shape type='disk'><bsdf type='conductor'/></shape>");
	assert_int_equal(w->shape_count, 3);
	assert_true(w->shapes[0].is_sphere && w->shape_bindings[0].emitter >= 0 && w->emitter_count == 1);
	assert_int_equal(w->shapes[1].triangle_count, 12);
	assert_true(w->shape_bindings[1].emitter < 0 && w->shape_bindings[2].emitter < 0);
	assert_true(w->bsdfs[w->shape_bindings[2].bsdf].has_delta && !w->bsdfs[w->shape_bindings[1].bsdf].has_delta);
	assert_string_equal(
		w->notes.tiny_shapes,
		"4 shapes too small for the scene to have an area are left out (first: the obj in scene.xml:1)");
	assert_string_equal(w->notes.no_light, "");
	world_free(w);
	w = world_with(FILE_OF("obj", "small0.obj", LAMP) "<shape type='sphere'/>" FILE_OF("obj", "small1.obj", LAMP)
			       FILE_OF("obj", "small2.obj", LAMP));
	assert_int_equal(w->shape_count, 1);
	assert_string_equal(w->notes.no_light, "the scene has no emitter with an area: the image is black");
	world_free(w);
}

/* Shapes flattened by their transform are left out with `lenient` only; the remaining shapes of a group and its
 * instances are kept. */
static void test_flattened_shapes_are_left_out_if_lenient(void **state)
{
	(void)state;
#define FLAT "<transform name='to_world'><scale x='0'/></transform>"
	static const char xml[] =
		"<scene version='3.0.0'>" VIEW "\n<shape type='rectangle' id='r'>" FLAT LAMP "</shape>"
		"<shape type='shapegroup' id='g'><shape type='cube'>" FLAT "</shape><shape type='disk'/></shape>"
		"<shape type='instance'><ref id='g'/>" FLAT
		"</shape><shape type='instance'><ref id='g'/></shape></scene>";
	const struct memory_file files[] = {{"scene.xml", xml, strlen(xml)}, {NULL, NULL, 0}};
	const struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	world_check_files_refused(files,
				  "to_world flattens the shape (it has no inverse): line 2; --lenient leaves it out");
	if (scene_read_lenient(&s, &assets, "scene.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	assert_true(scene_has_note(&s,
				   "3 shapes that to_world flattens (it has no inverse) are left out (lenient; first: "
				   "the rectangle in scene.xml:2)"));
	assert_true(scene_has_note(&s, "the scene has no emitter: the image is black"));
	unsigned instances = 0;
	for (uint32_t i = 0; i < s.object_count; i++) {
		assert_false(strcmp(s.objects[i]->type, "rectangle") == 0);
		instances += strcmp(s.objects[i]->type, "instance") == 0;
		if (strcmp(s.objects[i]->type, "shapegroup") == 0)
			assert_int_equal(s.objects[i]->child_count, 1);
	}
	assert_int_equal(instances, 1);
	scene_fini(&s);
}

static void test_files_without_meshes_are_refused(void **state)
{
	(void)state;
	static const struct {
		const char *type, *text, *why;
	} cases[] = {
		{"obj", "", "has no vertices and no faces"},
		{"obj", "<html>not found</html>\n", "has no vertices and no faces"},
		{"ply", PLY_HEAD PLY_VERTICES "element tristrips 1\nproperty list int int vertex_indices\nend_header\n",
		 "has no faces with vertex_indices"},
		{"ply", PLY_HEAD PLY_FACES("0") "end_header\n", "has no vertices with x, y and z"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[1024];
		snprintf(xml, sizeof xml,
			 "<scene version='3.0.0'>" VIEW "<shape type='%s'><string name='filename' value='m'/>"
			 "</shape></scene>",
			 cases[i].type);
		const struct memory_file files[] = {
			{"scene.xml", xml, strlen(xml)}, {"m", cases[i].text, strlen(cases[i].text)}, {NULL, NULL, 0}};
		world_check_files_refused(files, cases[i].why);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_invalid_normals_are_counted),
		cmocka_unit_test(test_meshes_without_triangles_are_left_out),
		cmocka_unit_test(test_gltf_meshes_without_triangles_are_left_out),
		cmocka_unit_test(test_too_small_shapes_are_left_out),
		cmocka_unit_test(test_flattened_shapes_are_left_out_if_lenient),
		cmocka_unit_test(test_files_without_meshes_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
