/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The setting `media`, and whether a scene's own integrator ignores media: a sky of radiance 1 behind a ball that
 * absorbs nearly all of its light. And the note for a medium around the camera that hides the sky.
 */
#include "tests/support/leases.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 4, SPP = 64 };

#define SKY "<emitter type='constant'><rgb name='radiance' value='1'/></emitter>"
#define SMOKE \
	"<medium type='homogeneous' id='smoke'><float name='sigma_a' value='0.5'/><float name='sigma_s' value='0'/></medium>"
#define BALL(inside) "<shape type='sphere'><float name='radius' value='6'/><bsdf type='null'/>" inside "</shape>"
#define INSIDE(integrator) "<integrator type='" integrator "'/>"

/* Returns the mean luminance of the image. */
static double mean_luminance(const char *accuracy, const char *integrator)
{
	worlds_accuracy = accuracy;
	struct world *w = world_from_text(
		SIDE, SIDE, "%s" SKY SMOKE SENSOR("0,0,9", "0,0,0") BALL("<ref name='interior' id='smoke'/>"),
		integrator);
	worlds_accuracy = NULL;
	return leases_mean_luminance(w, SIDE, SPP, 8);
}

static void test_media_are_left_out_by_setting_and_integrator(void **state)
{
	(void)state;
	static const struct {
		const char *accuracy, *integrator;
		bool is_clear;
	} cases[] = {
		{"media=auto", INSIDE("path"), true},
		{"media=auto", INSIDE("prb"), true},
		{"media=auto", "<integrator type='aov'><integrator type='path'/></integrator>", true},
		{"media=auto",
		 "<integrator type='multichannel'><integrator type='field'/><integrator type='path'/></integrator>",
		 true},
		{"media=auto", "<integrator type='aov'><integrator type='volpath'/></integrator>", false},
		{"media=auto", INSIDE("volpath"), false},
		{"media=auto", INSIDE("bdpt"), false},
		{"media=auto", "", false},
		{"media=shown", INSIDE("path"), false},
		{"media=shown", INSIDE("volpath"), false},
		{"media=none", INSIDE("path"), true},
		{"media=none", INSIDE("volpath"), true},
		{"media=none", "", true},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		double y = mean_luminance(cases[i].accuracy, cases[i].integrator);
		if (cases[i].is_clear ? !(y > 0.9 && y < 1.1) : !(y < 0.1))
			fail_msg("%s with %s: %g", cases[i].accuracy, cases[i].integrator, y);
	}
}

static bool is_noted(const struct world *w)
{
	struct render_summary summary;
	char sentence[512];
	bool noted = false;
	world_summary(w, &summary);
	for (size_t i = 0; render_scene_note(&summary, i, sentence, sizeof sentence); i++)
		noted |= strstr(sentence, "the medium around the camera has no end") != NULL;
	return noted;
}

static void test_media_that_hide_the_sky_are_noted(void **state)
{
	(void)state;
	static const char camera[] = "<sensor type='perspective'><ref name='medium' id='smoke'/></sensor>",
			  clear[] = "<sensor type='perspective'/>";
#define LAMP "<shape type='sphere'><float name='radius' value='0.1'/><emitter type='area'/></shape>"
#define SUN "<emitter type='directional'/>"
	static const struct {
		const char *accuracy, *integrator, *camera, *rest;
		bool noted;
	} cases[] = {
		{NULL, "", camera, LAMP SKY, true},
		{NULL, INSIDE("volpath"), camera, LAMP SUN, true},
		{NULL, INSIDE("path"), camera, LAMP SKY, false}, /* without smoke */
		{"media=shown", INSIDE("path"), camera, LAMP SKY, true},
		{"media=none", INSIDE("volpath"), camera, LAMP SKY, false},
		{NULL, "", camera, LAMP, false},
		{NULL, "", clear, LAMP SKY, false},
		{NULL, "", camera, SKY BALL("<ref name='interior' id='smoke'/>"), false},
		{NULL, "", camera, SKY BALL("<ref name='exterior' id='smoke'/>"), true},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		worlds_accuracy = cases[i].accuracy;
		struct world *w = world_from_text(SIDE, SIDE, "%s" SMOKE "%s%s", cases[i].integrator, cases[i].camera,
						  cases[i].rest);
		worlds_accuracy = NULL;
		if (is_noted(w) != cases[i].noted)
			fail_msg("case %zu: %s", i, cases[i].noted ? "no note" : "a note");
		world_free(w);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_media_are_left_out_by_setting_and_integrator),
		cmocka_unit_test(test_media_that_hide_the_sky_are_noted),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
