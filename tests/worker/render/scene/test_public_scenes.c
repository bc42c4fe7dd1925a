/* SPDX-License-Identifier: Apache-2.0 */
/* Reads the public scenes in the folder HSLT_SCENES with the program's own tables; skipped if the variable is not
 * set. */
#include "worker/render/render.h"
#include "worker/render/shape/shape.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct expected_scene {
	const char *folder, *file;
	bool is_dialect_3;
	uint32_t shapes, assets, min_notes;
	uint64_t triangles, spheres;
	uint32_t width, height;
	enum filter_kind filter;
	uint64_t spp;
	uint32_t max_depth;
	double fov;
};

static const struct expected_scene expected_scenes[] = {
	{"cornell-box", "scene.xml", false, 8, 0, 3, 36, 0, 1024, 1024, FILTER_TENT, 64, 65, 19.5},
	{"veach-mis", "scene.xml", false, 9, 0, 4, 52, 3, 1280, 720, FILTER_TENT, 512, 5, 35},
	{"veach-door", "scene.xml", false, 22, 28, 3, 0, 0, 1280, 720, FILTER_BOX, 0, 128, 54.6003},
	{".", "three-spheres.xml", true, 5, 0, 1, 4, 3, 512, 288, FILTER_BOX, 64, 31, 47.27},
	{".", "half-sunk.xml", true, 3, 0, 1, 4, 1, 512, 288, FILTER_BOX, 64, 31, 38.58},
	{".", "half-sunk-rough.xml", true, 3, 0, 1, 4, 1, 512, 288, FILTER_BOX, 64, 31, 38.58},
};

static void check_shapes(const struct scene *s, const struct asset_source *assets, const struct expected_scene *x)
{
	struct arena arena = {0};
	uint32_t shapes = 0;
	uint64_t triangles = 0, spheres = 0;
	for (uint32_t i = 0; i < s->object_count; i++) {
		if (s->objects[i]->cls != PLUGIN_SHAPE)
			continue;
		struct shape_geometry g;
		struct error e;
		uint64_t dropped;
		if (shape_build(s->objects[i], assets, &arena, &g, &dropped, &e))
			fail_msg("%s", e.text);
		assert_non_null(node_child(s->objects[i], PLUGIN_BSDF, 0));
		shapes++;
		spheres += g.kind == SHAPE_SPHERE;
		triangles += g.mesh.triangle_count;
	}
	assert_int_equal(shapes, x->shapes);
	assert_int_equal(spheres, x->spheres);
	if (x->triangles)
		assert_int_equal(triangles, x->triangles);
	arena_fini(&arena);
}

static void check_scene(const char *root, const struct expected_scene *x)
{
	char folder[1024];
	snprintf(folder, sizeof folder, "%s/%s", root, x->folder);
	struct asset_source assets = asset_source_for_folder(folder);
	struct scene s;
	struct error e;
	if (scene_read(&s, &assets, x->file, render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	for (uint32_t i = 0; i < s.note_count; i++)
		print_message("%s\n", s.notes[i]);
	assert_int_equal(s.is_dialect_3, x->is_dialect_3);
	assert_int_equal(s.asset_count, x->assets);
	assert_true(s.note_count >= x->min_notes);
	check_shapes(&s, &assets, x);
	struct scene_settings set;
	if (scene_settings_read(&s, 0, 0, 1, &set, &e))
		fail_msg("%s", e.text);
	assert_int_equal(set.width, x->width);
	assert_int_equal(set.height, x->height);
	assert_int_equal(set.filter, x->filter);
	assert_int_equal(set.spp, x->spp);
	assert_int_equal(set.max_depth, x->max_depth);
	assert_true(set.fov == x->fov);
	scene_fini(&s);
}

static void test_public_scenes_are_read_as_expected(void **state)
{
	(void)state;
	const char *root = getenv("HSLT_SCENES");
	if (!root || !*root) {
		print_message("skipped: HSLT_SCENES is not set\n");
		skip();
	}
	for (size_t i = 0; i < sizeof expected_scenes / sizeof *expected_scenes; i++)
		check_scene(root, &expected_scenes[i]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_public_scenes_are_read_as_expected)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
