/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Random scenes (tests/support/random_scene.h), each by integrators that reach the same light in different ways:
 * pssmlt, hslt, erpt or erpt4, bdpt8 and, unless there are beams whose caustics it cannot find, path, against bdpt; and
 * bdpt with all effects, whether or not the scene needs them. Unlike the other tests of agreement, this one is not
 * limited to cases that somebody thought of.
 *
 * Level: that of tests/support/agreement.h for each comparison. Where groups seldom find something bright, their means
 * are skewed and t is unreliable: a comparison that differs is repeated with other seeds and 16 times the samples, and
 * fails only if it differs again. Power: the row states the bias of the mean that is found with 95 % probability. A
 * plain run has four scenes that need no repetition, one of them with relief and one with fog, and finds only gross
 * errors; HSLT_TEST_ROWS=1 has 24 scenes with 4 times the samples, FULL=1 has 40 with 16 times. SCENES=7 or
 * SCENES=100-200 chooses others.
 */
#include "worker/render/render.h"
#include "tests/numerics/rows.h"
#include "tests/support/agreement.h"
#include "tests/support/random_scene.h"
#include "tests/support/worlds.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

static struct rows rows;

enum { BDPT_SPP = 64 };

static uint64_t sample_factor_of_run(void)
{
	return test_is_full() ? 16 : getenv("HSLT_TEST_ROWS") ? 4 : 1;
}

struct trial {
	char name[32];
	struct random_scene scene;
	/* precise_reference: with 16 times the samples; groups = 0: not rendered yet. */
	struct agreement_image reference, precise_reference;
};

/* side: name of the image; each has random numbers of its own. */
static void render_side(const struct trial *t, const char *side, const char *integrator, uint64_t spp,
			uint64_t sample_factor, struct world *w, struct agreement_image *out)
{
	char test[64];
	snprintf(test, sizeof test, "%s, %llu", t->name, (unsigned long long)sample_factor);
	struct agreement_options options = {integrator, spp * sample_factor_of_run() * sample_factor, 16, 0, 0};
	agreement_render_with_mutations(w, test, side, &options, 8192 * sample_factor_of_run() * sample_factor, NULL,
					out);
}

static void compare_integrator(struct trial *t, const char *side, const char *integrator, uint64_t spp, struct world *w)
{
	static struct agreement_image other;
	struct agreement_difference d;
	char measured[300], title[80];
	snprintf(title, sizeof title, "%s, %s", t->name, side);
	render_side(t, side, integrator, spp, 1, w, &other);
	agreement_measure(&other, &t->reference, &d);
	if (!d.agrees) {
		if (!t->precise_reference.groups)
			render_side(t, "reference", "bdpt", BDPT_SPP, 16, w, &t->precise_reference);
		render_side(t, side, integrator, spp, 16, w, &other);
		agreement_measure(&other, &t->precise_reference, &d);
	}
	snprintf(measured, sizeof measured,
		 "differs from bdpt by %+.2f %% +- %.2f %%; finds %.1f %% of the mean, %.1f %% of a block",
		 100 * d.mean, 100 * d.error, 100 * d.detectable_bias, 100 * d.detectable_block_bias);
	rows_add(&rows, "random scenes", title, measured, "the same image", d.agrees);
	if (!d.agrees)
		printf("%s: %s\n%s\n", t->name, t->scene.materials, t->scene.body);
}

/* In some scenes the only lamp is in a box, or shines away from everything. */
static bool is_black(const struct agreement_image *a)
{
	for (uint32_t g = 0; g < a->groups; g++)
		if (!(a->mean[g][AGREEMENT_CELLS] > 0))
			return true;
	return false;
}

static void compare_scene(uint64_t number)
{
	static struct trial t;
	t.precise_reference.groups = 0;
	snprintf(t.name, sizeof t.name, "%llu", (unsigned long long)number);
	random_scene_make(&t.scene, number, bsdf_cases, BSDF_CASES);
	struct world *w = random_scene_world(&t.scene, 32, 24);
	render_side(&t, "reference", "bdpt", BDPT_SPP, 1, w, &t.reference);
	if (is_black(&t.reference)) {
		printf("random scene %s has next to no light\n", t.name);
		world_free(w);
		return;
	}
	if (!t.scene.needs_light_paths)
		compare_integrator(&t, "path", "path", 128, w);
	compare_integrator(&t, "bdpt8", "bdpt8", 96, w);
	compare_integrator(&t, "pssmlt", "pssmlt", 64, w);
	const char *erpt = number % 2 ? "erpt4" : "erpt";
	compare_integrator(&t, "hslt", "hslt", 64, w);
	compare_integrator(&t, erpt, erpt, 48, w);
	world_free(w);
	worlds_effects = "all";
	w = random_scene_world(&t.scene, 32, 24);
	worlds_effects = NULL;
	compare_integrator(&t, "bdpt with all effects", "bdpt", BDPT_SPP, w);
	world_free(w);
}

static void test_random(void **state)
{
	(void)state;
	const char *scenes = getenv("SCENES");
	bool is_plain = !test_is_full() && !getenv("HSLT_TEST_ROWS");
	uint64_t first = is_plain ? 9 : 0, last = is_plain ? 10 : test_is_full() ? 39 : 23;
	if (scenes)
		random_scene_parse_range(scenes, &first, &last);
	for (uint64_t i = first; i <= last; i++)
		compare_scene(i);
	if (is_plain && !scenes) {
		compare_scene(RANDOM_SCENES_WITH_RELIEF + 1);
		compare_scene(RANDOM_SCENES_WITH_FOG);
	}
	printf("integrators on random scenes: %u comparisons, %u failed\n", rows.cases, rows.failed);
	assert_int_equal(rows.failed, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_random)};
	return cmocka_run_group_tests_name("integrators on random scenes", tests, NULL, NULL);
}
