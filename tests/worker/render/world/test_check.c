/* SPDX-License-Identifier: Apache-2.0 */
/* world_check_all() reports every invalid shape, material and emitter once each; for a valid scene it reports the
 * same as world_check(). */
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"
#include "worker/render/world/build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define METAL(name) "<bsdf type='conductor'><string name='material' value='" name "'/></bsdf>"
#define SPHERE(content) "<shape type='sphere'>" content "</shape>\n"
#define ENVIRONMENT "<emitter type='constant'/>\n"

struct checked {
	struct scene scene;
	struct arena arena;
	struct report report;
	struct render_summary summary;
};

static void check(const char *xml, struct checked *c)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"a.ply", "plx", 3}, {0}};
	struct asset_source assets = memory_assets(files);
	struct error e;
	*c = (struct checked){.arena = {0}};
	if (scene_read(&c->scene, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	assert_int_equal(report_init(&c->report, &c->arena, &e), 0);
	const struct render_options as_it_is = {0};
	if (world_check_all(&c->scene, &assets, &as_it_is, &c->report, &c->summary, &e))
		fail_msg("%s", e.text);
}

static void free_checked(struct checked *c)
{
	scene_fini(&c->scene);
	arena_fini(&c->arena);
}

static void test_all_problems_are_reported(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'>\n"
				  "<bsdf type='twosided' id='m'><bsdf type='dielectric'/></bsdf>\n" /* line 2 */
		SPHERE(METAL("Ni_palik")) SPHERE(METAL("Xy"))					    /* 4 */
		SPHERE("<ref id='m'/>")
			SPHERE("<ref id='m'/>") "<shape type='ply'><string name='filename' value='a.ply'/>" METAL(
				"Xz") "</shape>\n" /* 7 */
		SPHERE("<emitter type='area'><texture name='radiance' type='bitmap'>"
		       "<string name='filename' value='a.ply'/></texture></emitter>") /* 8 */
		ENVIRONMENT ENVIRONMENT						      /* 10 */
			SPHERE(METAL("Ni_palikx"))				      /* 11 */
		"<shape type='shapegroup' id='g'><shape type='ply'><string name='filename' value='a.ply'/></shape></shape>\n"
		"<shape type='instance'><ref id='g'/></shape><shape type='instance'><ref id='g'/></shape>" /* of 12 */
		"</scene>";
	static const char *const expected[] = {
		"s.xml:7: ", "s.xml:12: ", "s.xml:4: ", "s.xml:2: ", "s.xml:11: ", "s.xml:8: ", "s.xml:10: "};
	enum { COUNT = sizeof expected / sizeof *expected };
	struct checked c;
	check(xml, &c);
	for (uint32_t i = 0; i < c.report.problem_count; i++)
		if (i >= COUNT || strncmp(c.report.problems[i], expected[i], strlen(expected[i])) != 0)
			fail_msg("problem %u: %s", i, c.report.problems[i]);
	assert_int_equal(c.report.problem_count, COUNT);
	free_checked(&c);
}

/* Errors in instances come first, because shapes are listed before they are read. */
static void test_problems_of_instances_come_first(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'>\n<shape type='instance'/>\n" SPHERE(METAL(
		"Xy")) "<shape type='merge'><shape type='instance'/>\n<shape type='instance'><shape type='cube'/></shape></shape>"
		       "</scene>";
	static const char *const expected[] = {"s.xml:2: <shape type=\"instance\">",
					       "s.xml:4: <shape type=\"instance\">",
					       "s.xml:5: <shape type=\"instance\">", "s.xml:3: "};
	enum { COUNT = sizeof expected / sizeof *expected };
	struct checked c;
	check(xml, &c);
	assert_int_equal(c.report.problem_count, COUNT);
	for (uint32_t i = 0; i < COUNT; i++)
		if (strncmp(c.report.problems[i], expected[i], strlen(expected[i])) != 0)
			fail_msg("problem %u: %s", i, c.report.problems[i]);
	free_checked(&c);
}

static void test_valid_scene_has_no_problems(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'>" SPHERE(METAL("Cu")) ENVIRONMENT "</scene>";
	struct checked c;
	struct render_summary alone;
	struct error e;
	check(xml, &c);
	assert_int_equal(c.report.problem_count, 0);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	struct asset_source assets = memory_assets(files);
	const struct render_options as_it_is = {0};
	assert_int_equal(world_check(&c.scene, &assets, &as_it_is, &alone, &e), 0);
	assert_true(c.summary.shapes == 1 && alone.shapes == 1 && c.summary.brightness_bound == alone.brightness_bound);
	free_checked(&c);
}

/* Mitsuba has two tables for most metals, and this renderer one: a note says so, unless this table is Mitsuba's only
 * one. */
