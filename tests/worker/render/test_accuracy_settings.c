/* SPDX-License-Identifier: Apache-2.0 */
/* Settings that trade accuracy for time: the spelling in a plan is read back unchanged, every other one is refused,
 * and each setting reaches the code that it controls. */
#include "tests/support/worlds.h"
#include "worker/render/render.h"
#include "worker/render/halfvec/walk.h"
#include "worker/render/settings/accuracy_settings.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

static const char *canonical_text(const char *text)
{
	static char out[PLAN_ACCURACY_MAX];
	struct error e = {""};
	if (accuracy_settings_canonicalize(text, out, &e))
		fail_msg("'%s': %s", text ? text : "NULL", e.text);
	return out;
}

static void settings_have_one_canonical_spelling(void **state)
{
	(void)state;
	static const char *const cases[][2] = {
		{NULL, ""},
		{"", ""},
		{"tolerance=1e-3", ""},
		{"tolerance=0.00001", "tolerance=1e-05"},
		{"iterations=30,tolerance=1e-4", "tolerance=0.0001,iterations=30"}, /* in the order of the list */
		{"tolerance=1e-5,tolerance=1e-4", "tolerance=0.0001"},
		{"tolerance=1e-5,tolerance=.001", ""},
		{"step-scale=0.33333333", "step-scale=0.333333"},
		{"iterations=3e1", "iterations=30"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		assert_string_equal(canonical_text(cases[i][0]), cases[i][1]);
}

/* A text and its canonical form mean the same, and the longest text fits into a plan. */
static void longest_settings_fit_into_a_plan(void **state)
{
	(void)state;
	char all[2 * PLAN_ACCURACY_MAX] = "", once[PLAN_ACCURACY_MAX], twice[PLAN_ACCURACY_MAX];
	const struct render_setting *k;
	struct accuracy_settings a, b;
	size_t used = 0;
	for (size_t i = 0; (k = render_setting_at(i)) != NULL; i++) {
		double value = k->min + (k->max - k->min) * 1.23456789e-5;
		if (k->kind == SETTING_REAL)
			used += (size_t)snprintf(all + used, sizeof all - used, "%s%s=%.17g", i ? "," : "", k->name,
						 value);
		else
			used += (size_t)snprintf(all + used, sizeof all - used, "%s%s=%s", i ? "," : "", k->name,
						 k->sweep[0]		     ? k->sweep[1]
						 : k->kind == SETTING_CHOICE ? strrchr(k->choices, ' ') + 1
									     : "1000");
	}
	assert_int_equal(accuracy_settings_read(all, &a, NULL), 0);
	assert_int_equal(accuracy_settings_canonicalize(all, once, NULL), 0);
	assert_int_equal(accuracy_settings_read(once, &b, NULL), 0);
	assert_memory_equal(&a, &b, sizeof a);
	assert_int_equal(accuracy_settings_canonicalize(once, twice, NULL), 0);
	assert_memory_equal(once, twice, sizeof once); /* the bytes after the text are zero as well */
	assert_true(strlen(once) + 8 < sizeof once);
	assert_true(plan_text_is_valid(once, sizeof once));
	size_t entries = 1;
	for (const char *at = once; *at; at++)
		entries += *at == ',';
	for (size_t i = 0; (k = render_setting_at(i)) != NULL; i++)
		entries--;
	assert_int_equal(entries, 0);
}

static void each_setting_is_listed_with_its_default(void **state)
{
	(void)state;
	const struct render_setting *k;
	for (size_t i = 0; (k = render_setting_at(i)) != NULL; i++) {
		char value[40], entry[80];
		assert_true(k->default_value >= k->min && k->default_value <= k->max);
		assert_true(strlen(k->summary) > 20);
		accuracy_settings_print_value(&accuracy_settings_default, i, value, sizeof value);
		snprintf(entry, sizeof entry, "%s=%s", k->name, value);
		assert_string_equal(canonical_text(entry), "");
		bool has_default = false;
		for (size_t s = 0; k->sweep[s]; s++) {
			snprintf(entry, sizeof entry, "%s=%s", k->name, k->sweep[s]);
			const char *got = canonical_text(entry);
			has_default |= !*got;
			assert_true(!*got || strcmp(got, entry) == 0);
		}
		assert_true(!k->sweep[0] || (has_default && k->sweep[1]));
	}
}

static void assert_refused(const char *text, const char *reason)
{
	char out[PLAN_ACCURACY_MAX];
	struct error e = {""};
	assert_int_equal(accuracy_settings_canonicalize(text, out, &e), -EINVAL);
	if (!strstr(e.text, reason))
		fail_msg("'%s': \"%s\" does not say \"%s\"", text, e.text, reason);
}

static void other_spellings_are_refused(void **state)
{
	(void)state;
	static const char *const texts[] = {",",
					    "tolerance",
					    "tolerance=",
					    "=1",
					    "tolerance=1e-3,",
					    ",tolerance=1e-3",
					    "tolerance=nan",
					    "tolerance=inf",
					    "tolerance=-1",
					    "tolerance=1x",
					    "tolerance= 1",
					    "tolerance=1=1",
					    "Tolerance=1",
					    "iterations=1.5",
					    "iterations=0",
					    "iterations=1e300"};
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
		assert_refused(texts[i], "");
	assert_refused("tolerence=1e-3", "did you mean `tolerance`?");
	assert_refused("tolerance=2", "tolerance is 1e-09 to 1, not '2'");
	assert_refused("iterations=0", "a whole number from 1 to 1000");
	assert_refused("xyzzy=1", "there are tolerance, iterations");
	char longest[3000];
	memset(longest, 'a', sizeof longest - 1);
	longest[sizeof longest - 1] = 0;
	assert_refused(longest, "NAME=VALUE");
}

static void settings_reach_the_walk_limits(void **state)
{
	(void)state;
	struct accuracy_settings k;
	assert_int_equal(
		accuracy_settings_read("tolerance=1e-5,iterations=7,least-step=.5,reverse-tolerance=.25", &k, NULL), 0);
	struct walk_limits l = walk_limits_of(&k);
	assert_int_equal(l.max_iterations, 7);
	assert_true(l.tolerance == 1e-5 && l.min_step == 0.5 && l.reverse_tolerance == 0.25 && l.tolerance_scale == 1);
}

/* Returns the BSDF of a world's only shape. */
static const struct bsdf *material_of_world(const char *accuracy, const char *bsdf, struct world **w)
{
	worlds_accuracy = accuracy;
	*w = world_from_text(8, 8, SENSOR("0,0,3", "0,0,0") "<emitter type='constant'/><shape type='sphere'>%s</shape>",
			     bsdf);
	worlds_accuracy = NULL;
	return &(*w)->bsdfs[(*w)->shape_bindings[0].bsdf];
}

static void roughness_setting_reaches_materials(void **state)
{
	(void)state;
	static const char *const rough[] = {
		"<bsdf type='roughconductor'><string name='material' value='Au'/><float name='alpha' value='0.05'/></bsdf>",
		"<bsdf type='roughdielectric'><float name='int_ior' value='1.5'/><float name='alpha' value='0.05'/></bsdf>",
		"<bsdf type='twosided'><bsdf type='roughconductor'><float name='alpha' value='0.05'/></bsdf></bsdf>",
	};
	for (size_t i = 0; i < sizeof rough / sizeof *rough; i++) {
		struct world *w;
		const struct bsdf *b = material_of_world("roughness=0.05", rough[i], &w);
		assert_true(b->has_smooth && !b->has_delta && b->min_alpha == 0.05);
		assert_true(w->effects.glossy && !w->effects.specular);
		world_free(w);
		b = material_of_world("roughness=0.051", rough[i], &w);
		assert_true(!b->has_smooth && b->has_delta && b->min_alpha == 0);
		assert_true(!w->effects.glossy && w->effects.specular);
		const struct wavelengths wl = wavelengths_sample(0.3);
		const struct bsdf_point p = {.texture_point = {.u = 0.5, .v = 0.5}, .wavelengths = &wl};
		vec3 wo = {0, 0.6, 0.8}, wi;
		double chance;
		spectrum f = bsdf_eval_delta(b, &p, wo, BSDF_REFLECT, &wi, &chance);
		assert_true(f.v[0] > 0.01 && f.v[0] <= 1 && wi.y == -wo.y && wi.z == wo.z);
		world_free(w);
	}
}

static void tessellation_setting_reaches_shapes(void **state)
{
	(void)state;
	static const struct {
		const char *accuracy;
		uint64_t triangles;
	} cases[] = {{"", 8 * 64},
		     {"tessellation=0.5", 8 * 16},
		     {"tessellation=2", 8 * 256},
		     {"tessellation=0.375", 8 * 9},
		     {"tessellation=0.001", 8}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct render_summary summary;
		worlds_accuracy = cases[i].accuracy;
		/* clang-format off */
		struct world *w = world_from_text(8, 8,
			SENSOR("0,0,3", "0,0,0")
			"<shape type='sphere'>"
				"<texture type='checkerboard' name='displacement'/>"
				"<integer name='displacement_level' value='3'/>"
				"<float name='displacement_scale' value='0.01'/>"
			"</shape>");
		/* clang-format on */
		worlds_accuracy = NULL;
		world_summary(w, &summary);
		assert_int_equal(summary.triangles, cases[i].triangles);
		world_free(w);
	}
}

/* A lease refuses a world built with other settings than the plan's. */
static void lease_refuses_a_world_of_other_settings(void **state)
{
	(void)state;
	worlds_accuracy = "tolerance=1e-05";
	struct world *w = world_from_text(8, 8, SENSOR("0,0,3", "0,0,0") "<shape type='sphere'/>");
	worlds_accuracy = NULL;
	struct plan_request r = {.integrator = "path",
				 .kind = PLAN_SAMPLES,
				 .width = 8,
				 .height = 8,
				 .border = w->settings.border,
				 .spp = 16,
				 .min_depth = 1,
				 .max_depth = 2,
				 .groups = 16};
	for (int same = 0; same < 2; same++) {
		struct plan p;
		struct error e = {""};
		enum lease_outcome end;
		struct batch b;
		snprintf(r.accuracy, sizeof r.accuracy, "%s", same ? "tolerance=1e-05" : "");
		assert_int_equal(plan_make(&r, &p, &e), 0);
		const struct lease_key k = {1, LEASE_RENDER, 0, 0, 0};
		int rc = render_lease(w, &p, &k, NULL, NULL, &end, &b, &e);
		assert_int_equal(rc, same ? 0 : -EINVAL);
		if (same)
			batch_fini(&b);
		else
			assert_non_null(strstr(e.text, "tolerance=1e-05"));
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(settings_have_one_canonical_spelling),
		cmocka_unit_test(longest_settings_fit_into_a_plan),
		cmocka_unit_test(each_setting_is_listed_with_its_default),
		cmocka_unit_test(other_spellings_are_refused),
		cmocka_unit_test(settings_reach_the_walk_limits),
		cmocka_unit_test(roughness_setting_reaches_materials),
		cmocka_unit_test(tessellation_setting_reaches_shapes),
		cmocka_unit_test(lease_refuses_a_world_of_other_settings),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
