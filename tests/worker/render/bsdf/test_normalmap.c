/* SPDX-License-Identifier: Apache-2.0 */
/* A normal map with `scale` is compared with an equivalent map without it, and a map of one colour with a texture that
 * has this colour everywhere. Parts of a material may bend normals in the same way. */
#include "tests/support/pictures.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

#include <errno.h>
#include <math.h>

static struct relief_sample value_of(const char *map, struct asset_source *assets, struct arena *a)
{
	struct scene_node *n = node_make(a, PLUGIN_BSDF, map);
	node_add_child(a, n, node_make(a, PLUGIN_TEXTURE, "bitmap filename=p0 raw=true"));
	node_add_child(a, n, node_make(a, PLUGIN_BSDF, "diffuse"));
	const struct bsdf_build build = {.assets = assets, .arena = a, .is_dialect_3 = true};
	struct bsdf b;
	struct relief_sample v;
	struct error e;
	if (bsdf_create(&b, n, &build, &e))
		fail_msg("%s", e.text);
	b.relief->eval(b.relief->data, 0.4, 0.55, &v);
	return v;
}

static void assert_vec(vec3 got, double x, double y, double z)
{
	if (!(fabs(got.x - x) + fabs(got.y - y) + fabs(got.z - z) < 1e-12))
		fail_msg("(%g %g %g) is not (%g %g %g)", got.x, got.y, got.z, x, y, z);
}

static void scaled_map_equals_its_unscaled_equivalent(void **state)
{
	(void)state;
	struct pictures p = {.count = 0};
	struct arena a = {0};
	pictures_add(&p, 2, 2, (const double[]){0.5, 0.25, 0.75, 0.75, 0.5, 0.5, 0.25, 0.75, 0.5, 0.5, 0.5, 0.75});
	struct asset_source source = pictures_source(&p);
	struct relief_sample plain = value_of("normalmap", &source, &a),
			     steep = value_of("normalmap scale=3", &source, &a);
	assert_true(fabs(plain.x.y) > 0.01 && fabs(plain.du.y) > 0.01 && fabs(plain.dv.x) > 0.01);
	assert_vec(steep.x, 3 * plain.x.x, 3 * plain.x.y, plain.x.z);
	assert_vec(steep.du, 3 * plain.du.x, 3 * plain.du.y, plain.du.z);
	assert_vec(steep.dv, 3 * plain.dv.x, 3 * plain.dv.y, plain.dv.z);
	arena_fini(&a);
	pictures_fini(&p);
}

static struct scene_node *node_with_normalmap(struct arena *a, const char *map, const char *texture, const char *inner)
{
	struct scene_node *n = node_make(a, PLUGIN_BSDF, map);
	node_add_child(a, n, node_make(a, PLUGIN_TEXTURE, texture));
	node_add_child(a, n, node_make(a, PLUGIN_BSDF, inner));
	return n;
}

static void map_of_one_color_equals_a_constant_texture(void **state)
{
	(void)state;
	static const char even[] = "checkerboard color0=rgb(0.75,0.5,0.875) color1=rgb(0.75,0.5,0.875)";
	struct arena a = {0};
	const struct bsdf_build build = {.arena = &a, .is_dialect_3 = true};
	struct bsdf of_texture, of_color;
	struct relief_sample wanted, got;
	struct error e;
	assert_int_equal(
		bsdf_create(&of_texture, node_with_normalmap(&a, "normalmap scale=2", even, "diffuse"), &build, &e), 0);
	assert_int_equal(bsdf_create(&of_color,
				     node_make_bsdf(&a, "normalmap normalmap=rgb(0.75,0.5,0.875) scale=2 | diffuse"),
				     &build, &e),
			 0);
	of_texture.relief->eval(of_texture.relief->data, 0.4, 0.55, &wanted);
	of_color.relief->eval(of_color.relief->data, 0.7, 0.1, &got);
	assert_vec(got.x, wanted.x.x, wanted.x.y, wanted.x.z);
	assert_vec(got.du, wanted.du.x, wanted.du.y, wanted.du.z);
	assert_vec(got.dv, wanted.dv.x, wanted.dv.y, wanted.dv.z);
	assert_vec(got.x, 1, 0, 0.75);
	assert_false(of_texture.relief->uses_handedness);
	assert_int_equal(bsdf_create(&of_texture, node_with_normalmap(&a, "normalmap handedness=true", even, "diffuse"),
				     &build, &e),
			 0);
	assert_true(of_texture.relief->uses_handedness);
	arena_fini(&a);
}

static int make_blend(const struct scene_node *first, const struct scene_node *second, struct arena *a, struct bsdf *b,
		      struct error *e)
{
	struct relief_map *bends = NULL;
	/* Bump maps of 0.6, which have no shadowing function, because that depends on further frames. */
	const struct bsdf_build build = {.arena = a, .relief_maps = &bends};
	struct scene_node *n = node_make(a, PLUGIN_BSDF, "blendbsdf weight=0.3");
	node_add_child(a, n, first);
	node_add_child(a, n, second);
	return bsdf_create(b, n, &build, e);
}

