/* SPDX-License-Identifier: Apache-2.0 */
/* The rule that chooses an integrator from the figures of a pilot, and the sentence that gives the reason; against a
 * table written by hand. */
#include "worker/render/choose_integrator.h"
#include "worker/render/render.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

static void rule_follows_the_table(void **state)
{
	(void)state;
	enum { FLAT, FOCUSES, MISSES };
	static const struct {
		double path[6], bdpt[6]; /* cost, rare, tail, extreme, extreme-value index, most */
		int scene;
		const char *name;
		bool settled;
	} cases[] = {
		{{1, 0, 4, 4, 1, 0}, {2, 0, 3, 3, 1, 0}, FLAT, "path", false},
		{{1, 0, 4, 4, 1, 0}, {2, 0, 3, 3, 1, 0}, FOCUSES, "bdpt8", false}, /* focused light may be rare */
		{{1, 0, 2.2, 2.2, 1, 0.02}, {2, 0, 3, 3, 1, 0}, FLAT, "path", false},
		{{1, 0, 4, 4, 1, 0.04}, {2, 0, 3, 3, 1, 0}, FLAT, "erpt4", false}, /* a firefly among the samples */
		{{1, 0, 4, 4, 1, 0.04}, {2, 0, 3, 3, 1, 0}, FOCUSES, "erpt4", false},
		{{2.1, 0, 3, 3, 1, 0}, {2, 0, 3, 3, 1, 0}, FLAT, "erpt", false},
		{{0, 0, 4, 4, 1, 0},
		 {0, 0, 3, 3, 1, 0},
		 FLAT,
		 "path",
		 false}, /* the same in every sample, as in a furnace */
		{{1, 0, 1.9, 1.5, 1, 0}, {INFINITY, 0, 1, 1, 1, 0}, FLAT, "erpt", true}, /* better but for its tail */
		{{1, 0, 1.9, 1.5, 1, 0.5}, {INFINITY, 0, 1, 1, 1, 0}, FLAT, "erpt", true},
		{{1, 0, 4, 4, 1, 0}, {2, 0, 1.5, 1.5, 1, 0}, FLAT, "path", false},
		{{1, 0.9, 0.5, 0.5, 1, 0},
		 {2, 0, 3, 3, 1, 0},
		 FOCUSES,
		 "erpt",
		 false}, /* bdpt finds what path misses */
		{{1, 0, 4, 4, 1, 0}, {2, 0.9, 0.5, 0.5, 1, 0}, FOCUSES, "erpt", false},	       /* path never meets it */
		{{1, 0.2, 3.5, 1.5, 1, 0}, {5, 0.04, 2, 0.6, 1, 0}, FOCUSES, "erpt", false},   /* one of them by luck */
		{{1, 0.2, 3.5, 1.5, 1, 0}, {5, 0.04, 1, 1.05, 1, 0}, FOCUSES, "bdpt8", false}, /* with a bounded tail */
		{{1, 0.5, 1.1, 1.1, 1, 0}, {2, 0.25, 1.4, 1.8, 1, 0}, FOCUSES, "erpt", false}, /* rare for path only */
		{{1, 0.35, 1.4, 1.7, 1, 0}, {5, 0.3, 1.26, 1.95, 1, 0}, FOCUSES, "erpt", false}, /* but it has a mean */
		{{1, 0.35, 1.4, 0.7, 1, 0}, {5, 0.3, 1.24, 1.95, 1, 0}, FOCUSES, "hslt", false}, /* not for certain */
		{{1, 0.35, 1.4, 0.7, 1, 0}, {5, 0.3, 1.26, 1.95, 1, 0}, FOCUSES, "erpt", false},
		{{1, 0.35, 1.4, 1.1, 1, 0},
		 {5, 0.3, 1.24, 1.95, 1, 0},
		 FOCUSES,
		 "erpt",
		 false}, /* path is lucky enough */
		{{1, 0.5, 0.5, 0.9, 1, 0}, {2, 0.5, 0.5, 3, 1, 0}, FOCUSES, "hslt", false},
		{{1, 0.5, 0.5, 0.9, 1, 0}, {2, 0.1, 0.5, 0.5, 1, 0}, FOCUSES, "erpt", false},
		{{1, 0, 0.5, 0.6, 1, 0}, {2, 0.9, 0.3, 0.4, 1, 0}, FOCUSES, "hslt", false},	  /* by path: no mean */
		{{1, 0.07, 1.6, 1.7, 1, 0}, {600, 0.5, 1.2, 0.75, 1, 0}, FOCUSES, "erpt", false}, /* by path: a mean */
		{{1, 0.1, 1.5, 0.7, 1, 0}, {2, 0.1, 1.5, 0.7, 1, 0}, FOCUSES, "erpt", false},	  /* too little light */
		{{1, 0.1, 1.5, 0.7, 1, 0}, {2, 0.1, 1.5, 1.2, 1, 0}, FOCUSES, "erpt", false},	  /* bdpt has a mean */
		{{1, 0.1, 1.5, 0.5, 1, 0},
		 {2, 0.1, 1.5, 1.0, 1, 0},
		 FOCUSES,
		 "erpt",
		 false}, /* however heavy the other tail */
		{{1, 0.06, 1.5, 0.7, 1, 0},
		 {2, 0.01, 1.5, 0.7, 1, 0},
		 FOCUSES,
		 "erpt",
		 false}, /* nearly all light is found */
		{{1, 0, 1.1, 1.9, 0.3, 0}, {2, 0, 1.9, 2, 1, 0}, FOCUSES, "erpt4", false}, /* a bounded range */
		{{1, 0, 2, 4, 0.3, 0}, {2, 0, 3, 3, 0.1, 0}, FLAT, "erpt4", false},	   /* bounded, but never path */
		{{1, 0, 1.1, 1.9, 0.6, 0}, {2, 0, 1.9, 2, 0.1, 0}, FLAT, "erpt", true},
		{{2.1, 0, 1.1, 1.9, 0.3, 0}, {2, 0, 1.9, 2, 1, 0}, FLAT, "erpt", false},
		{{1, 0, 0.9, 1.9, 0.3, 0}, {2, 0, 1.9, 2, 1, 0}, FLAT, "erpt4", false},
		{{1, 0, 2.2, 1.9, 0.6, 0}, {2, 0, 1.9, 2, 1, 0}, FLAT, "path", false}, /* one of the two is enough */
		{{1, 0, 1.1, 1.9, 0.3, 0}, {2, 0, 1.9, 2, 1, 0}, MISSES, "erpt", false},
		{{INFINITY, 0, 1, 1, 1, 0}, {INFINITY, 0, 1, 1, 1, 0}, MISSES, "hslt", false},
		{{1, 0.05, 1.1, 1.9, 0.3, 0}, {2, 0, 1.9, 2, 0.1, 0}, FLAT, "erpt", false}, /* rare light: no bound */
		{{1, 0, 4, 4, 1, 0}, {2, 0, 3, 3, 1, 0}, MISSES, "erpt", false}, /* missed light is not in it */
		{{1, 0, 1.9, 1.5, 1, 0}, {2, 0, 3, 3, 1, 0}, MISSES, "erpt", false},
		{{1, 0, 3, 3, 1, 0}, {2, 0.9, 0.5, 0.9, 1, 0}, MISSES, "hslt", false}, /* path's figures do not count */
		{{1, 0, 0.3, 0.3, 1, 0}, {2, 0.9, 0.5, 3, 1, 0}, MISSES, "erpt", false},
		{{INFINITY, 0, 1, 1, 1, 0}, {1, 0, 3, 3, 1, 0}, MISSES, "erpt", false}, /* bdpt finds all light */
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		const double *p = cases[i].path, *b = cases[i].bdpt;
		struct render_choice c = {.path = {p[0], p[1], p[2], p[3], p[4], p[5]},
					  .bdpt = {b[0], b[1], b[2], b[3], b[4], b[5]},
					  .path_misses_light = cases[i].scene == MISSES,
					  .has_narrow_lobes = cases[i].scene != FLAT};
		assert_string_equal(render_choice_integrator(&c), cases[i].name);
		assert_int_equal(render_choice_is_settled(&c), cases[i].settled);
		c.has_emitting_media = true; /* emitting media: the next best */
		assert_string_equal(render_choice_integrator(&c),
				    strcmp(cases[i].name, "hslt") ? cases[i].name : "erpt");
	}
}

