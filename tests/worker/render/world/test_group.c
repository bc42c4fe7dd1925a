/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes in merges and instances: the world has the same shapes, materials and emitters as a scene in which every
 * copy is written out. Also shapes without area, which are left out and noted; materials that come with mesh files;
 * the choice of a sensor; and orthographic cameras.
 */
#include "worker/render/render.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define VIEW SENSOR("0,0,9", "0,0,0")
#define SKY "<emitter type='constant'/>"
#define RED "<bsdf type='diffuse' id='red'><rgb name='reflectance' value='0.8,0.1,0.1'/></bsdf>"
#define TURN "<rotate y='1' angle='30'/><translate x='1' y='2'/>"
#define SQUEEZE "<scale x='1' y='2' z='0.5'/>"
#define TO(inner) "<transform name='to_world'>" inner "</transform>"
#define LAMP "<emitter type='area'><float name='radiance' value='3'/></emitter>"

static void assert_same_shape(const struct geom_shape *a, const struct geom_shape *b)
{
	assert_true(a->is_sphere == b->is_sphere && a->triangle_count == b->triangle_count &&
		    a->vertex_count == b->vertex_count);
	if (a->is_sphere)
		assert_true(vec3_length(vec3_sub(a->center, b->center)) < 1e-12 && fabs(a->radius - b->radius) < 1e-12);
	for (uint32_t i = 0; i < a->vertex_count; i++)
		for (int k = 0; k < 3; k++) {
			assert_true(fabs((double)(a->position[i][k] - b->position[i][k])) < 1e-6);
			assert_true(fabs((double)(a->normal[i][k] - b->normal[i][k])) < 1e-6);
		}
	for (uint32_t i = 0; i < a->triangle_count; i++)
		for (int k = 0; k < 3; k++)
			assert_int_equal(a->index[i][k], b->index[i][k]);
}

static void test_groups_are_copied_with_their_transforms(void **state)
{
	(void)state;
	/* clang-format off */
	struct world *a = world_from_text(8, 8,
		VIEW SKY RED
		"<shape type='shapegroup' id='g'>"
			"<shape type='cube'>" TO(SQUEEZE) "<ref id='red'/></shape>"
			"<shape type='sphere'><point name='center' x='3' y='0' z='0'/>" LAMP "</shape>"
		"</shape>"
		"<shape type='instance'><ref id='g'/>" TO(TURN) "</shape>"
		"<shape type='instance'><ref id='g'/></shape>"
		"<shape type='merge'><shape type='rectangle'/><shape type='cube'><ref id='red'/></shape></shape>"
		"%s",
		"");
	/* clang-format on */
	struct world *b = world_from_text(
		8, 8,
		VIEW SKY RED "<shape type='cube'>" TO(
			SQUEEZE TURN) "<ref id='red'/></shape>"
				      "<shape type='sphere'><point name='center' x='3' y='0' z='0'/>" TO(TURN) LAMP
		"</shape>"
		"<shape type='cube'>" TO(
			SQUEEZE) "<ref id='red'/></shape>"
				 "<shape type='sphere'><point name='center' x='3' y='0' z='0'/>" LAMP "</shape>"
				 "<shape type='rectangle'/><shape type='cube'><ref id='red'/></shape>%s",
		"");
	assert_int_equal(a->shape_count, 6);
	assert_int_equal(b->shape_count, 6);
	assert_int_equal(a->emitter_count, 3);
	for (uint32_t i = 0; i < 6; i++)
		assert_same_shape(&a->shapes[i], &b->shapes[i]);
	/* All copies share one material. */
	assert_int_equal(a->shape_bindings[0].bsdf, a->shape_bindings[2].bsdf);
	assert_int_equal(a->shape_bindings[0].bsdf, a->shape_bindings[5].bsdf);
	assert_true(a->shape_bindings[1].emitter >= 0 && a->shape_bindings[3].emitter >= 0 &&
		    a->shape_bindings[1].emitter != a->shape_bindings[3].emitter);
	world_free(a);
	world_free(b);
}

static int check_scene(const char *inside, const char *accuracy, struct render_summary *out, struct error *e)
{
	static char xml[16384];
	snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", inside);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {NULL, NULL, 0}};
	struct asset_source assets = memory_assets(files);
	struct render_options o = {0};
	struct scene s;
	snprintf(o.accuracy, sizeof o.accuracy, "%s", accuracy);
	int rc = scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, e);
	if (!rc) {
		rc = world_check(&s, &assets, &o, out, e);
		scene_fini(&s);
	}
	return rc;
}

