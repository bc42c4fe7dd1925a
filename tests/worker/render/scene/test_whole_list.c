/* SPDX-License-Identifier: Apache-2.0 */
/* One run lists all problems of a scene, and none that only follows from another. */
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define S "<scene version='3.0.0'>"
#define END "</scene>"

/* Exactly these, which the problems begin with; NULL ends them. */
static void lists(const struct memory_file *files, bool lenient, const char *const *said)
{
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	assert_int_equal(scene_read_all(&s, &assets, files[0].name, render_plugins(), NULL, 0, lenient, &e), 0);
	for (uint32_t i = 0; i < s.problem_count; i++)
		if (!said[i] || strncmp(s.problems[i], said[i], strlen(said[i])) != 0)
			fail_msg("%s\n not: %s", s.problems[i], said[i] ? said[i] : "none");
	if (said[s.problem_count])
		fail_msg("not said: %s", said[s.problem_count]);
	scene_fini(&s);
}

static void lists_of(const char *xml, const char *const *said)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	lists(files, false, said);
}

/* What uses such a name is not looked at, everything else is. */
static void test_names_without_values(void **state)
{
	(void)state;
	static const char xml[] =
		S "<default name='both' value='$a'/>\n"
		  "<shape type='sphere'><float name='radius' value='$both'/><float name='radios' value='$a'/>\n"
		  "<transform name='to_world'><translate x='$b'/><scale value='0'/></transform><ref id='$c'/>\n"
		  "<bsdf type='$kind'><float name='anything' value='1'/></bsdf></shape>\n"
		  "<alias id='$c' as='d'/><shape type='cube'><ref id='d'/><float name='$c' value='1'/></shape>\n"
		  "<bsdf type='bumpmap'><string name='filename' value='$a.png'/><bsdf type='diffus'/></bsdf>" END;
	static const char *const said[] = {"s.xml:1: <default>: attribute `value`: $a is not defined",
					   "s.xml:3: <translate>: attribute `x`: $b is not defined",
					   "s.xml:3: <ref>: attribute `id`: $c is not defined",
					   "s.xml:4: <bsdf>: attribute `type`: $kind is not defined",
					   "s.xml:2: <float>: <shape type=\"sphere\"> has no `radios`; did you mean",
					   "s.xml:6: <bsdf type=\"diffus\">: there is no bsdf of this type",
					   NULL};
	lists_of(xml, said);
}

/* Files would be searched in vain. */
static void test_paths_without_values(void **state)
{
	(void)state;
	static const char *const said[] = {"s.xml:1: <path>: attribute `value`: $models is not defined", NULL};
	lists_of(S "<path value='$models'/><shape type='spher'/>" END, said);
}

/* Their names and ids are not known: nothing is said of them. */
static void test_files_that_are_not_there(void **state)
{
	(void)state;
	static const char xml[] =
		S "<include filename='gone.xml'/>\n<shape type='sphere'><ref id='gone'/><float name='radius' "
		  "value='$r'/></shape>\n<bsdf type='mask'><include filename='sub/gone.xml'/></bsdf>\n"
		  "<include filename='there.xml'/>" END;
	static const char there[] = S "<shape type='spher'/><include filename='gone2.xml'/>\n"
				      "<alias id='gone' as='another'/><shape type='cub'/>" END;
	const struct memory_file files[] = {
		{"s.xml", xml, sizeof xml - 1}, {"there.xml", there, sizeof there - 1}, {0}};
	static const char *const said[] = {"s.xml:1: <include>: gone.xml",
					   "s.xml:3: <include>: sub/gone.xml",
					   "there.xml:1: <include>: gone2.xml",
					   "there.xml:1: <shape type=\"spher\">: there is no shape",
					   "there.xml:2: <shape type=\"cub\">: there is no shape",
					   NULL};
	lists(files, false, said);
}

/* A file that cannot be read to its end says nevertheless what it lacked until then. */
static void test_files_that_break_off(void **state)
{
	(void)state;
	static const char *const said[] = {"s.xml:1: <include>: gone.xml", "s.xml:2: mismatched tag in <shape>", NULL};
	static const char *const unset[] = {"s.xml:1: <shape>: attribute `type`: $kind is not defined",
					    "s.xml:2: the file ends before </scene>", NULL};
	lists_of(S "<include filename='gone.xml'/>\n<shape type='cube'></scene>", said);
	lists_of(S "<shape type='$kind'/>\n", unset);
}

/* Every duplicate and every alias; what an alias would name is not complained of. */
static void test_ids(void **state)
{
	(void)state;
	static const char xml[] =
		S "<bsdf type='diffuse' id='a'/><bsdf type='diffuse' id='b'/>\n"
		  "<bsdf type='diffuse' id='a'/>\n<bsdf type='diffuse' id='b'/>\n"
		  "<alias id='c' as='d'/><alias id='a' as='e'/><alias id='a' as='b'/>"
		  "<shape type='cube'><ref id='d'/></shape><shape type='cube'><ref id='e'/></shape>" END;
	static const char *const said[] = {"s.xml:2: <bsdf type=\"diffuse\">: the id \"a\" is given twice",
					   "s.xml:3: <bsdf type=\"diffuse\">: the id \"b\" is given twice",
					   "s.xml:4: <alias>: there is no object with id \"c\"",
					   "s.xml:4: <alias>: the id \"b\" is given twice", NULL};
	lists_of(xml, said);
}

/* Objects are looked at also where the one around them is refused, once each. */
static void test_inside_unknown_types(void **state)
{
	(void)state;
	static const char xml[] = S
		"<sensor type='distant'><float name='anything' value='x'/>\n<film type='hdrfilm'><integer name='widht' "
		"value='9'/>\n<integer name='width' value='0'/><rfilter type='gauss'/></film><sampler type='any'/></sensor>\n"
		"<shape type='rock'><ref id='nothing'/><ref id='dull'/>\n<bsdf type='mirorr'><bsdf "
		"type='diffus'/></bsdf></shape>\n<shape type='rock'><bsdf id='dull' type='dul'/></shape>" END;
	const struct memory_file files[] = {{"s.xml", xml, sizeof xml - 1}, {0}};
	static const char *const strict[] = {"s.xml:1: <sensor type=\"distant\">: this sensor of Mitsuba's",
					     "s.xml:2: <integer>: <film type=\"hdrfilm\"> has no `widht`",
					     "s.xml:3: <integer>: width=0 is outside",
					     "s.xml:3: <rfilter type=\"gauss\">: there is no rfilter",
					     "s.xml:4: <shape type=\"rock\">: there is no shape of this type",
					     "s.xml:4: <ref>: there is no object with id \"nothing\"",
					     "s.xml:5: <bsdf type=\"mirorr\">: there is no bsdf of this type",
					     "s.xml:5: <bsdf type=\"diffus\">: there is no bsdf of this type",
					     "s.xml:6: <shape type=\"rock\">: there is no shape of this type",
					     "s.xml:6: <bsdf type=\"dul\">: there is no bsdf of this type",
					     NULL};
	lists(files, false, strict);
	/* What is left out may hold anything. */
	static const char *const lenient[] = {"s.xml:1: <sensor type=\"distant\">: this sensor of Mitsuba's",
					      "s.xml:3: <integer>: width=0 is outside", NULL};
	lists(files, true, lenient);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_names_without_values),	 cmocka_unit_test(test_paths_without_values),
		cmocka_unit_test(test_files_that_are_not_there), cmocka_unit_test(test_ids),
		cmocka_unit_test(test_inside_unknown_types),	 cmocka_unit_test(test_files_that_break_off),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
