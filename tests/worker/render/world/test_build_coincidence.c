/* SPDX-License-Identifier: Apache-2.0 */
/* Notes about coinciding shapes: which of two exists and why, by name, and no note where nobody can see the
 * difference; and about shapes that are too small beside others. */
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
#define SHINES "<emitter type='area'><rgb name='radiance' value='1'/></emitter>"
#define RED "<bsdf type='diffuse'><rgb name='reflectance' value='0.5,0.1,0.1'/></bsdf>"
#define GREY "<bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf>"
#define GLASS "<bsdf type='dielectric'/>"
#define HOLES(in) "<bsdf type='mask'>" in "</bsdf>"
/* clang-format off */
#define FLOOR(inside) \
	"<shape type='rectangle' id='floor'>" AT("<rotate x='1' angle='-90'/><scale value='4'/>") inside "</shape>\n"
#define CUBE(id, x, y, inside) \
	"<shape type='cube' id='" id "'>" \
		AT("<scale value='0.5'/><translate x='" x "' y='" y "'/>") \
		inside \
	"</shape>\n"
#define LAMP \
	"<shape type='rectangle' id='lamp'>" \
		AT("<scale value='0.3'/><translate z='0.5' y='0.5'/>") \
		SHINES \
	"</shape>\n"
/* clang-format on */
#define VIEW SENSOR("0,3,8", "0,0,0") "\n"

/* Expects the notes `first` and `second`; NULL: no such note. looks_up: whether rays must look coinciding primitives
 * up. */
static void expect_notes(const char *text, const char *first, const char *second, bool looks_up)
{
	struct world *w = world_from_text(8, 8, "%s", text);
	struct render_summary s;
	const char *wanted[3] = {first, second, NULL};
	char note[512];
	size_t i = 0;
	world_summary(w, &s);
	for (; render_scene_note(&s, i, note, sizeof note); i++) {
		assert_true(i < 2);
		if (!wanted[i])
			fail_msg("%s", note);
		assert_string_equal(note, wanted[i]);
	}
	assert_null(wanted[i]);
	assert_int_equal(render_effect_is_on(&s, "coincidence"), looks_up);
	world_free(w);
}

static void test_coincident_shapes_are_noted(void **state)
{
	(void)state;
	expect_notes(VIEW FLOOR(GREY) CUBE("block", "2", "0.6", GREY) LAMP, NULL, NULL, false);
	expect_notes(VIEW CUBE("glass", "0", "0.5", GLASS) LAMP,
		     "`glass` (test.xml:2) coincides with `lamp` (test.xml:3), which shines and hides it where they "
		     "overlap",
		     NULL, true);
	expect_notes(
		VIEW CUBE("glass", "0", "0.5", GLASS) FLOOR(GREY),
		"`glass` (test.xml:2) coincides with `floor` (test.xml:3), which is opaque and hides it where they "
		"overlap",
		NULL, true);
	expect_notes(
		VIEW CUBE("glass", "0", "0.5", GLASS) CUBE("ice", "1", "0.5", GLASS)
			CUBE("hole", "-1", "0.5", "<bsdf type='null'/>"),
		"`ice` (test.xml:3) coincides with `glass` (test.xml:2), which comes first in the file and hides it "
		"where they overlap; where two media touch, use one surface with the int_ior and ext_ior of both",
		"`hole` (test.xml:4) coincides with `glass` (test.xml:2), which refracts or scatters and hides it "
		"where they overlap",
		true);
	/* Glass with holes counts as glass; an opaque sheet with holes does not. */
	expect_notes(
		VIEW CUBE("lace", "0", "0.5", HOLES(GLASS)) CUBE("glass", "1", "0.5", GLASS)
			CUBE("net", "-1", "0.5", HOLES(GREY)),
		"`glass` (test.xml:3) coincides with `lace` (test.xml:2), which comes first in the file and hides it "
		"where they overlap; where two media touch, use one surface with the int_ior and ext_ior of both",
		"`net` (test.xml:4) coincides with `lace` (test.xml:2), which refracts or scatters and hides it "
		"where they overlap",
		true);
	/* Of two lamps back to back only one exists, which emits towards its own side; a lamp that is there twice
	 * loses no light. */
	expect_notes(
		VIEW LAMP "<shape type='rectangle' id='back'>" AT(
			"<scale value='0.3'/><rotate y='1' angle='180'/><translate z='0.5' y='0.5'/>") SHINES
		"</shape>\n",
		"`back` (test.xml:3) coincides with `lamp` (test.xml:2), which comes first in the file and hides it "
		"where they overlap; light to the other side is lost: for a lamp with two sides use two surfaces, "
		"slightly apart",
		NULL, true);
	expect_notes(
		VIEW LAMP "<shape type='rectangle' id='twin'>" AT("<scale value='0.3'/><translate z='0.5' y='0.5'/>")
			SHINES "</shape>\n",
		"`twin` (test.xml:3) coincides with `lamp` (test.xml:2), which comes first in the file and hides it "
		"where they overlap",
		NULL, true);
	/* A block on a floor hides the coinciding part of the floor, so there is no note; a picture in the plane of a
	 * wall is visible, so there is one. */
	expect_notes(VIEW FLOOR(GREY) CUBE("block", "0", "0.5", RED), NULL, NULL, true);
	expect_notes(
		VIEW FLOOR(GREY) "<shape type='rectangle'>" AT("<rotate x='1' angle='-90'/>") RED "</shape>",
		"the rectangle in test.xml:3 coincides with `floor` (test.xml:2), which comes first in the file and "
		"hides it where they overlap",
		NULL, true);
}

