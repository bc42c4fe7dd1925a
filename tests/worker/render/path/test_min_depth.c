/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Paths with a required number of edges, where surfaces let light straight through: a connection that passes through
 * nothing has too few edges, and must not be counted as one that passes through the surface on which one of its ends
 * lies. Here light sub-paths end on masks, and those of `path` do not. Statistics as in tests/support/agreement.h.
 */
#include "tests/support/agreement.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static void passed_masks_lengthen_connections(void **state)
{
	(void)state;
	static struct agreement_image path, bdpt;
	/* clang-format off */
	struct world *w = world_from_text(16, 16, "%s",
		SENSOR("0,0,5", "0,-.2,0")
		"<shape type='rectangle'><transform name='to_world'><scale value='3'/><rotate x='1' y='1' angle='30'/></transform>"
			"<bsdf type='mask'><float name='opacity' value='.6'/><bsdf type='twosided'><bsdf type='diffuse'/></bsdf>"
			"</bsdf></shape>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><translate z='-3'/></transform></shape>"
		"<emitter type='constant'><float name='radiance' value='3'/></emitter>");
	/* clang-format on */
	assert_true(w->effects.transparent_shadows);
	agreement_render(w, "3 edges", "path", &(struct agreement_options){"path", 16384, 32, 3, 3}, &path);
	agreement_render(w, "3 edges", "bdpt", &(struct agreement_options){"bdpt", 11264, 32, 3, 3}, &bdpt);
	agreement_check("3 edges", &bdpt, &path);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(passed_masks_lengthen_connections)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