/* In half of the brief pilots of the demo scene no sample is a firefly; and bdpt8 takes five times as long as erpt4
 * for a lamp behind frosted glass that the pilot missed. */
static void brief_pilots_and_glass_need_erpt4(void **state)
{
	(void)state;
	struct render_choice c = {.path = {1, 0, 4, 4, 1, 0}, .bdpt = {2, 0, 3, 3, 1, 0}, .has_narrow_lobes = true};
	assert_string_equal(render_choice_integrator(&c), "bdpt8");
	c.has_transmission = true;
	assert_string_equal(render_choice_integrator(&c), "erpt4");
	c.has_transmission = false;
	c.is_brief = true;
	assert_string_equal(render_choice_integrator(&c), "erpt4");
	c.has_narrow_lobes = false;
	assert_string_equal(render_choice_integrator(&c), "path");
}

/* A point light and a mirror ball in a room: one sample in four with a light sub-path suffices for the little light
 * that path cannot find. */
static void little_light_that_path_misses_needs_few_light_subpaths(void **state)
{
	(void)state;
	const struct render_choice easy = {.path = {1, 0, 4, 4, 1, 0},
					   .bdpt = {2, 0, 3, 3, 1, 0},
					   .found_fraction = 0.98,
					   .path_misses_light = true,
					   .has_narrow_lobes = true};
	struct render_choice c = easy;
	assert_string_equal(render_choice_integrator(&c), "erpt4");
	c.found_fraction = 0.85; /* more light is missed */
	assert_string_equal(render_choice_integrator(&c), "erpt");
	c = easy;
	c.bdpt.tail_index = 1.9; /* the found light is uneven */
	assert_string_equal(render_choice_integrator(&c), "erpt");
	c = easy;
	c.bdpt.largest_share = 0.04; /* one of its samples is a firefly */
	assert_string_equal(render_choice_integrator(&c), "erpt");
	c = easy;
	c.path.cost = 2.1; /* all of the light is as costly */
	assert_string_equal(render_choice_integrator(&c), "erpt");
}

