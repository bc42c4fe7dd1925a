/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Attributes of meshes (colours and numbers of vertices and faces) as read from PLY, serialized and OBJ files: their
 * names, whether integers are sRGB, the order of vertices and faces, and files that would make far more numbers than
 * they have bytes.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/mesh_files.h"
#include "tests/support/scene_tables.h"
#include "worker/render/image/srgb.h"
#include "worker/render/shape/attribute_names.h"
#include "worker/render/shape/mesh.h"
#include "worker/render/shape/shape.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_attribute_names_are_grouped(void **state)
{
	(void)state;
	/* Properties, the group and channel of each, and the resulting groups. */
	static const struct {
		const char *properties, *groups;
	} cases[] = {
		{"r g b", "vertex_color 3"},
		{"red green blue alpha", "vertex_color 4"},
		{"r heat g b", "vertex_color 3, vertex_heat 1"},
		{"r g", ""},
		{"diffuse_red diffuse_green diffuse_blue", "vertex_color 3"},
		{"foo_x foo_y foo_z", "vertex_foo 3"},
		{"foo_0 foo_1 bar_0", "vertex_foo 2, vertex_bar 1"},
		{"foo_1 foo_2 foo_3 foo_4 foo_5", "vertex_foo 4, vertex_foo_5 1"},
		{"foo_r foo_g foo_b foo_a", "vertex_foo 4"},
		{"foo_r foo_y", "vertex_foo 1, vertex_foo_y 1"},
		{"foo_x heat foo_y", "vertex_foo 1, vertex_heat 1, vertex_foo_y 1"},
		{"vertex_heat vertex_c_r vertex_c_g vertex_c_b", "vertex_heat 1, vertex_c 3"},
		{"quality", "vertex_quality 1"},
	};
	for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
		struct attribute_groups g = attribute_groups_make("vertex_");
		char words[256], found[256] = "", *save;
		snprintf(words, sizeof words, "%s", cases[c].properties);
		for (char *w = strtok_r(words, " ", &save); w; w = strtok_r(NULL, " ", &save)) {
			uint32_t group, channel;
			assert_true(attribute_groups_add(&g, w, &group, &channel));
			assert_true(group < g.count && channel < ATTRIBUTE_CHANNELS_MAX);
		}
		for (uint32_t i = 0; i < g.count; i++) {
			uint32_t n = attribute_group_channel_count(&g.groups[i]);
			size_t used = strlen(found);
			if (n)
				snprintf(found + used, sizeof found - used, "%s%s %u", used ? ", " : "",
					 g.groups[i].name, n);
		}
		if (strcmp(found, cases[c].groups) != 0)
			fail_msg("%s: %s, not %s", cases[c].properties, found, cases[c].groups);
	}
	struct attribute_groups g = attribute_groups_make("face_");
	uint32_t group, channel;
	for (int i = 0; i < ATTRIBUTE_GROUPS_MAX; i++) {
		char name[32];
		snprintf(name, sizeof name, "p%d", i);
		assert_true(attribute_groups_add(&g, name, &group, &channel));
	}
	assert_false(attribute_groups_add(&g, "more", &group, &channel));
	assert_false(attribute_groups_add(&g, "r", &group, &channel));
}

struct built {
	struct scene scene;
	struct arena arena;
	struct shape_geometry g;
	struct error error;
	int result;
};

static struct built build(const char *type, const char *content, const void *bytes, size_t size)
{
	char xml[512];
	snprintf(xml, sizeof xml,
		 "<scene version='3.0.0'><shape type='%s'><string name='filename' value='m'/>%s</shape></scene>", type,
		 content);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"m", bytes, size}, {0}};
	struct asset_source assets = memory_assets(files);
	struct built b = {.arena.limit = 64 << 20};
	uint64_t dropped;
	if (scene_read(&b.scene, &assets, "s.xml", scene_tables(), NULL, 0, &b.error))
		fail_msg("%s", b.error.text);
	b.result = shape_build(b.scene.objects[0], &assets, &b.arena, &b.g, &dropped, &b.error);
	return b;
}

static void release_built(struct built *b)
{
	arena_fini(&b->arena);
	scene_fini(&b->scene);
}

static const struct attribute *find_attribute(const struct built *b, const char *name)
{
	if (b->result)
		fail_msg("%s", b->error.text);
	for (uint32_t i = 0; i < b->g.mesh.attribute_count; i++)
		if (strcmp(b->g.mesh.attributes[i].name, name) == 0)
			return &b->g.mesh.attributes[i];
	fail_msg("no %s", name);
	return NULL;
}

