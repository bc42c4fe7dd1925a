/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scenes at the limits of the number format, and scenes without light, by every integrator: every value is finite
 * (agreement_render() asserts it), and black scenes stay black.
 */
#include "worker/render/render.h"
#include "tests/support/agreement.h"
#include "tests/support/leases.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define DEPTH(k) "<integrator type='path'><integer name='max_depth' value='" k "'/></integrator>"
#define SKY "<emitter type='constant'><float name='radiance' value='.7'/></emitter>"

enum { INTEGRATORS_MAX = 8 };

/* Runs every integrator briefly and stores the mean of each image in `mean`. */
static void render_with_all_integrators(const char *name, struct world *w, double mean[INTEGRATORS_MAX])
{
	static struct agreement_image image;
	for (size_t i = 0; render_integrator_at(i); i++) {
		const struct integrator_properties *r = render_integrator_at(i);
		struct agreement_options side = {r->name, 32, 16, 0, 0};
		assert_true(i < INTEGRATORS_MAX);
		agreement_render(w, name, r->name, &side, &image);
		mean[i] = 0;
		for (uint32_t g = 0; g < image.groups; g++)
			mean[i] += image.mean[g][AGREEMENT_CELLS] / image.groups;
		assert_true(isfinite(mean[i]) && mean[i] >= 0);
	}
	world_free(w);
}

/* clang-format off */
#define FLOOR                                                                                                          \
	"<shape type='rectangle'>"                                                                                     \
	"	<transform name='to_world'><scale value='2'/><rotate x='1' angle='-90'/></transform>"                  \
	"	<bsdf type='diffuse'><float name='reflectance' value='.5'/></bsdf>"                                    \
	"</shape>"
/* clang-format on */

static void extreme_scenes_render_finite_values(void **state)
{
	(void)state;
	double mean[INTEGRATORS_MAX];
	/* A sun: half a degree, radiance 1e9, 100 units away. */
	render_with_all_integrators(
		"sun",
		world_from_text(
			16, 16,
			DEPTH("4") SENSOR("0,2,4", "0,0,0") FLOOR
			"<shape type='sphere'><point name='center' x='60' y='80' z='0'/><float name='radius' value='.5'/>"
			"<emitter type='area'><float name='radiance' value='1e9'/></emitter></shape>"),
		mean);
	assert_true(mean[0] > 0 && mean[1] > 0);
	/* A light 1e-6 times as large as the scene. */
	render_with_all_integrators(
		"tiny light",
		world_from_text(
			16, 16,
			DEPTH("4") SENSOR("0,2,4", "0,0,0") FLOOR
			"<shape type='sphere'><point name='center' x='0' y='1' z='0'/><float name='radius' value='2e-6'/>"
			"<emitter type='area'><float name='radiance' value='1e12'/></emitter></shape>"),
		mean);
	assert_true(mean[0] > 0 && mean[1] > 0);
	/* Grazing view: the camera lies almost in the floor's plane. */
	render_with_all_integrators(
		"grazing",
		world_from_text(
			16, 16,
			DEPTH("6") SENSOR("0,1e-6,1.9", "0,0,-3") FLOOR SKY
			"<shape type='sphere'><point name='center' x='0' y='.3' z='0'/><float name='radius' value='.3'/>"
			"<bsdf type='roughdielectric'><float name='alpha' value='.01'/></bsdf></shape>"),
		mean);
	assert_true(mean[0] > 0);
	/* Two lights so different that the fainter one is never chosen. */
	render_with_all_integrators(
		"faint light",
		world_from_text(
			16, 16,
			DEPTH("4") SENSOR("0,2,4", "0,0,0") FLOOR
			"<shape type='sphere'><point name='center' x='0' y='.5' z='0'/><float name='radius' value='.5'/>"
			"<emitter type='area'><float name='radiance' value='1e-300'/></emitter></shape>"
			"<shape type='sphere'><point name='center' x='3' y='3' z='0'/><float name='radius' value='.5'/>"
			"<emitter type='area'><float name='radiance' value='1e30'/></emitter></shape>"),
		mean);
	/* A sliver of a mirror and a sliver of a lamp. */
	render_with_all_integrators(
		"slivers",
		world_from_text(
			16, 16,
			DEPTH("6") SENSOR("0,2,4", "0,0,0") FLOOR
			"<shape type='rectangle'><transform name='to_world'><scale x='1' y='1e-6' z='1'/><rotate x='1' angle='90'/>"
			"<translate y='1'/></transform><emitter type='area'><float name='radiance' value='1e6'/></emitter></shape>"
			"<shape type='rectangle'><transform name='to_world'><scale x='1e-6' y='1' z='1'/><translate y='.5'/></transform>"
			"<bsdf type='conductor'/></shape>"),
		mean);
	assert_true(mean[0] > 0);
}

/* No light at all: leases return black, the bootstrap finds no seeds, and chains without a seed stay black. */
static void assert_scene_is_black(const char *text)
{
	struct world *w = world_from_text(16, 16, "%s%s", SENSOR("0,2,4", "0,0,0"), text);
	for (size_t i = 0; render_integrator_at(i); i++) {
		const struct integrator_properties *r = render_integrator_at(i);
		struct plan p = {.kind = r->kind,
				 .width = 16,
				 .height = 16,
				 .crop_width = 16,
				 .crop_height = 16,
				 .groups = 2,
				 .parts = 1,
				 .chains = r->kind == PLAN_CHAINS ? 4 : 0,
				 .bootstrap = 64,
				 .epoch = 16,
				 .rounds = 1,
				 .min_depth = 1,
				 .max_depth = 50};
		struct render_summary summary;
		struct error e = {""};
		snprintf(p.integrator, sizeof p.integrator, "%s", r->name);
		world_summary(w, &summary);
		if (r->has_mutations && render_canonical_mutations(NULL, &summary, p.mutations, &e))
			fail_msg("%s", e.text);
		for (int boot = 0; boot < 2; boot++) {
			const uint64_t seeds[] = {UINT64_MAX, UINT64_MAX};
			struct lease_key k = {1, boot ? LEASE_BOOTSTRAP : LEASE_RENDER, 1, 0, 0};
			struct lease_input in = {.chain_count = 2, .seeds = seeds};
			struct batch b = leases_run(w, &p, k, boot || r->kind == PLAN_SAMPLES ? NULL : &in);
			assert_true(b.independent_sum == 0 && b.tile_count == 0);
			batch_fini(&b);
		}
	}
	world_free(w);
}

static void scenes_without_light_are_black(void **state)
{
	(void)state;
	assert_scene_is_black(FLOOR);
	assert_scene_is_black("");
	assert_scene_is_black(
		FLOOR "<shape type='sphere'><emitter type='area'><float name='radiance' value='0'/></emitter></shape>");
	assert_scene_is_black("<emitter type='constant'><float name='radiance' value='0'/></emitter>");
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(extreme_scenes_render_finite_values),
					   cmocka_unit_test(scenes_without_light_are_black)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