/* The shares decide, whatever the other figures say; a share as small as in scenes where bdpt is the best does not. */
static void light_that_is_rare_by_merging_needs_chains(void **state)
{
	(void)state;
	struct render_choice c = {.path = {1, 0, 4, 4, 1, 0}, .bdpt = {2, 0, 3, 3, 1, 0}, .has_narrow_lobes = true};
	for (int i = 0; i < 2; i++) {
		c.merging.rare_share = 0.008;
		assert_string_equal(render_choice_integrator(&c), i ? "erpt" : "bdpt8");
		assert_int_equal(render_choice_is_settled(&c), i);
		c.merging.rare_share = 0.05;
		assert_string_equal(render_choice_integrator(&c), "erpt");
		assert_true(render_choice_is_settled(&c));
		c.path.extreme_tail_index = 0.9;
		assert_string_equal(render_choice_integrator(&c), "hslt");
		c.path.extreme_tail_index = 4;
		c.path_misses_light = true;
		assert_string_equal(render_choice_integrator(&c), "hslt");
		c.path_misses_light = false;
		c.path.tail_index = 1.5;
	}
}

/* Light that is rare for path is not rare for bdpt where photons find most of the light and merging finds hardly any
 * rare light. */
static void light_that_photons_see_is_not_rare(void **state)
{
	(void)state;
	static const struct {
		double share, seen, bdpt_rare;
		const char *name;
	} cases[] = {{0.005, 0.6, 0.05, "erpt"},
		     {0.005, 0.1, 0.05, "erpt"}, /* few photons arrive, but bdpt finds all light */
		     {0.02, 0.6, 0.05, "erpt"},
		     {0.005, 0.6, 0.5, "hslt"}}; /* rare by bdpt's own samples */
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct render_choice c = {.path = {1, 0.9, 0.5, 0.5, 1, 0},
					  .bdpt = {2, cases[i].bdpt_rare, 0.9, 0.8, 1, 0},
					  .merging = {cases[i].share, cases[i].seen},
					  .has_narrow_lobes = true};
		assert_string_equal(render_choice_integrator(&c), cases[i].name);
		c.bdpt = (struct render_measurement){2, 0, 3, 3, 1, 0};
		c.path_misses_light = c.path_is_dark = true;
		assert_string_equal(render_choice_integrator(&c),
				    cases[i].share < 0.01 && cases[i].seen > 0.5 ? "erpt" : "hslt");
	}
}

