/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scenes that are short to write and enormous or endless to expand: ladders whose rungs refer twice to the one below,
 * chains of references, files that include each other. Each is refused with file, line and element, and at once: the
 * limits count while reading, without following a reference twice.
 */
#include "common/base/mem.h"
#include "tests/support/append_format.h"
#include "tests/support/test_length.h"
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static char xml[8 << 20];
static size_t used;

#define put(...) append_format(xml, sizeof xml, &used, __VA_ARGS__)

static int read_files(const struct memory_file *files, struct error *e)
{
	struct asset_source assets = memory_assets(files);
	struct scene s;
	int r = scene_read(&s, &assets, files[0].name, render_plugins(), NULL, 0, e);
	if (!r)
		scene_fini(&s);
	return r;
}

/* Reads the scene built with put(). sentence: part of the expected error; NULL: the scene must be accepted. */
static void expect_result(const char *sentence)
{
	const struct memory_file files[] = {{"s.xml", xml, used}, {0}};
	struct error e = {""};
	int r = read_files(files, &e);
	if (sentence ? r >= 0 || !strstr(e.text, sentence) : r != 0)
		fail_msg("%.300s\n gave %d: %s\n not: %s", xml, r, e.text, sentence ? sentence : "a scene");
}

/* Writes objects m0, m1, ... m<rungs>, one per line from line 2 on: m0 is `leaf`, each other one contains its
 * predecessor `times` times. The caller closes the scene. */
static void nest_elements(const char *element, const char *type, const char *leaf, int rungs, int times,
			  const char *more)
{
	used = 0;
	put("<scene version='3.0.0'>\n<%s type='%s' id='m0'/>\n", element, leaf);
	for (int i = 1; i <= rungs; i++) {
		put("<%s type='%s' id='m%d'>%s", element, type, i, more);
		for (int k = 0; k < times; k++)
			put("<ref id='m%d'/>", i - 1);
		put("</%s>\n", element);
	}
}

static void test_ladders_of_references_are_limited(void **state)
{
	(void)state;
	static const struct {
		const char *element, *type, *leaf, *more;
		int allowed; /* largest accepted number of rungs */
		const char *sentence;
	} all[] = {
		/* 2^(n+1) - 1 objects in n rungs */
		{"bsdf", "blendbsdf", "diffuse", "", 15, "s.xml:18: <ref>: makes a bsdf of more than 65536 objects"},
		{"bsdf", "twosided", "diffuse", "", 15, "s.xml:18: <ref>: makes a bsdf of more than 65536 objects"},
		{"bsdf", "mixturebsdf", "diffuse", "<string name='weights' value='.5,.5'/>", 15,
		 "s.xml:18: <ref>: makes a bsdf of more than 65536 objects"},
		/* each rung is also an object of the scene: 2^(n+2) - n - 3 objects */
		{"shape", "merge", "cube", "", 24,
		 "s.xml:27: <shape type=\"merge\">: the scene has more than 67108864"},
	};
	for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
		nest_elements(all[i].element, all[i].type, all[i].leaf, all[i].allowed, 2, all[i].more);
		put("</scene>");
		expect_result(NULL);
		for (int rungs = all[i].allowed + 1; rungs <= 200; rungs += 92) {
			nest_elements(all[i].element, all[i].type, all[i].leaf, rungs, 2, all[i].more);
			put("</scene>");
			expect_result(all[i].sentence);
		}
	}
}

/* An instance counts with all objects in its group. */
static void test_instances_count_all_objects_of_their_group(void **state)
{
	(void)state;
	nest_elements("shape", "merge", "merge", 16, 2, "");
	put("<shape type='shapegroup' id='g'><ref id='m16'/></shape>\n");
	for (int i = 0; i < 1000; i++)
		put("<shape type='instance'><ref id='g'/></shape>\n");
	put("</scene>");
	expect_result("<shape type=\"instance\">: the scene has more than 67108864 objects");
}

/* A material shared by many shapes is built once and counts once. */
static void test_shared_materials_count_once(void **state)
{
	(void)state;
	nest_elements("bsdf", "blendbsdf", "diffuse", 14, 2, "");
	for (int i = 0; i < 5000; i++)
		put("<shape type='cube'><ref id='m14'/></shape>\n");
	put("</scene>");
	expect_result(NULL);
	/* but nested materials count for each shape: 2048 * 32768 and more */
	nest_elements("bsdf", "blendbsdf", "diffuse", 14, 2, "");
	for (int i = 0; i < 2048; i++)
		put("<shape type='cube'><bsdf type='mask'><ref id='m14'/></bsdf></shape>\n");
	put("</scene>");
	expect_result("<bsdf type=\"mask\">: the scene has more than 67108864 objects");
}

