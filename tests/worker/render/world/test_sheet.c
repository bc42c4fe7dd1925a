/* SPDX-License-Identifier: Apache-2.0 */
/* A sheet of `thindielectric` against a pane of `dielectric` with two surfaces, between a bright lamp and a dim one.
 * Statistics as in tests/support/agreement.h. */
#include "tests/support/agreement.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

/* The camera sees the dim lamp through the glass and the bright one reflected in it, at angles of 40 to 80 degrees. */
#define LAMP(turn, radiance)                                                                          \
	"<shape type='rectangle'><transform name='to_world'><scale value='500'/>" turn "</transform>" \
	"<bsdf type='diffuse'><float name='reflectance' value='0'/></bsdf><emitter type='area'>"      \
	"<float name='radiance' value='" radiance "'/></emitter></shape>"
#define LAMPS LAMP("<translate z='-2'/>", "1") LAMP("<rotate x='1' angle='180'/><translate z='2'/>", "4")
#define SIDE(turn, bsdf) \
	"<shape type='rectangle'><transform name='to_world'><scale value='100'/>" turn "</transform>" bsdf "</shape>"
#define GLASS(type) "<bsdf type='" type "'><float name='int_ior' value='2'/><float name='ext_ior' value='1'/></bsdf>"

static void test_pane(void **state)
{
	(void)state;
	static const char *const glass[2] = {
		SIDE("", GLASS("thindielectric")),
		SIDE("", GLASS("dielectric"))
			SIDE("<rotate x='1' angle='180'/><translate z='-0.001'/>", GLASS("dielectric")),
	};
	static struct agreement_image image[2];
	for (int i = 0; i < 2; i++) {
		struct world *w = world_from_text(16, 16, SENSOR("0,-1.7,1", "0,0,0") LAMPS "%s", glass[i]);
		const struct agreement_options how = {"path", 2048, 32, 1, 64};
		agreement_render(w, __func__, i ? "pane" : "sheet", &how, &image[i]);
		world_free(w);
	}
	agreement_check(__func__, &image[0], &image[1]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_pane)};
	return cmocka_run_group_tests_name("sheet", tests, NULL, NULL);
}
