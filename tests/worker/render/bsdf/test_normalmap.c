/* SPDX-License-Identifier: Apache-2.0 */
/* What `scale` makes of a normal map: against the same map without it. */
#include "tests/support/pictures.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

#include <math.h>

static struct relief_value value_of(const char *map, struct asset_source *assets, struct arena *a)
{
	struct scene_node *n = node_make(a, PLUGIN_BSDF, map);
	node_add_child(a, n, node_make(a, PLUGIN_TEXTURE, "bitmap filename=p0 raw=true"));
	node_add_child(a, n, node_make(a, PLUGIN_BSDF, "diffuse"));
	const struct bsdf_build build = {.assets = assets, .arena = a, .dialect_3 = true};
	struct bsdf b;
	struct relief_value v;
	struct error e;
	if (bsdf_create(&b, n, &build, &e))
		fail_msg("%s", e.text);
	b.relief->at(b.relief->data, 0.4, 0.55, &v);
	return v;
}

static void assert_vec(vec3 got, double x, double y, double z)
{
	if (!(fabs(got.x - x) + fabs(got.y - y) + fabs(got.z - z) < 1e-12))
		fail_msg("(%g %g %g) is not (%g %g %g)", got.x, got.y, got.z, x, y, z);
}

static void test_scale(void **state)
{
	(void)state;
	struct pictures p = {.count = 0};
	struct arena a = {0};
	pictures_add(&p, 2, 2, (const double[]){0.5, 0.25, 0.75, 0.75, 0.5, 0.5, 0.25, 0.75, 0.5, 0.5, 0.5, 0.75});
	struct asset_source source = pictures_source(&p);
	struct relief_value plain = value_of("normalmap", &source, &a),
			    steep = value_of("normalmap scale=3", &source, &a);
	assert_true(fabs(plain.x.y) > 0.01 && fabs(plain.du.y) > 0.01 && fabs(plain.dv.x) > 0.01);
	assert_vec(steep.x, 3 * plain.x.x, 3 * plain.x.y, plain.x.z);
	assert_vec(steep.du, 3 * plain.du.x, 3 * plain.du.y, plain.du.z);
	assert_vec(steep.dv, 3 * plain.dv.x, 3 * plain.dv.y, plain.dv.z);
	arena_fini(&a);
	pictures_fini(&p);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_scale)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