/* Where path alone settles the choice, no figures of bdpt change it. */
static void settled_choice_ignores_figures_of_bdpt(void **state)
{
	(void)state;
	static const double costs[] = {0, 1, INFINITY}, shares[] = {0, 0.1, 0.9}, tails[] = {0.3, 1.5, 4};
	for (int i = 0; i < 81; i++) {
		struct render_choice c = {
			.path = {1, 0.02, 1.9, 0.9, 1, 0},
			.bdpt = {costs[i % 3], shares[i / 3 % 3], tails[i / 9 % 3], tails[i / 27 % 3], 1, 0}};
		assert_true(render_choice_is_settled(&c));
		assert_string_equal(render_choice_integrator(&c), "erpt");
	}
}

/* The sentence is for people; the figures are in the JSON. */
static void the_reason_is_a_sentence_without_figures(void **state)
{
	(void)state;
	static const struct {
		const char *integrator;
		struct render_choice c;
		const char *says;
	} of[] = {
		{"path", {.path = {1, 0, 4, 4, 0, 0}}, "find the light evenly, and no surface focuses it"},
		{"bdpt8",
		 {.path = {1, 0, 4, 4, 0, 0}, .has_narrow_lobes = true},
		 "one sample in eight also starts at the lamps"},
		{"erpt4", {.path = {1, 0, 1.2, 2, 0.3, 0}}, "one sample in four also starts at the lamps"},
		{"erpt4", {.path = {1, 0, 4, 4, 0, 0}, .path_misses_light = true}, "a little that they cannot find"},
		{"erpt", {.path = {1, 0, 4, 4, 0, 0}}, "less noise in the same time"},
		{"erpt", {.path = {1, 0, 1.5, 1.5, 1, 0}, .is_settled = true}, "leave fireflies"},
		{"erpt", {.path = {1, 0, 4, 4, 0, 0}, .path_misses_light = true}, "cannot find all light"},
		{"hslt", {.path = {INFINITY, 0, 1, 1, 1, 0}}, "next to no light"},
		{"hslt", {.path = {1, 0.9, 0.5, 0.5, 1, 0}}, "few, very bright paths"},
	};
	for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
		char text[512], shortest[8];
		render_choice_text(of[i].integrator, &of[i].c, text, sizeof text);
		assert_non_null(strstr(text, of[i].says));
		assert_int_equal(strncmp(text, of[i].integrator, strlen(of[i].integrator)), 0);
		assert_null(strpbrk(text + strlen(of[i].integrator), "0123456789%"));
		render_choice_text(of[i].integrator, &of[i].c, shortest, sizeof shortest);
		assert_int_equal(strlen(shortest), sizeof shortest - 1);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rule_follows_the_table),
		cmocka_unit_test(brief_pilots_and_glass_need_erpt4),
		cmocka_unit_test(little_light_that_path_misses_needs_few_light_subpaths),
		cmocka_unit_test(light_that_is_rare_by_merging_needs_chains),
		cmocka_unit_test(light_that_photons_see_is_not_rare),
		cmocka_unit_test(settled_choice_ignores_figures_of_bdpt),
		cmocka_unit_test(the_reason_is_a_sentence_without_figures),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