static void test_metals_with_two_tables_are_noted(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'>" SPHERE(METAL("Ni_palik"))
		SPHERE("<bsdf type='twosided' id='t'>" METAL("Cu_palik") "</bsdf>") SPHERE("<ref id='t'/>") ENVIRONMENT
		"</scene>";
	struct checked c;
	check(xml, &c);
	assert_int_equal(c.report.problem_count, 0);
	assert_int_equal(c.scene.note_count, 1);
	assert_string_equal(c.scene.notes[0],
			    "s.xml:2: <bsdf type=\"conductor\">: the refractive indices of Cu are used for Cu_palik");
	free_checked(&c);
}

/* A metal that only Mitsuba has is unknown, and no other metal replaces it. */
static void test_unknown_metals_are_refused(void **state)
{
	(void)state;
	static const char xml[] = "<scene version='3.0.0'>" SPHERE(METAL("TiO3_palik")) ENVIRONMENT
		"\n" SPHERE(METAL("Agg")) "\n" SPHERE(METAL("Gold")) "</scene>";
	struct checked c;
	check(xml, &c);
	assert_int_equal(c.scene.note_count, 0);
	assert_int_equal(c.report.problem_count, 3);
	assert_non_null(strstr(c.report.problems[0],
			       "unknown conductor \"TiO3_palik\"; eta and k are accepted, too (known: "
			       "a-C, Ag, "));
	assert_non_null(strstr(c.report.problems[0], ", W, none)"));
	assert_non_null(strstr(c.report.problems[1], "unknown conductor \"Agg\"; did you mean `Ag`?"));
	assert_non_null(strstr(c.report.problems[2], "unknown conductor \"Gold\"; did you mean `Au`?"));
	free_checked(&c);
}

static void test_unknown_indices_are_refused(void **state)
{
	(void)state;
#define GLASS(name) "<bsdf type='dielectric'><string name='int_ior' value='" name "'/></bsdf>"
	static const char xml[] = "<scene version='3.0.0'>" SPHERE(GLASS("watter")) "\n" SPHERE(
		GLASS("glass")) "\n" SPHERE(GLASS("Kryptonite")) ENVIRONMENT "</scene>";
	struct checked c;
	check(xml, &c);
	assert_int_equal(c.report.problem_count, 3);
	assert_non_null(strstr(c.report.problems[0], "int_ior: unknown material \"watter\"; did you mean `water`?"));
	assert_non_null(strstr(c.report.problems[1], "int_ior: unknown material \"glass\"; did you mean `bk7`?"));
	assert_non_null(
		strstr(c.report.problems[2], "\"Kryptonite\"; a number is accepted, too (known: vacuum, helium, "));
	assert_non_null(strstr(c.report.problems[2], ", sapphire (o))"));
	free_checked(&c);
}

/* A value beside a texture: the texture applies, which Mitsuba 0.6 accepts; a value alone is no mistake. */
static void test_textures_override_values_beside_them(void **state)
{
	(void)state;
#define SCALED(inside)                                                                                         \
	"<bsdf type='diffuse'><texture type='scale' name='reflectance'><rgb name='value' value='0.5'/>" inside \
	"</texture></bsdf>"
	static const char xml[] =
		"<scene version='0.6.0'>" SPHERE(SCALED("")) "\n" SPHERE(SCALED("<texture type='checkerboard'/>"))
			ENVIRONMENT "</scene>";
	struct checked c;
	check(xml, &c);
	assert_int_equal(c.report.problem_count, 0);
	assert_int_equal(c.scene.note_count, 1);
	assert_string_equal(c.scene.notes[0],
			    "s.xml:3: <texture type=\"scale\">: `value` has no effect: the texture inside is scaled, "
			    "as in Mitsuba 0.6");
	free_checked(&c);
}

/* The number of reported errors ends where the report is full. */
static void test_report_of_too_many_errors_is_cut(void **state)
{
	(void)state;
	enum { MANY = REPORT_PROBLEMS_MAX + 50 };
	size_t room = MANY * sizeof SPHERE(METAL("X")) + 100, n;
	char *xml = malloc(room);
	assert_non_null(xml);
	n = (size_t)sprintf(xml, "<scene version='3.0.0'>\n");
	for (int i = 0; i < MANY; i++)
		n += (size_t)sprintf(xml + n, "%s", SPHERE(METAL("X")));
	sprintf(xml + n, "</scene>");
	struct checked c;
	check(xml, &c);
	assert_int_equal(c.report.problem_count, REPORT_PROBLEMS_MAX);
	free_checked(&c);
	free(xml);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_all_problems_are_reported),
		cmocka_unit_test(test_problems_of_instances_come_first),
		cmocka_unit_test(test_valid_scene_has_no_problems),
		cmocka_unit_test(test_metals_with_two_tables_are_noted),
		cmocka_unit_test(test_unknown_metals_are_refused),
		cmocka_unit_test(test_unknown_indices_are_refused),
		cmocka_unit_test(test_textures_override_values_beside_them),
		cmocka_unit_test(test_report_of_too_many_errors_is_cut),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