static void test_chains_of_references_are_limited(void **state)
{
	(void)state;
	static const struct {
		const char *element, *type, *leaf, *place;
	} all[] = {
		{"bsdf", "coating", "diffuse", "s.xml:8194: <ref>"},
		{"texture", "scale", "checkerboard", "s.xml:8194: <ref>"},
		{"shape", "merge", "merge", "s.xml:8194: <ref>"},
	};
	for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
		char sentence[128];
		snprintf(sentence, sizeof sentence, "%s: objects are nested more than 8192 deep", all[i].place);
		nest_elements(all[i].element, all[i].type, all[i].leaf, 8191, 1, "");
		put("</scene>");
		expect_result(NULL);
		nest_elements(all[i].element, all[i].type, all[i].leaf, 8192, 1, "");
		put("</scene>");
		expect_result(sentence);
		nest_elements(all[i].element, all[i].type, all[i].leaf, test_is_scaled() ? 10000 : 60000, 1, "");
		put("</scene>");
		expect_result(sentence);
	}
}

/* Expects one problem, however long the chain is, and although each object in it is also read by itself. */
static void expect_single_problem(const char *sentence)
{
	const struct memory_file files[] = {{"s.xml", xml, used}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	if (scene_read_all(&s, &assets, "s.xml", render_plugins(), NULL, 0, false, &e))
		fail_msg("%s", e.text);
	if (s.problem_count != 1 || !strstr(s.problems[0], sentence))
		fail_msg("%u problems, not one: %s\n%s\n not: %s", s.problem_count, s.problems[0],
			 s.problem_count > 1 ? s.problems[1] : "", sentence);
	scene_fini(&s);
}

static void test_exceeded_limits_are_reported_once(void **state)
{
	(void)state;
	nest_elements("shape", "merge", "merge", 20000, 1, "");
	put("</scene>");
	expect_single_problem("s.xml:8194: <ref>: objects are nested more than 8192 deep");
	nest_elements("bsdf", "blendbsdf", "diffuse", 200, 2, "");
	put("</scene>");
	expect_single_problem("s.xml:18: <ref>: makes a bsdf of more than 65536 objects");
	nest_elements("shape", "merge", "merge", 25, 2, "");
	for (int i = 0; i < 100; i++)
		put("<shape type='merge'><ref id='m25'/></shape>\n");
	put("</scene>");
	expect_single_problem("the scene has more than 67108864 objects");
	/* each object refers to the next, the last within the limit twice to the first beyond it; the first object
	 * leads to all others */
	used = 0;
	put("<scene version='3.0.0'>\n");
	for (int i = 0; i < 1000; i++)
		put("<shape type='merge' id='m%d'><ref id='m%d'/>%s</shape>\n", i, i + 1,
		    i == 63 ? "<ref id='m64'/>" : "");
	put("<shape type='merge' id='m1000'/></scene>");
	expect_single_problem("s.xml:66: <shape type=\"merge\">: objects refer to each other more than 64 deep");
}

/* The deepest accepted scene can be built and freed, although the functions that follow references recurse. */
static void test_deepest_accepted_scene_is_built(void **state)
{
	(void)state;
	nest_elements("bsdf", "coating", "diffuse", 8190, 1, "");
	put("<shape type='sphere'><ref id='m8190'/></shape><sensor type='perspective'><transform name='to_world'>"
	    "<translate z='-9'/></transform></sensor><emitter type='constant'/></scene>");
	const struct memory_file files[] = {{"s.xml", xml, used}, {0}};
	struct asset_source assets = memory_assets(files);
	struct error e = {""};
	struct scene s;
	struct render_summary summary;
	int r = scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e);
	if (!r) {
		r = world_check(&s, &assets, NULL, &summary, &e);
		scene_fini(&s);
	}
	if (r)
		fail_msg("%s", e.text);
}

/* Files include the next one forty times; then the last file includes itself. */
static void test_repeated_includes_are_limited(void **state)
{
	(void)state;
	static char text[10][4096];
	struct memory_file files[11] = {{0}};
	static const char *const names[] = {"0.xml", "1.xml", "2.xml", "3.xml", "4.xml",
					    "5.xml", "6.xml", "7.xml", "8.xml", "9.xml"};
	for (int i = 0; i < 10; i++) {
		int n = snprintf(text[i], sizeof text[i], "<scene version='3.0.0'>\n");
		for (int k = 0; k < 40 && i < 9; k++)
			n += snprintf(text[i] + n, sizeof text[i] - (size_t)n, "<include filename='%s'/>\n",
				      names[i < 3 ? i + 1 : 9]);
		n += snprintf(text[i] + n, sizeof text[i] - (size_t)n, "</scene>");
		files[i] = (struct memory_file){names[i], text[i], (size_t)n};
	}
	struct error e = {""};
	assert_int_equal(read_files(files, &e), -E2BIG);
	assert_non_null(strstr(e.text, "<include>: more than 1024 files are included"));
	strcpy(text[9], "<scene version='3.0.0'>\n<include filename='9.xml'/></scene>");
	files[9].size = strlen(text[9]);
	assert_int_equal(read_files(files, &e), -ELOOP);
	assert_non_null(strstr(e.text, "9.xml:2: <include>: files include each other more than 15 deep"));
}