/* The ratio of sizes from which on double precision does not suffice for both shapes. */
static void test_extreme_size_ratios_are_noted(void **state)
{
	(void)state;
	for (int far = 0; far < 2; far++) {
		struct world *w = world_from_text(8, 8,
						  VIEW CUBE("block", "0", "0.6", GREY) "<shape type='rectangle'>" AT(
							  "<rotate x='1' angle='-90'/><scale value='%s'/>") "</shape>",
						  far ? "1e13" : "1e12");
		struct render_summary s;
		char note[512];
		world_summary(w, &s);
		assert_int_equal(render_scene_note(&s, 0, note, sizeof note), far);
		if (far)
			assert_string_equal(
				note,
				"`block` (test.xml:2) is too small for a scene with the rectangle in test.xml:3: double precision does "
				"not suffice for both, and its image may be wrong");
		world_free(w);
	}
}

/* Of many pairs, only a few are named; a last note counts the rest. */
static void test_only_a_few_of_many_pairs_are_named(void **state)
{
	(void)state;
	char text[8192] = VIEW FLOOR(GREY), note[512];
	for (int i = 0; i < 20; i++) {
		size_t used = strlen(text);
		snprintf(text + used, sizeof text - used,
			 "<shape type='cube'>" AT("<scale value='0.1'/><translate x='%d' y='0.1'/>") GLASS "</shape>\n",
			 i - 30);
		if (i >= 10)
			continue;
		used = strlen(text);
		snprintf(text + used, sizeof text - used,
			 "<shape type='cube'>" AT("<scale value='0.1'/><translate x='%g' z='2' y='0.1'/>") GLASS
			 "</shape>\n",
			 0.3 * i);
	}
	struct world *w = world_from_text(8, 8, "%s", text);
	struct render_summary s;
	size_t i = 0;
	world_summary(w, &s);
	while (render_scene_note(&s, i, note, sizeof note))
		i++;
	assert_int_equal(i, COINCIDENCE_NOTES_MAX + 1);
	assert_true(render_scene_note(&s, COINCIDENCE_NOTES_MAX, note, sizeof note));
	assert_string_equal(note, "2 more pairs of shapes coincide");
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_coincident_shapes_are_noted),
					   cmocka_unit_test(test_extreme_size_ratios_are_noted),
					   cmocka_unit_test(test_only_a_few_of_many_pairs_are_named)};
	return cmocka_run_group_tests_name("what is said of coinciding surfaces", tests, NULL, NULL);
}
