/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The setting `backs`: the appearance of the back of an opaque material without `twosided`, alone, under a mask and
 * in a blend, under a sky of radiance 1, of which a grey of 0.5 reflects one half; the notes about backs that are
 * black, or lit where Mitsuba 0.6 has them black; and two integrators that must agree on a room of rectangles, some of
 * which face away from the light.
 */
#include "tests/support/agreement.h"
#include "tests/support/leases.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 8, SPP = 64 };

#define SKY "<emitter type='constant'><rgb name='radiance' value='1'/></emitter>"
#define GREY "<bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf>"
#define TWO_SIDES "<bsdf type='twosided'>" GREY "</bsdf>"

/* Returns the mean luminance of a rectangle that fills the image. */
static double mean_luminance(const char *accuracy, const char *material, bool back)
{
	worlds_accuracy = accuracy;
	/* clang-format off */
	struct world *w = world_from_text(SIDE, SIDE,
		SKY
		SENSOR("0,0,1", "0,0,0")
		"<shape type='rectangle'>"
			"<transform name='to_world'><scale value='9'/><rotate y='1' angle='%d'/></transform>"
			"%s"
		"</shape>",
		back ? 180 : 0, material);
	/* clang-format on */
	worlds_accuracy = NULL;
	return leases_mean_luminance(w, SIDE, SPP, 2);
}

static void backs_by_material_and_setting(void **state)
{
	(void)state;
	static const struct {
		const char *material;
		double front, lit_back, black_back; /* of the front, and of the back with backs=lit and backs=black */
	} cases[] = {
		{GREY, 0.5, 0.5, 0},
		{TWO_SIDES, 0.5, 0.5, 0.5},
		{"<bsdf type='mask'><float name='opacity' value='0.25'/>" GREY "</bsdf>", 0.875, 0.875, 0.75},
		{"<bsdf type='blendbsdf'><float name='weight' value='0.5'/>" GREY TWO_SIDES "</bsdf>", 0.5, 0.5, 0.25},
		{"<bsdf type='bumpmap'><texture type='checkerboard'/>" GREY "</bsdf>", 0.5, 0.5, 0},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		static const char *const settings[] = {"backs=lit", "backs=black", "backs=auto"};
		for (int k = 0; k < 6; k++) {
			const double back = k % 3 ? cases[i].black_back : cases[i].lit_back;
			double is = mean_luminance(settings[k % 3], cases[i].material, k / 3),
			       expected = k / 3 ? back : cases[i].front;
			print_message("%zu, %s, %s: %.4f of %.4f\n", i, k / 3 ? "back" : "front", settings[k % 3], is,
				      expected);
			assert_true(fabs(is - expected) <= 0.03 * expected); /* 4,096 samples of one bounce */
		}
	}
}

static bool is_noted(const struct world *w, const char *words)
{
	struct render_summary s;
	char sentence[1024];
	bool noted = false;
	world_summary(w, &s);
	for (size_t k = 0; render_scene_note(&s, k, sentence, sizeof sentence); k++)
		noted |= strstr(sentence, words) != NULL;
	return noted;
}

/* The note appears if black backs cover at least one twentieth of the visible surfaces under the file's own rule;
 * lamps, glass and two-sided materials do not count. */
static void one_sided_materials_are_noted(void **state)
{
	(void)state;
	static const struct {
		const char *accuracy, *material;
		double half_width; /* half width of the rectangle; of 1 it covers 9.1 pixels */
		bool back, noted;
	} cases[] = {
		{"backs=auto", GREY, 9, true, true},
		{"backs=auto", GREY, 9, false, false},
		{"backs=black", GREY, 9, true, false},
		{"backs=lit", GREY, 9, true, false},
		{"backs=auto", TWO_SIDES, 9, true, false},
		{"backs=auto", "<bsdf type='mask'><float name='opacity' value='0.25'/>" GREY "</bsdf>", 9, true, false},
		{"backs=auto", "<bsdf type='dielectric'/>", 9, true, false},
		{"backs=auto", "<emitter type='area'/>", 9, true, false},
		{"backs=auto", GREY, 0.1, true, true},
		{"backs=auto", GREY, 0.05, true, false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		worlds_accuracy = cases[i].accuracy;
		/* clang-format off */
		struct world *w = world_from_text(32, 32,
			SKY
			SENSOR("0,0,1", "0,0,0")
			"<shape type='rectangle'>"
				"<transform name='to_world'><scale value='9'/><translate z='-1'/></transform>"
				GREY
			"</shape>"
			"<shape type='rectangle'>"
				"<transform name='to_world'><scale value='%g'/><rotate y='1' angle='%d'/></transform>"
				"%s"
			"</shape>",
			cases[i].half_width, cases[i].back ? 180 : 0, cases[i].material);
		/* clang-format on */
		worlds_accuracy = NULL;
		bool noted = is_noted(w, "black backs of opaque materials");
		if (noted != cases[i].noted)
			fail_msg("case %zu: the note is %sthere", i, noted ? "" : "not ");
		world_free(w);
	}
}

/* In files of 0.5/0.6 backs are lit, which Mitsuba 0.6 does not do; a note says so if the camera sees some, unless the
 * user has chosen. */
static void lit_backs_are_noted(void **state)
{
	(void)state;
	static const struct {
		const char *accuracy, *material;
		bool back, noted;
	} cases[] = {
		{"backs=auto", GREY, true, true},
		{"backs=auto", GREY, false, false},
		{"backs=lit", GREY, true, false},
		{"backs=black", GREY, true, false},
		{"backs=auto", TWO_SIDES, true, false},
		{"backs=auto", "<bsdf type='mask'>" GREY "</bsdf>", true, true},
		{"backs=auto", "<bsdf type='mask'>" TWO_SIDES "</bsdf>", true, false},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		char xml[2048];
		/* clang-format off */
		snprintf(xml, sizeof xml,
			"<scene version='0.6.0'>"
			SKY
			SENSOR("0,0,1", "0,0,0")
			"<shape type='rectangle'>"
				"<transform name='toWorld'><scale value='9'/><rotate y='1' angle='%d'/></transform>"
				"%s"
			"</shape></scene>",
			cases[i].back ? 180 : 0, cases[i].material);
		/* clang-format on */
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
		worlds_accuracy = cases[i].accuracy;
		struct world *w = world_from_files(SIDE, SIDE, files);
		worlds_accuracy = NULL;
		if (is_noted(w, "which Mitsuba 0.6 shows black") != cases[i].noted)
			fail_msg("case %zu: the note is %sthere", i, cases[i].noted ? "not " : "");
		world_free(w);
	}
}

/* A cube is seen from inside, so that all of its sides are backs. The lamp's light arrives by way of the floor, which
 * faces the lamp, of a wall that does not, and of both sides of a screen. */
static void integrators_agree(void **state)
{
	(void)state;
	static struct agreement_image a, b;
	struct agreement_options path = {"path", 1024, 32, 0, 0}, bdpt = {"bdpt", 1024, 32, 0, 0};
	worlds_accuracy = "backs=black";
	struct world *w = world_from_own_scene("backs", "room.xml", 32, 32);
	agreement_render(w, "backs", "path", &path, &a);
	agreement_render(w, "backs", "bdpt", &bdpt, &b);
	agreement_check("backs, bdpt and path", &b, &a);
	world_free(w);
	worlds_accuracy = NULL;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(backs_by_material_and_setting),
		cmocka_unit_test(one_sided_materials_are_noted),
		cmocka_unit_test(lit_backs_are_noted),
		cmocka_unit_test(integrators_agree),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
