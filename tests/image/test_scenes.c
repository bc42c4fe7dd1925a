/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The default integrator against bdpt on whole scenes: the project's, and the public ones if HSLT_SCENES names their
 * folder. Both must agree within their errors, at one level for all comparisons together; the smallest bias that would
 * have been found is printed. FULL=1: all scenes, with more samples.
 */
#include "worker/render/render.h"
#include "tests/support/agree.h"
#include "tests/support/length.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 48, HEIGHT = 27, DEPTH = 12, GROUPS = 32 };

static void compare(const char *name, struct world *w, uint64_t bdpt_spp, uint64_t chain_spp)
{
	if (!w) {
		print_message("%s: HSLT_SCENES is not set\n", name);
		skip();
	}
	static struct agree_image reference, image;
	uint64_t times = test_full() ? 16 : 1;
	uint32_t depth = w->settings.max_depth < DEPTH ? w->settings.max_depth : DEPTH;
	const struct agree_side bdpt = {"bdpt", times * bdpt_spp, GROUPS, 1, depth};
	const struct agree_side chains = {RENDER_INTEGRATOR_CHAINS, times * chain_spp, GROUPS, 1, depth};
	char test[64];
	snprintf(test, sizeof test, "%s %s", name, RENDER_INTEGRATOR_CHAINS);
	agree_render(w, name, "bdpt", &bdpt, &reference);
	agree_render(w, test, RENDER_INTEGRATOR_CHAINS, &chains, &image);
	agree_within_errors(test, &image, &reference);
	world_free(w);
}

static void test_own(void **state)
{
	(void)state;
	compare("demo", world_of_own_scene("demo", "scene.xml", WIDTH, HEIGHT), 256, 1024);
	if (test_full())
		compare("box", world_of_own_scene("box", "box.xml", WIDTH, HEIGHT), 256, 1024);
	compare("displaced", world_of_own_scene("displaced", "scene.xml", WIDTH, HEIGHT), 256, 512);
}

static void test_cornell_box(void **state)
{
	(void)state;
	compare("cornell-box", world_of_public_scene("cornell-box", "scene.xml", WIDTH, HEIGHT), 128, 1024);
}

static void test_veach_mis(void **state)
{
	(void)state;
	compare("veach-mis", world_of_public_scene("veach-mis", "scene.xml", WIDTH, HEIGHT), 256, 1024);
}

static void test_veach_door(void **state)
{
	(void)state;
	compare("veach-door", world_of_public_scene("veach-door", "scene.xml", WIDTH, HEIGHT), 256, 1024);
}

static void test_rates(void **state)
{
	(void)state;
	if (test_full()) {
		compare("three-spheres", world_of_public_scene(".", "three-spheres.xml", WIDTH, HEIGHT), 256, 1024);
		compare("half-sunk", world_of_public_scene(".", "half-sunk.xml", WIDTH, HEIGHT), 256, 1024);
	}
	compare("half-sunk-rough", world_of_public_scene(".", "half-sunk-rough.xml", WIDTH, HEIGHT), 256, 1024);
}

int main(void)
{
	enum { SHORT = 3 };
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_own),	    cmocka_unit_test(test_veach_door), cmocka_unit_test(test_rates),
		cmocka_unit_test(test_cornell_box), cmocka_unit_test(test_veach_mis),
	};
	return _cmocka_run_group_tests("scenes", tests, test_full() ? sizeof tests / sizeof *tests : SHORT, NULL, NULL);
}
