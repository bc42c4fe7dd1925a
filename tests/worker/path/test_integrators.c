/*
 * Every integrator of the registry against the path tracer, on small scenes that each exercise something of their own:
 * diffuse light and textures, glossy metal, smooth glass, rough glass, shading normals, light from infinity.
 */
#include "tests/support/agree.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void check_all(const char *name, struct world *w, uint64_t path_spp, uint64_t bdpt_spp, uint64_t chain_spp)
{
	static struct agree_image reference, other;
	struct agree_side path = {"path", path_spp, 32, 0, 0};
	agree_render(w, name, "path", &path, &reference);
	for (size_t i = 0; render_integrator_at(i); i++) {
		const struct render_integrator *r = render_integrator_at(i);
		if (strcmp(r->name, "path") == 0)
			continue;
		char test[64];
		snprintf(test, sizeof test, "%s %s", name, r->name);
		struct agree_side side = {r->name, r->kind == PLAN_CHAINS ? chain_spp : bdpt_spp, 32, 0, 0};
		agree_render(w, test, r->name, &side, &other);
		agree_check(test, &other, &reference);
	}
	world_free(w);
}

#define DEPTH(k) "<integrator type='path'><integer name='max_depth' value='" k "'/></integrator>"
#define FLOOR "<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/></transform>" \
	      "<bsdf type='diffuse'><rgb name='reflectance' value='0.6,0.5,0.3'/></bsdf></shape>"
#define LAMP "<shape type='rectangle'><transform name='to_world'><scale value='1.2'/><rotate x='1' angle='90'/>" \
	     "<translate y='4'/></transform><emitter type='area'><rgb name='radiance' value='9,8,6'/></emitter></shape>"

static void test_diffuse(void **state)
{
	(void)state;
	check_all("diffuse",
		  world_of_text(32, 32, DEPTH("4") SENSOR("0,2,6", "0,1,0") FLOOR LAMP
				"<shape type='cube'><transform name='to_world'><scale value='0.7'/><translate y='0.7'/></transform>"
				"<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'><rgb name='color0' value='.8,.2,.1'/>"
				"<float name='color1' value='.3'/></texture></bsdf></shape>"),
		  4096, 4096, 4096);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_diffuse),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
