/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Paths through hair, whose scattering is not reciprocal: paths from a light choose the lobe in which light leaves
 * the fibre with other probabilities than paths from the camera. Integrators that start at both ends, and chains,
 * must agree with the path tracer on three thick hairs in front of a lamp. Chains need FULL=1. Statistics as in
 * tests/support/agree.h.
 */
#include "tests/support/agree.h"
#include "tests/support/length.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static void compare(const char *name, uint64_t spp, bool demanding)
{
	static struct agree_image reference, other;
	struct world *w = world_of_own_scene("integrators", "hair.xml", 32, 32);
	struct agree_side path = {"path", 1024, 32, 0, 0}, side = {name, spp, 32, 0, 0};
	agree_render(w, "hair", "path", &path, &reference);
	agree_render(w, "hair", name, &side, &other);
	if (demanding)
		agree_check(name, &other, &reference);
	else
		agree_within_errors(name, &other, &reference);
	world_free(w);
}

static void test_from_both_ends(void **state)
{
	(void)state;
	compare("bdpt", 1024, true);
}

static void test_chains(void **state)
{
	(void)state;
	if (!test_full())
		skip();
	compare("pssmlt", 5000, false);
	compare("hslt", 5000, false);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_from_both_ends), cmocka_unit_test(test_chains)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