static bool is_near(float a, double b)
{
	return fabs((double)a - b) <= 1e-7 * fabs(b);
}

#define VERTICES "property float x\nproperty float y\nproperty float z\n"

/* Integers stand for 0 to 1 and are sRGB, unless the shape says otherwise; a polygon's number applies to each of its
 * triangles, and that of a triangle without area is dropped with it. */
static void test_ply_values_become_attributes(void **state)
{
	(void)state;
	static const char text[] =
		"ply\nformat ascii 1.0\nelement face 3\nproperty uchar red\nproperty list uchar int vertex_indices\n"
		"property uchar green\nproperty uchar blue\nproperty double heat\n"
		"element vertex 5\n" VERTICES
		"property float r\nproperty float g\nproperty ushort w_0\nproperty float b\n"
		"end_header\n"
		"0 3 0 0 1 0 0 7\n" /* no area */
		"51 4 0 1 2 3 102 255 -2.5\n"
		"1 3 0 2 4 2 3 1e300\n"
		"0 0 0 0.5 0.25 65535 1\n1 0 0 2 -1 0 0\n1 1 0 1e13 0 13107 0\n0 1 0 0 0 0 0\n0 0 1 0 0 0 0\n";
	struct built b = build("ply", "", text, sizeof text - 1);
	const struct attribute *c = find_attribute(&b, "face_color"), *heat = find_attribute(&b, "face_heat"),
			       *v = find_attribute(&b, "vertex_color"), *w = find_attribute(&b, "vertex_w");
	assert_int_equal(b.g.mesh.triangle_count, 3);
	assert_int_equal(b.g.mesh.attribute_count, 4);
	assert_true(c->is_per_face && heat->is_per_face && !v->is_per_face && !w->is_per_face);
	assert_true(c->channels == 3 && heat->channels == 1 && v->channels == 3 && w->channels == 1);
	for (int t = 0; t < 2; t++) {
		assert_true(is_near(c->value[3 * t], srgb_to_linear(0.2)));
		assert_true(is_near(c->value[3 * t + 1], srgb_to_linear(0.4)) && c->value[3 * t + 2] == 1);
		assert_true(heat->value[t] == -2.5F);
	}
	assert_true(is_near(c->value[8], srgb_to_linear(3 / 255.0)));
	assert_true(v->value[0] == 0.5F && v->value[1] == 0.25F && v->value[2] == 1);
	assert_true(v->value[3] == 2 && v->value[4] == -1 && v->value[6] == 0);
	assert_true(w->value[0] == 1 && is_near(w->value[2], srgb_to_linear(0.2)));
	/* A value that is not finite marks its own attribute as damaged, and no other. */
	assert_true(v->has_invalid_value && heat->has_invalid_value && !c->has_invalid_value && !w->has_invalid_value);
	assert_true(v->is_srgb && heat->is_srgb && !c->is_srgb && !w->is_srgb);
	release_built(&b);

	b = build("ply", "<boolean name='srgb' value='false'/>", text, sizeof text - 1);
	assert_true(is_near(find_attribute(&b, "face_color")->value[0], 0.2) &&
		    find_attribute(&b, "vertex_color")->value[0] == 0.5F);
	assert_false(find_attribute(&b, "vertex_color")->is_srgb);
	release_built(&b);
	b = build("ply", "<boolean name='srgb' value='true'/>", text, sizeof text - 1);
	assert_true(is_near(find_attribute(&b, "vertex_color")->value[0], srgb_to_linear(0.5)));
	assert_false(find_attribute(&b, "vertex_color")->is_srgb);
	release_built(&b);
}

/* One polygon with many corners and many attributes would make far more numbers than the file has bytes. */
static void test_ply_attributes_are_limited(void **state)
{
	(void)state;
	enum { CORNERS = 20000, ROOM = 1 << 17 };
	char *text = malloc(ROOM), *at = text, *end = text + ROOM;
	assert_non_null(text);
	at += snprintf(at, (size_t)(end - at),
		       "ply\nformat ascii 1.0\nelement vertex 3\n" VERTICES "element face 1\n"
		       "property list int int vertex_indices\n");
	for (int i = 0; i < 60; i++)
		at += snprintf(at, (size_t)(end - at), "property float p%d\n", i);
	at += snprintf(at, (size_t)(end - at), "end_header\n0 0 0 1 0 0 0 1 0\n%d", CORNERS);
	for (int i = 0; i < CORNERS; i++)
		at += snprintf(at, (size_t)(end - at), " %d", i % 3);
	for (int i = 0; i < 60; i++)
		at += snprintf(at, (size_t)(end - at), " 1");
	struct built b = build("ply", "", text, (size_t)(at - text));
	assert_true(b.result == -E2BIG && strstr(b.error.text, "1199880 numbers of attributes"));
	release_built(&b);
	free(text);
}

