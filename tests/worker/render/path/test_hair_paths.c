/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Paths through hair, whose scattering is not reciprocal: paths from a light choose the lobe in which light leaves
 * the fibre with other probabilities than paths from the camera. Integrators that start at both ends, and chains,
 * must agree with the path tracer on three thick hairs in front of a lamp. Chains need FULL=1. Statistics as in
 * tests/support/agreement.h.
 */
#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static void compare_integrators(const char *name, uint64_t spp, bool demanding)
{
	static struct agreement_image reference, other;
	struct world *w = world_from_own_scene("integrators", "hair.xml", 32, 32);
	struct agreement_options path = {"path", 1024, 32, 0, 0}, side = {name, spp, 32, 0, 0};
	agreement_render(w, "hair", "path", &path, &reference);
	agreement_render(w, "hair", name, &side, &other);
	if (demanding)
		agreement_check(name, &other, &reference);
	else
		agreement_check_any_power(name, &other, &reference);
	world_free(w);
}

static void bdpt_agrees_with_path_in_hair(void **state)
{
	(void)state;
	compare_integrators("bdpt", 1024, true);
}

static void chains_agree_with_path_in_hair(void **state)
{
	(void)state;
	if (!test_is_full())
		skip();
	compare_integrators("pssmlt", 5000, false);
	compare_integrators("hslt", 5000, false);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(bdpt_agrees_with_path_in_hair),
					   cmocka_unit_test(chains_agree_with_path_in_hair)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
