/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A material that a picture cuts in two, against two rectangles: of `mask` one half is not there, of `blendbsdf` the
 * halves have the two materials.
 */
#include "tests/support/agree.h"
#include "tests/support/memory_assets.h"
#include "tests/support/pictures.h"
#include "tests/support/worlds.h"

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
/* 0 to the left, 1 to the right. */
#define PICTURE(name)                                                                 \
	"<texture type='bitmap' name='" name "'><string name='filename' value='p0'/>" \
	"<boolean name='raw' value='true'/><string name='filter_type' value='nearest'/></texture>"

static void compare(const char *test, uint32_t samples, const char *cut, const char *halves)
{
	static struct agree_image image[2];
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
		struct world *w = world_of_files(16, 16, files);
		const struct agree_side how = {"path", samples, 32, 1, 16};
		agree_render(w, test, i ? "halves" : "cut", &how, &image[i]);
		world_free(w);
	}
	agree_check(test, &image[0], &image[1]);
	pictures_fini(&p);
}

static void test_mask(void **state)
{
	(void)state;
	compare("mask", 1024,
		"<shape type='rectangle'><bsdf type='mask'>" PICTURE("opacity") DIFFUSE("0.8") "</bsdf></shape>",
		HALF("0.5", DIFFUSE("0.8")));
}

/* A leaf: lit from behind through itself, and through what is cut off. */
static void test_mask_over_what_transmits(void **state)
{
	(void)state;
#define LEAF "<bsdf type='difftrans'><rgb name='transmittance' value='0.7'/></bsdf>"
	compare("leaf", 1024, "<shape type='rectangle'><bsdf type='mask'>" PICTURE("opacity") LEAF "</bsdf></shape>",
		HALF("0.5", LEAF));
}

/* A pane of glass whose one half is cut off, and frosted glass likewise: what refracts and what passes stay apart. */
static void test_mask_over_glass(void **state)
{
	(void)state;
#define PANE(type) "<bsdf type='" type "'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/></bsdf>"
	compare("glass", 1408,
		"<shape type='rectangle'><bsdf type='mask'>" PICTURE("opacity") PANE("dielectric") "</bsdf></shape>",
		HALF("0.5", PANE("dielectric")));
	compare("frosted", 2048,
		"<shape type='rectangle'><bsdf type='mask'>" PICTURE("opacity")
			PANE("roughdielectric") "</bsdf></shape>",
		HALF("0.5", PANE("roughdielectric")));
}

static void test_blend(void **state)
{
	(void)state;
	compare("blend", 1024,
		"<shape type='rectangle'><bsdf type='blendbsdf'>" PICTURE("weight") DIFFUSE("0.8")
			DIFFUSE("0.3") "</bsdf></shape>",
		HALF("-0.5", DIFFUSE("0.8")) HALF("0.5", DIFFUSE("0.3")));
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_mask), cmocka_unit_test(test_mask_over_what_transmits),
					   cmocka_unit_test(test_mask_over_glass), cmocka_unit_test(test_blend)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