static void test_serialized_colours_become_attributes(void **state)
{
	(void)state;
	static struct mesh_file f;
	for (int doubles = 0; doubles < 2; doubles++) {
		mesh_file_make_serialized(&f, 4, doubles, 8, 1);
		struct built b = build("serialized", "", f.bytes, f.size);
		const struct attribute *c = find_attribute(&b, "vertex_color");
		assert_true(c->channels == 3 && !c->is_per_face && !c->is_srgb && !c->has_invalid_value);
		for (int i = 0; i < 3 * SOLID_VERTICES; i++)
			assert_true((double)c->value[i] == SOLID_COLOUR(i));
		release_built(&b);
		mesh_file_make_serialized(&f, 4, doubles, 3, 1);
		b = build("serialized", "", f.bytes, f.size);
		assert_true(b.result == 0 && b.g.mesh.attribute_count == 0);
		release_built(&b);
	}
}

/* Three numbers after a position are an sRGB colour, also for the faces of one material; a single weight is not, and
 * colours are used only if each vertex of the file has one. */
static void test_obj_colours_become_attributes(void **state)
{
	(void)state;
#define FACES "vt 0 0\nf 1 2 4\nusemtl a\nf 2/1 3/1 4/1\n"
	static const char text[] =
		"v 0 0 0 1 0 0 # red\nv 1 0 0 0.2 0.4 0.02\nv 1 1 0 2 \\\n-0.5 1\nv 0 1 0 0 0 1 \n" FACES;
	struct built b = build("obj", "", text, sizeof text - 1);
	const struct attribute *c = find_attribute(&b, "vertex_color");
	assert_true(c->channels == 3 && !c->is_per_face && !c->is_srgb && !c->has_invalid_value);
	assert_int_equal(b.g.mesh.vertex_count, 6);
	for (uint32_t i = 0; i < b.g.mesh.vertex_count; i++) {
		static const double at[4][3] = {{1, 0, 0}, {0.2, 0.4, 0.02}, {0, 0, 1}, {2, -0.5, 1}};
		const double *p = b.g.mesh.position[i];
		for (int k = 0; k < 3; k++)
			assert_true(is_near(c->value[3 * i + (uint32_t)k],
					    srgb_to_linear(at[(int)p[0] + 2 * (int)p[1]][k])));
	}
	release_built(&b);
	b = build("obj", "<string name='material' value='a'/>", text, sizeof text - 1);
	assert_int_equal(b.g.mesh.vertex_count, 3);
	assert_true(is_near(find_attribute(&b, "vertex_color")->value[0], srgb_to_linear(0.2)));
	release_built(&b);

	static const char damaged[] = "v 0 0 0 1 0 0\nv 1 0 0 1e300 0 0\nv 1 1 0 0 0 0\nf 1 2 3\n";
	b = build("obj", "", damaged, sizeof damaged - 1);
	assert_true(find_attribute(&b, "vertex_color")->has_invalid_value);
	release_built(&b);
	static const char *const without[] = {
		"v 0 0 0 1\nv 1 0 0 1\nv 1 1 0 1\nv 0 1 0 1\n" FACES,
		"v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 1 1 0 1 1 1\nv 0 1 0\n" FACES,
		"v 0 0 0 1 1\nv 1 0 0 1 1\nv 1 1 0 1 1\nv 0 1 0 1 1\n" FACES,
		"v 0 0 0 1 1 1 1\nv 1 0 0 1 1 1 1\nv 1 1 0 1 1 1 1\nv 0 1 0 1 1 1 1\n" FACES,
		"v 0 0 0 r g b\nv 1 0 0 1 1 1x\nv 1 1 0 1 1 1\nv 0 1 0 1 1 1\n" FACES,
	};
	for (size_t i = 0; i < sizeof without / sizeof *without; i++) {
		b = build("obj", "", without[i], strlen(without[i]));
		assert_true(b.result == 0 && b.g.mesh.attribute_count == 0);
		release_built(&b);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_attribute_names_are_grouped),
		cmocka_unit_test(test_ply_values_become_attributes),
		cmocka_unit_test(test_ply_attributes_are_limited),
		cmocka_unit_test(test_serialized_colours_become_attributes),
		cmocka_unit_test(test_obj_colours_become_attributes),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