/* A chain of files, each of which includes only the next one: as deep as in Mitsuba 3, no deeper. */
static void test_depth_of_includes_is_limited(void **state)
{
	(void)state;
	enum { DEEPEST = 15 };
	static char text[DEEPEST + 2][128], name[DEEPEST + 2][16];
	for (int deep = DEEPEST; deep <= DEEPEST + 1; deep++) {
		struct memory_file files[DEEPEST + 3] = {{0}};
		for (int i = 0; i <= deep; i++) {
			int n = snprintf(text[i], sizeof text[i], "<scene version='3.0.0'>\n<%s%d.xml'/></scene>",
					 i < deep ? "include filename='" : "default name='a' value='", i + 1);
			snprintf(name[i], sizeof name[i], "%d.xml", i);
			files[i] = (struct memory_file){name[i], text[i], (size_t)n};
		}
		struct error e = {""};
		int r = read_files(files, &e);
		if (strstr(e.text, "include each other") ? deep == DEEPEST : deep > DEEPEST)
			fail_msg("%d files in a row: %d, %s", deep, r, e.text);
		if (deep > DEEPEST)
			assert_non_null(strstr(e.text, "15.xml:2: <include>: files include each other more than 15"));
	}
}

/* Included as often as the number of files allows, a file of blanks would keep the reader busy for minutes. Six
 * inclusions exceed the limit on bytes; blanks within a comment are read faster. */
static void test_included_bytes_are_limited(void **state)
{
	(void)state;
	enum { BLANKS = 48 << 20 };
	static const char open[] = "<scene version='3.0.0'><!--", close[] = "--></scene>";
	char *blanks = mem_alloc(BLANKS, 1);
	assert_non_null(blanks);
	memset(blanks, ' ', BLANKS);
	memcpy(blanks, open, sizeof open - 1);
	memcpy(blanks + BLANKS - (sizeof close - 1), close, sizeof close - 1);
	used = 0;
	put("<scene version='3.0.0'>");
	for (int i = 0; i < 6; i++)
		put("<include filename='b.xml'/>");
	put("</scene>");
	const struct memory_file files[] = {{"s.xml", xml, used}, {"b.xml", blanks, BLANKS}, {0}};
	struct error e = {""};
	assert_int_equal(read_files(files, &e), -EFBIG);
	assert_non_null(strstr(e.text, "more than 256 MB in total"));
	mem_free(blanks);
}

/* A long spectrum with many references: one with many blanks, and one with many parts. */
static void test_long_spectra_are_parsed_once(void **state)
{
	(void)state;
	enum { BLANKS = 1 << 19, PARTS = 20000, USERS = 2000 };
	for (int parts = 0; parts < 2; parts++) {
		used = 0;
		put("<scene version='3.0.0'>\n<spectrum type='uniform' id='s'>");
		for (int i = 0; i < PARTS && parts; i++)
			put("<float name='value' value='1'/>");
		if (!parts)
			put("<float name='value' value='%*s1'/>", BLANKS, "");
		put("</spectrum>\n");
		for (int i = 0; i < USERS; i++)
			put("<emitter type='point'><ref name='intensity' id='s'/></emitter>");
		put("</scene>");
		expect_result("s.xml:3: <ref>: spectra have more than 256 MB when all references are followed");
	}
}

/* A file with as many missing names as ids: comparing each name with each id for suggestions would take hours. */
static void test_many_missing_names_are_reported_quickly(void **state)
{
	(void)state;
	used = 0;
	put("<scene version='3.0.0'>\n");
	for (int i = 0; i < 50000; i++)
		put("<bsdf type='diffuse' id='material number %05d'/>", i);
	for (int i = 0; i < 50000; i++)
		put("<shape type='cube'><ref id='materiel nombre %05d'/></shape>", i);
	put("</scene>");
	const struct memory_file files[] = {{"s.xml", xml, used}, {0}};
	struct asset_source assets = memory_assets(files);
	struct error e = {""};
	struct scene s;
	assert_int_equal(scene_read_all(&s, &assets, "s.xml", render_plugins(), NULL, 0, false, &e), 0);
	assert_int_equal(s.problem_count, 1024);
	assert_non_null(strstr(s.problems[0], "did you mean `material number 00000`?"));
	assert_null(strstr(s.problems[1023], "did you mean"));
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_ladders_of_references_are_limited),
		cmocka_unit_test(test_instances_count_all_objects_of_their_group),
		cmocka_unit_test(test_shared_materials_count_once),
		cmocka_unit_test(test_chains_of_references_are_limited),
		cmocka_unit_test(test_exceeded_limits_are_reported_once),
		cmocka_unit_test(test_deepest_accepted_scene_is_built),
		cmocka_unit_test(test_repeated_includes_are_limited),
		cmocka_unit_test(test_depth_of_includes_is_limited),
		cmocka_unit_test(test_included_bytes_are_limited),
		cmocka_unit_test(test_long_spectra_are_parsed_once),
		cmocka_unit_test(test_many_missing_names_are_reported_quickly),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