static void parts_of_a_material_share_one_relief(void **state)
{
	(void)state;
	static const char map[] = "bumpmap scale=0.5", tiles[] = "checkerboard color0=0.1";
	static const struct {
		const char *map, *texture;
	} others[] = {{"bumpmap scale=0.6", tiles},
		      {"bumpmap scale=0.5 flip_invalid_normals=true", tiles},
		      {"normalmap scale=0.5", tiles},
		      {map, "checkerboard color0=0.2"},
		      {map, "checkerboard color0=0.1 color1=0.7"},
		      {map, "gridtexture color0=0.1"}};
	struct arena a = {0};
	struct bsdf b;
	struct error e;
	struct relief_sample v, one;
	struct scene_node *first = node_with_normalmap(&a, map, tiles, "diffuse");
	assert_int_equal(make_blend(first, node_with_normalmap(&a, map, tiles, "phong"), &a, &b, &e), 0);
	b.relief->eval(b.relief->data, 0.4, 0.55, &v);
	assert_int_equal(make_blend(first, first, &a, &b, &e), 0);
	b.relief->eval(b.relief->data, 0.4, 0.55, &one);
	assert_memory_equal(&v, &one, sizeof v);
	assert_false(b.uses_relief_frames);
	const struct scene_node *specular = node_with_normalmap(&a, map, tiles, "plastic");
	for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
		assert_int_equal(make_blend(first, node_with_normalmap(&a, others[i].map, others[i].texture, "phong"),
					    &a, &b, &e),
				 0);
		assert_true(b.uses_relief_frames);
		assert_true(make_blend(specular, node_with_normalmap(&a, others[i].map, others[i].texture, "conductor"),
				       &a, &b, &e) < 0);
		assert_non_null(strstr(e.text, "bend normals differently"));
	}
	static const char *const colors[] = {"0.6,0.5,0.9", "0.6,0.5,0.9", "0.6,0.45,0.9"};
	const struct scene_node *even[3];
	for (size_t i = 0; i < 3; i++) {
		char text[80];
		snprintf(text, sizeof text, "normalmap normalmap=rgb(%s) scale=0.5 | phong", colors[i]);
		even[i] = node_make_bsdf(&a, text);
	}
	assert_int_equal(make_blend(even[0], even[1], &a, &b, &e), 0);
	assert_false(b.uses_relief_frames);
	assert_int_equal(make_blend(even[0], even[2], &a, &b, &e), 0);
	assert_true(b.uses_relief_frames);
	assert_int_equal(
		make_blend(even[0], node_with_normalmap(&a, "normalmap scale=0.5", tiles, "phong"), &a, &b, &e), 0);
	assert_true(b.uses_relief_frames);
	/* The surface has the normal of the part with the narrowest lobe; a part that lets light pass straight on needs
	 * no normal. */
	assert_int_equal(make_blend(first, specular, &a, &b, &e), 0);
	assert_false(b.uses_relief_frames);
	assert_int_equal(make_blend(node_make(&a, PLUGIN_BSDF, "phong"), specular, &a, &b, &e), 0);
	assert_true(b.uses_relief_frames && b.relief);
	assert_int_equal(make_blend(first, node_make(&a, PLUGIN_BSDF, "conductor"), &a, &b, &e), 0);
	assert_true(b.uses_relief_frames && !b.relief);
	assert_int_equal(make_blend(node_make(&a, PLUGIN_BSDF, "null"), first, &a, &b, &e), 0);
	assert_true(!b.uses_relief_frames && b.relief);
	arena_fini(&a);
}

/* A map in a map starts from its normal, whatever is between them; equal maps in different ones are different maps. */
static void test_nesting(void **state)
{
	(void)state;
	static const char map[] = "bumpmap scale=0.5 flip_invalid_normals=true", tiles[] = "checkerboard color0=0.1";
	struct arena a = {0};
	struct bsdf b;
	struct error e;
	struct scene_node *inner = node_with_normalmap(&a, map, tiles, "conductor"),
			  *both = node_make_bsdf(&a, "twosided");
	struct scene_node *outer = node_make(&a, PLUGIN_BSDF, map);
	node_add_child(&a, both, inner);
	node_add_child(&a, outer, node_make(&a, PLUGIN_TEXTURE, tiles));
	node_add_child(&a, outer, both);
	const struct bsdf_build build = {.arena = &a};
	assert_int_equal(bsdf_create(&b, outer, &build, &e), 0);
	assert_non_null(b.relief->base);
	assert_null(b.relief->base->base);
	assert_true(b.relief->base->flips_invalid_normals && !b.relief->flips_invalid_normals);
	assert_int_equal(make_blend(inner, outer, &a, &b, &e), -ENOTSUP);
	assert_non_null(strstr(e.text, "bend normals differently"));
	assert_int_equal(make_blend(outer, outer, &a, &b, &e), 0);
	assert_false(b.uses_relief_frames);
	struct scene_node *same = node_make(&a, PLUGIN_BSDF, "bumpmap scale=0.5");
	node_add_child(&a, same, node_make(&a, PLUGIN_TEXTURE, tiles));
	node_add_child(&a, same, node_with_normalmap(&a, "bumpmap scale=0.5", tiles, "conductor"));
	assert_int_equal(make_blend(same, same, &a, &b, &e), 0);
	assert_non_null(b.relief->base);
	for (int depth = 2; depth <= 9; depth++) {
		struct scene_node *around = node_make(&a, PLUGIN_BSDF, map);
		node_add_child(&a, around, node_make(&a, PLUGIN_TEXTURE, tiles));
		node_add_child(&a, around, inner);
		inner = around;
		assert_int_equal(bsdf_create(&b, inner, &build, &e), depth <= 8 ? 0 : -ENOTSUP);
	}
	assert_non_null(strstr(e.text, "more than 8 bump or normal maps"));
	arena_fini(&a);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(scaled_map_equals_its_unscaled_equivalent),
					   cmocka_unit_test(map_of_one_color_equals_a_constant_texture),
					   cmocka_unit_test(parts_of_a_material_share_one_relief),
					   cmocka_unit_test(test_nesting)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