static void expect_refused(const char *inside, const char *accuracy, const char *text)
{
	static struct render_summary summary;
	struct error e = {""};
	if (check_scene(inside, accuracy, &summary, &e) >= 0 || !strstr(e.text, text))
		fail_msg("%s\n gave: %s\n not: %s", inside, e.text, text);
}

/* A mesh without area is left out together with its material and its light; of a partly degenerate mesh, the
 * triangles with an area remain. Both are counted. */
static void test_shapes_without_area_are_left_out(void **state)
{
	(void)state;
	static const char *const meshes[] = {"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 1 2\nf 1 2 1\n",
					     "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 3 3 3\n"};
	static const char scene[] =
		"<scene version='3.0.0'>" VIEW SKY RED "<shape type='cube'/>"
		"<shape type='obj'><string name='filename' value='flat.obj'/>" LAMP "</shape>"
		"<shape type='obj'><string name='filename' value='half.obj'/><ref id='red'/></shape>"
		"<shape type='sphere'>" LAMP "</shape></scene>";
	const struct memory_file files[] = {{"scene.xml", scene, strlen(scene)},
					    {"flat.obj", meshes[0], strlen(meshes[0])},
					    {"half.obj", meshes[1], strlen(meshes[1])},
					    {NULL, NULL, 0}};
	struct world *w = world_from_files(8, 8, files);
	assert_int_equal(w->shape_count, 3);
	assert_int_equal(w->shapes[1].triangle_count, 1);
	assert_true(w->shapes[2].is_sphere && w->shape_bindings[2].emitter >= 0 && w->shape_bindings[1].emitter < 0);
	assert_true(w->shape_bindings[0].bsdf != w->shape_bindings[1].bsdf);
	assert_int_equal(w->emitter_count, 2); /* those of the sphere and of the sky */
	assert_non_null(strstr(w->notes.flat_triangles,
			       "3 triangles without area are left out, in 2 shapes (first: the obj in scene.xml:1)"));
	assert_non_null(strstr(w->notes.flat_triangles, "1 of these shapes has no others"));
	world_free(w);
}

/* Mitsuba 0.6 reads the materials in the file of a mesh whose shape has no BSDF; a note tells users of such files. */
static void test_materials_in_mesh_files_are_noted(void **state)
{
	(void)state;
	static const char mesh[] = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl red\nf 1 2 3\n";
	static const struct {
		const char *version, *inside;
		bool is_noted;
	} cases[] = {{"0.6.0", "", true},
		     {"0.6.0", "<bsdf type='diffuse'/>", false},
		     {"0.6.0", "<boolean name='loadMaterials' value='false'/>", false},
		     {"3.0.0", "", false}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char scene[512];
		snprintf(
			scene, sizeof scene,
			"<scene version='%s'><sensor type='perspective'/><emitter type='constant'/>\n"
			"<shape type='obj'><string name='filename' value='a.obj'/>%s</shape>"
			"<shape type='obj'><string name='filename' value='a.obj'/><bsdf type='diffuse'/></shape></scene>",
			cases[i].version, cases[i].inside);
		const struct memory_file files[] = {
			{"scene.xml", scene, strlen(scene)}, {"a.obj", mesh, strlen(mesh)}, {NULL, NULL, 0}};
		struct world *w = world_from_files(8, 8, files);
		const char *said =
			strstr(w->notes.unread_materials, "of 1 mesh without a bsdf (first: the obj in scene.xml:2)");
		assert_true(cases[i].is_noted ? said != NULL : !*w->notes.unread_materials);
		world_free(w);
	}
}

