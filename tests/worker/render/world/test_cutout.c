/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A material that a picture divides in two halves, against two rectangles: with `mask` one half is absent, with
 * `blendbsdf` the halves have two materials. Statistics as in tests/support/agreement.h.
 */
#include "tests/support/agreement.h"
#include "tests/support/memory_assets.h"
#include "tests/support/pictures.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define LIGHT_AND_FLOOR                                                                                   \
	"<emitter type='constant'/><shape type='rectangle'><transform name='to_world'><scale value='3'/>" \
	"<translate z='-0.5'/></transform><bsdf type='diffuse'><rgb name='reflectance' value='0.2'/></bsdf></shape>"
#define DIFFUSE(value) "<bsdf type='diffuse'><rgb name='reflectance' value='" value "'/></bsdf>"
#define HALF(side, bsdf)                                                                         \
	"<shape type='rectangle'><transform name='to_world'><scale x='0.5'/><translate x='" side \
	"'/></transform>" bsdf "</shape>"
/* A picture that is 0 on the left and 1 on the right. */
#define PICTURE(name)                                                                 \
	"<texture type='bitmap' name='" name "'><string name='filename' value='p0'/>" \
	"<boolean name='raw' value='true'/><string name='filter_type' value='nearest'/></texture>"

static void compare_images(const char *test, uint32_t samples, const char *cut, const char *halves)
{
	static struct agreement_image image[2];
	const char *body[2] = {cut, halves};
	struct pictures p = {.count = 0};
	pictures_add(&p, 2, 1, (const double[]){0, 0, 0, 1, 1, 1});
	for (int i = 0; i < 2; i++) {
		char xml[2048];
		int n = snprintf(xml, sizeof xml,
				 "<scene version='3.0.0'>" SENSOR("0,-1,4", "0,0,0") LIGHT_AND_FLOOR "%s</scene>",
				 body[i]);
		assert_true(n > 0 && (size_t)n < sizeof xml);
		const struct memory_file files[] = {
			{"s.xml", xml, (size_t)n}, {"p0", p.file[0].bytes, p.file[0].size}, {NULL, NULL, 0}};
		struct world *w = world_from_files(16, 16, files);
		const struct agreement_options how = {"path", samples, 32, 1, 16};
		agreement_render(w, test, i ? "halves" : "cut", &how, &image[i]);
		world_free(w);
	}
	agreement_check(test, &image[0], &image[1]);
	pictures_fini(&p);
}

static void test_mask_equals_halves(void **state)
{
	(void)state;
	compare_images("mask", 1024,
		       "<shape type='rectangle'><bsdf type='mask'>" PICTURE("opacity") DIFFUSE("0.8") "</bsdf></shape>",
		       HALF("0.5", DIFFUSE("0.8")));
}

/* A leaf lit from behind: light passes through its material, and through the part that is cut off. */
static void test_mask_over_a_translucent_leaf_equals_halves(void **state)
{
	(void)state;
#define LEAF "<bsdf type='difftrans'><rgb name='transmittance' value='0.7'/></bsdf>"
	compare_images("leaf", 1024,
		       "<shape type='rectangle'><bsdf type='mask'>" PICTURE("opacity") LEAF "</bsdf></shape>",
		       HALF("0.5", LEAF));
}

/* Smooth and frosted glass with one half cut off: refraction and straight transmission must stay separate. */
static void test_mask_over_glass_equals_halves(void **state)
{
	(void)state;
#define PANE(type) "<bsdf type='" type "'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/></bsdf>"
	compare_images("glass", 1408,
		       "<shape type='rectangle'><bsdf type='mask'>" PICTURE("opacity")
			       PANE("dielectric") "</bsdf></shape>",
		       HALF("0.5", PANE("dielectric")));
	compare_images("frosted", 2048,
		       "<shape type='rectangle'><bsdf type='mask'>" PICTURE("opacity")
			       PANE("roughdielectric") "</bsdf></shape>",
		       HALF("0.5", PANE("roughdielectric")));
}

static void test_blend_equals_halves(void **state)
{
	(void)state;
	compare_images("blend", 1024,
		       "<shape type='rectangle'><bsdf type='blendbsdf'>" PICTURE("weight") DIFFUSE("0.8")
			       DIFFUSE("0.3") "</bsdf></shape>",
		       HALF("-0.5", DIFFUSE("0.8")) HALF("0.5", DIFFUSE("0.3")));
}

/* Panes with a normal that faces away from the camera, and with one that faces it. */
#define BENT(opacity, y)                                                                              \
	"<shape type='rectangle'><bsdf type='mask'><float name='opacity' value='" opacity "'/>"       \
	"<bsdf type='twosided'><bsdf type='normalmap'><rgb name='normalmap' value='0.5 " y " 0.67'/>" \
	"<boolean name='flip_invalid_normals' value='false'/>" DIFFUSE("0.8") "</bsdf></bsdf></bsdf></shape>"

/* Light passes through a hole whatever the normal at that point. */
static void test_holes_transmit_whatever_the_normal(void **state)
{
	(void)state;
	static const char *const bodies[] = {BENT("0", "0.03"), BENT("0", "0.97")};
	static const struct agreement_options how = {"bdpt", 16, 16, 1, 16};
	for (int i = 0; i < 2; i++) {
		static struct agreement_image image;
		struct world *w =
			world_from_text(16, 16, "<emitter type='constant'/>" SENSOR("0,-3,1", "0,0,0") "%s", bodies[i]);
		agreement_render(w, "bent hole", "bdpt", &how, &image);
		for (uint32_t g = 0; g < image.groups; g++)
			for (int k = 0; k <= AGREEMENT_CELLS; k++)
				assert_true(fabs(image.mean[g][k] / image.mean[0][0] - 1) < 1e-5);
		double white = 0.95047 + 1 + 1.08883;
		assert_true(fabs(image.mean[0][0] / white - 1) < 1e-3);
		world_free(w);
	}
}

/* A lamp seen through panes that transmit half of the light, with normals that face the camera or do not. */
static void test_tilted_panes_transmit_their_share(void **state)
{
	(void)state;
	static struct agreement_image path, bdpt, hslt;
	static const struct agreement_options how[] = {
		{"path", 2048, 32, 1, 6}, {"bdpt", 2048, 32, 1, 6}, {"hslt", 8192, 32, 1, 6}};
	/* clang-format off */
	struct world *w = world_from_text(16, 16,
		SENSOR("0,-3,1", "0,0,0")
		LIGHT_AND_FLOOR
		BENT("0.5", "0.03")
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='0.7'/>"
				"<rotate x='1' angle='180'/>"
				"<translate z='2'/>"
			"</transform>"
			"<emitter type='area'><rgb name='radiance' value='8'/></emitter>"
		"</shape>");
	/* clang-format on */
	agreement_render(w, "bent panes", "path", &how[0], &path);
	agreement_render(w, "bent panes", "bdpt", &how[1], &bdpt);
	agreement_render(w, "bent panes", "hslt", &how[2], &hslt);
	agreement_check_any_power("bent panes, bdpt and path", &bdpt, &path);
	agreement_check_any_power("bent panes, hslt and bdpt", &hslt, &bdpt);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_mask_equals_halves),
					   cmocka_unit_test(test_mask_over_a_translucent_leaf_equals_halves),
					   cmocka_unit_test(test_mask_over_glass_equals_halves),
					   cmocka_unit_test(test_blend_equals_halves),
					   cmocka_unit_test(test_holes_transmit_whatever_the_normal),
					   cmocka_unit_test(test_tilted_panes_transmit_their_share)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
