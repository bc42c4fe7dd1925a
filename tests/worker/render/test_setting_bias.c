/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Settings that must not cause bias, one at a time: mutations leave bdpt's distribution of paths unchanged
 * (tests/support/stationary.h), and images with fewer wavelengths equal those with four (tests/support/agreement.h).
 *
 * Level: 1e-6 per case; power: the smallest bias of a soft quarter of the image that is found with 95 % probability
 * is printed and is at most 2 %. A tolerance as wide as the lobes is found to cause bias. About 25 s of CPU time.
 */
#include "worker/render/render.h"
#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/stationary.h"
#include "tests/worker/render/mutation/scenes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { STARTS = 120, BOOTSTRAP = 1024 };

struct setting_case {
	const char *accuracy, *scene;
	unsigned edges;
	const char *mutation;
};

static const struct setting_case cases[] = {
	{"precision=single", "glossy", 3, "hslt@b3c0"},
	{"precision=single", "rough glass", 4, "hslt@b4c0"},
	{"precision=single", "bent normals", 4, "hslt"},
	{"precision=single", "specular chain", 5, "hslt@b5c0"},
	{"tolerance=0.01", "glossy", 3, "hslt@b3c0"},
	{"tolerance=0.01", "rough glass", 4, "hslt@b4c0"},
	{"tolerance=1e-06", "rough glass", 4, "hslt@b4c0"},
	{"iterations=3", "rough glass", 4, "hslt@b4c0"},
	{"least-step=1", "rough glass", 4, "hslt@b4c0"},
	{"reverse-tolerance=0.1", "rough glass", 4, "hslt@b4c0"},
	{"reverse-tolerance=1e-06", "rough glass", 4, "hslt@b4c0"},
	{"step-scale=0.25", "rough glass", 4, "hslt@b3c0"},
	{"step-scale=4", "glossy", 3, "hslt@b2c0"},
	{"wavelengths=1", "glossy", 3, "hslt"},
	{"wavelengths=2", "rough glass", 4, "hslt"},
	{"wavelengths=1", "dispersion", 4, "wavelength"},
};

static void run_case(const struct setting_case *c, struct stationary_result *r)
{
	struct stationary_options options = {c->mutation, c->edges, c->edges, STARTS, BOOTSTRAP, STATIONARY_NO_FAULT};
	char name[96];
	snprintf(name, sizeof name, "%s %s", c->scene, c->accuracy);
	worlds_accuracy = c->accuracy;
	struct world *w = make_test_world(c->scene);
	worlds_accuracy = NULL;
	assert_non_null(w);
	stationary_run(w, name, &options, r);
	world_free(w);
	print_message(
		"%-24s %-15s k%u %-10s accepts %4.1f %%; finds %.2f %% on a quarter, %.1f %% of vertices; p %.1g %s; %.2f s %s\n",
		c->accuracy, c->scene, c->edges, c->mutation, 100 * (double)r->accepted / (double)r->proposals,
		100 * r->detectable_block_bias, 100 * r->detectable_other_bias, r->p,
		r->worst_function >= 0 ? stationary_function_name(r->worst_function) : "", r->cpu_seconds, r->failure);
}

static void settings_leave_the_distribution_of_paths_unchanged(void **state)
{
	(void)state;
	static struct stationary_result r;
	unsigned wrong = 0;
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		run_case(&cases[i], &r);
		wrong += !stationary_passes(&r) || !r.accepted || (!test_is_scaled() && r.detectable_block_bias > 0.02);
	}
	assert_int_equal(wrong, 0);
}

static void planted_bias_is_found(void **state)
{
	(void)state;
	static struct stationary_result r;
	run_case(&(struct setting_case){"tolerance=1", "rough glass", 4, "hslt@b4c0"}, &r);
	assert_true(test_is_scaled() || !stationary_passes(&r));
}

/* Almost all of the noise comes from drawing wavelengths. */
static void fewer_wavelengths_keep_the_mean(void **state)
{
	(void)state;
	static struct agreement_image image[3];
	static const char *const accuracy[] = {"", "wavelengths=1", "wavelengths=2"};
	for (int i = 0; i < 3; i++) {
		worlds_accuracy = accuracy[i];
		struct world *w = world_from_text(
			8, 8,
			"<integrator type='path'><integer name='max_depth' value='3'/></integrator>" SENSOR(
				"0,1,5", "0,-0.2,0") PLATE("-1", DIFFUSE("0.4,0.6,0.7"))
				BALL("0,-0.2,0", "0.8",
				     METAL("0.4")) "<emitter type='constant'><rgb name='radiance' value='1,0.9,0.8'/></emitter>");
		worlds_accuracy = NULL;
		struct agreement_options options = {"path", 5 << 14, 64, 0, 0};
		agreement_render(w, "wavelengths", *accuracy[i] ? accuracy[i] : "four", &options, &image[i]);
		world_free(w);
	}
	agreement_check("1 wavelength against 4", &image[1], &image[0]);
	agreement_check("2 wavelengths against 4", &image[2], &image[0]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(settings_leave_the_distribution_of_paths_unchanged),
		cmocka_unit_test(planted_bias_is_found),
		cmocka_unit_test(fewer_wavelengths_keep_the_mean),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
