/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The default integrator against bdpt on whole scenes: the project's, and the public ones if HSLT_SCENES names their
 * folder. Both must agree within their errors, at one level for all comparisons together; the smallest bias that would
 * have been found is printed. FULL=1: all scenes, with more samples.
 */
#include "worker/render/render.h"
#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 48, HEIGHT = 27, DEPTH = 12, GROUPS = 32 };

static void compare_integrators(const char *name, struct world *w, uint64_t bdpt_spp, uint64_t chain_spp)
{
	if (!w) {
		print_message("%s: HSLT_SCENES is not set\n", name);
		skip();
	}
	static struct agreement_image reference, image;
	uint64_t sample_factor = test_is_full() ? 16 : 1;
	uint32_t depth = w->settings.max_depth < DEPTH ? w->settings.max_depth : DEPTH;
	const struct agreement_options bdpt = {"bdpt", sample_factor * bdpt_spp, GROUPS, 1, depth};
	const struct agreement_options chains = {RENDER_INTEGRATOR_CHAINS, sample_factor * chain_spp, GROUPS, 1, depth};
	char test[64];
	snprintf(test, sizeof test, "%s %s", name, RENDER_INTEGRATOR_CHAINS);
	agreement_render(w, name, "bdpt", &bdpt, &reference);
	agreement_render(w, test, RENDER_INTEGRATOR_CHAINS, &chains, &image);
	agreement_check_any_power(test, &image, &reference);
	world_free(w);
}

static void test_own(void **state)
{
	(void)state;
	compare_integrators("demo", world_from_own_scene("demo", "scene.xml", WIDTH, HEIGHT), 256, 1024);
	if (test_is_full())
		compare_integrators("box", world_from_own_scene("box", "box.xml", WIDTH, HEIGHT), 256, 1024);
	compare_integrators("displaced", world_from_own_scene("displaced", "scene.xml", WIDTH, HEIGHT), 256, 512);
}

static void test_cornell_box(void **state)
{
	(void)state;
	compare_integrators("cornell-box", world_from_public_scene("cornell-box", "scene.xml", WIDTH, HEIGHT), 128,
			    1024);
}

static void test_veach_mis(void **state)
{
	(void)state;
	compare_integrators("veach-mis", world_from_public_scene("veach-mis", "scene.xml", WIDTH, HEIGHT), 256, 1024);
}

static void test_veach_door(void **state)
{
	(void)state;
	compare_integrators("veach-door", world_from_public_scene("veach-door", "scene.xml", WIDTH, HEIGHT), 256, 1024);
}

static void test_rates(void **state)
{
	(void)state;
	if (test_is_full()) {
		compare_integrators("three-spheres", world_from_public_scene(".", "three-spheres.xml", WIDTH, HEIGHT),
				    256, 1024);
		compare_integrators("half-sunk", world_from_public_scene(".", "half-sunk.xml", WIDTH, HEIGHT), 256,
				    1024);
	}
	compare_integrators("half-sunk-rough", world_from_public_scene(".", "half-sunk-rough.xml", WIDTH, HEIGHT), 256,
			    1024);
}

int main(void)
{
	enum { SHORT = 3 };
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_own),	    cmocka_unit_test(test_veach_door), cmocka_unit_test(test_rates),
		cmocka_unit_test(test_cornell_box), cmocka_unit_test(test_veach_mis),
	};
	return _cmocka_run_group_tests("scenes", tests, test_is_full() ? sizeof tests / sizeof *tests : SHORT, NULL,
				       NULL);
}