static void test_invalid_groups_are_refused(void **state)
{
	(void)state;
#define GROUP(id, inner) "<shape type='shapegroup' id='" id "'>" inner "</shape>"
#define INSTANCE(id) "<shape type='instance'><ref id='" id "'/></shape>"
	expect_refused(VIEW "<shape type='instance'/>", "", "needs exactly one shapegroup");
	expect_refused(VIEW "<shape type='instance'><shape type='cube'/></shape>", "", "needs exactly one shapegroup");
	expect_refused(VIEW GROUP("a", "<shape type='cube'/>") GROUP("b", INSTANCE("a")) INSTANCE("b"), "",
		       "an instance in a shapegroup is not supported");
	expect_refused(VIEW "<shape type='merge'>" GROUP("a", "") "</shape>", "",
		       "a shapegroup may stand directly in <scene>");
	expect_refused(VIEW "<shape type='merge' id='m'><ref id='m'/></shape>", "", "refers to itself");
	/* The nested instances, sixteen of sixteen and so on, are counted before anything is built. */
	char deep[8192], *at = deep, *end = deep + sizeof deep;
	at += snprintf(at, (size_t)(end - at), VIEW "<shape type='merge' id='m0'><shape type='cube'/></shape>");
	for (int level = 1; level < 7; level++) {
		at += snprintf(at, (size_t)(end - at), "<shape type='merge' id='m%d'>", level);
		for (int i = 0; i < 16; i++)
			at += snprintf(at, (size_t)(end - at), "<ref id='m%d'/>", level - 1);
		at += snprintf(at, (size_t)(end - at), "</shape>");
	}
	expect_refused(deep, "", "more than 1048576 shapes");
}

#define ORTHO(inner)                                                                                   \
	"<sensor type='orthographic'>" inner "<film type='hdrfilm'><integer name='width' value='40'/>" \
	"<integer name='height' value='20'/><rfilter type='box'/></film></sensor>"

static void test_sensors_are_checked(void **state)
{
	(void)state;
	static struct render_summary m;
	struct error e = {""};
	const char *two = VIEW ORTHO("") SKY "<shape type='cube'/>";
	assert_int_equal(check_scene(two, "", &m, &e), 0);
	assert_true(m.settings.width == 32 && !(m.settings.half_width > 0));
	assert_int_equal(check_scene(two, "sensor=2", &m, &e), 0);
	assert_true(m.settings.width == 40 && m.settings.half_width == 1);
	expect_refused(two, "sensor=3", "there is no sensor 3: the scene has 2");
	expect_refused(ORTHO("<transform name='to_world'><scale x='2' y='3'/></transform>"), "", "only square pixels");
}

/* Positions of scene points on the film: over the width of the film x runs from -s to s, whatever the depth. */
static void test_orthographic_film_positions_ignore_depth(void **state)
{
	(void)state;
	struct world *w = world_from_text(
		0, 0,
		ORTHO("<transform name='to_world'><scale value='4'/><lookat origin='3,1,-10' target='3,1,0' up='0,1,0'/></transform>")
			SKY "<shape type='cube'><transform name='to_world'><scale value='6'/></transform></shape>%s",
		"");
	const struct camera *c = &w->camera;
	for (int i = 0; i < 20; i++) {
		double x = 40 * (i + 0.3) / 20, y = 20 * (i + 0.6) / 20;
		vec3 d = camera_direction(c, c->position, x, y);
		double t_min, t_max;
		camera_clip_range(c, d, &t_min, &t_max);
		for (int deep = 0; deep < 2; deep++) {
			/* Points on the near plane, and 15 units behind it, back in scene units. */
			double t = t_min + deep * 15 * w->scale;
			vec3 p = vec3_madd(w->center, 1 / w->scale, vec3_madd(c->position, t, d)), at;
			/* With the view along +z and y up, film x grows to the left. */
			at = (vec3){3 + 4 * (1 - x / 20), 1 + 4 * (0.5 - y / 20), -10 + 0.01 + 15 * deep};
			assert_true(vec3_length(vec3_sub(p, at)) < 1e-3);
			double fx, fy;
			assert_true(camera_project(c, c->position, d, t * (1 + 0x1p-50), &fx, &fy));
			assert_true(fabs(fx - x) < 1e-3 && fabs(fy - y) < 1e-3);
		}
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_groups_are_copied_with_their_transforms),
		cmocka_unit_test(test_shapes_without_area_are_left_out),
		cmocka_unit_test(test_materials_in_mesh_files_are_noted),
		cmocka_unit_test(test_invalid_groups_are_refused),
		cmocka_unit_test(test_sensors_are_checked),
		cmocka_unit_test(test_orthographic_film_positions_ignore_depth),
	};
	return cmocka_run_group_tests_name("group", tests, NULL, NULL);
}
