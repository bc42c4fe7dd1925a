/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Refracted connections change the noise of an image and not its mean, also where more than one refracted path joins
 * two points and where the walk finds none: the caustic of a ball. Statistics as in tests/support/agree.h, but finding
 * a bias of 3 % of the mean only; if all paths were weighted as those that the walk finds, nearly half would be lost.
 */
#include "tests/support/agree.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static struct world *caustic(const char *effects)
{
	worlds_effects = effects;
	/* clang-format off */
	struct world *w = world_of_text(16, 16, "%s",
		"<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
		"<sensor type='perspective'><float name='fov' value='4'/><transform name='to_world'>"
			"<lookat origin='2,-.7,0' target='-.08,-1,0' up='0,1,0'/></transform></sensor>"
		"<shape type='rectangle'><transform name='to_world'><scale value='9'/><rotate x='1' angle='-90'/>"
			"<translate y='-1'/></transform><bsdf type='diffuse'/></shape>"
		"<shape type='sphere'><point name='center' x='0' y='-.2' z='0'/><float name='radius' value='.5'/>"
			"<bsdf type='dielectric'/></shape>"
		"<shape type='sphere'><point name='center' x='.1' y='1.4' z='0'/><float name='radius' value='.4'/>"
			"<emitter type='area'><float name='radiance' value='3'/></emitter></shape>");
	/* clang-format on */
	worlds_effects = NULL;
	return w;
}

static void test_mean_stays(void **state)
{
	(void)state;
	static struct agree_image without, with;
	static const struct agree_side sides[] = {{"path", 2048, 32, 0, 0}, {"bdpt", 512, 32, 0, 0}};
	struct world *w = caustic("-refracted-shadows");
	agree_render(w, "caustic", "without", &(struct agree_side){"path", 4096, 32, 0, 0}, &without);
	world_free(w);
	w = caustic(NULL);
	assert_true(w->effects.refracted_shadows);
	for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
		char test[64];
		snprintf(test, sizeof test, "caustic, %s", sides[i].integrator);
		agree_render(w, test, "with", &sides[i], &with);
		agree_within_errors(test, &with, &without);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_mean_stays)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
