/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images whose header states primaries other than those of BT.709, against published matrices: of BT.2020 (ITU-R
 * BT.2087, four digits) and of ACEScg (S-2014-004, to XYZ).
 */
#include "worker/render/image/image.h"
#include "worker/render/image/primaries.h"

#include "common/base/color.h"
#include "common/base/mem.h"
#include "common/exr/exr_image.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const struct primaries bt709 = {{0.64f, 0.30f, 0.15f, 0.3127f}, {0.33f, 0.60f, 0.06f, 0.3290f}},
			      bt2020 = {{0.708f, 0.170f, 0.131f, 0.3127f}, {0.292f, 0.797f, 0.046f, 0.3290f}},
			      acescg = {{0.713f, 0.165f, 0.128f, 0.32168f}, {0.293f, 0.830f, 0.044f, 0.33767f}},
			      xyz = {{1, 0, 0, 1 / 3.0f}, {0, 1, 0, 1 / 3.0f}};

static void expect_matrix(const char *what, const struct primaries *p, double expected[3][3], double tolerance)
{
	double m[3][3];
	assert_true(primaries_to_bt709(p, m));
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			if (!(fabs(m[i][j] - expected[i][j]) <= tolerance))
				fail_msg("%s: [%d][%d] is %.6f, not %.6f", what, i, j, m[i][j], expected[i][j]);
}

/* Applies the inverse of the BT.709 matrix (from XYZ) to the columns of another matrix. */
static void convert_from_xyz(const double columns[3][3], double m[3][3])
{
	for (int j = 0; j < 3; j++) {
		double rgb[3];
		rec709_from_xyz(columns[j], rgb);
		for (int i = 0; i < 3; i++)
			m[i][j] = rgb[i];
	}
}

static void test_matrices_match_known_primaries(void **state)
{
	(void)state;
	double same[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, m[3][3];
	double of_bt2020[3][3] = {{1.6605, -0.5876, -0.0728}, {-0.1246, 1.1329, -0.0083}, {-0.0182, -0.1006, 1.1187}};
	static const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
			    ap1[3][3] = {{0.6624541811, 0.2722287168, -0.0055746495},
					 {0.1340042065, 0.6740817658, 0.0040607335},
					 {0.1561876870, 0.0536895174, 1.0103391003}};
	expect_matrix("BT.709", &bt709, same, 1e-14);
	expect_matrix("BT.2020", &bt2020, of_bt2020, 6e-5);
	/* The white of the published matrices from XYZ differs in the fourth digit. */
	convert_from_xyz(axes, m);
	expect_matrix("XYZ", &xyz, m, 1e-3);
	convert_from_xyz(ap1, m);
	expect_matrix("ACEScg", &acescg, m, 5e-4);
	assert_true(primaries_are_bt709(&bt709));
	assert_false(primaries_are_bt709(&bt2020));
}

static void test_invalid_primaries_are_refused(void **state)
{
	(void)state;
	static const struct primaries none[] = {
		{{0, 0, 0, 0}, {0, 0, 0, 0}},				    /* a header of zeros */
		{{0.64f, 0.30f, 0.15f, 0.3127f}, {0.33f, 0.60f, 0.06f, 0}}, /* a white without luminance */
		{{0.1f, 0.2f, 0.4f, 0.3f}, {0.1f, 0.2f, 0.4f, 0.3f}},	    /* collinear */
		{{0.7f, 0.2f, 0.45f, 0.3f}, {0.1f, 0.6f, 0.35f, 0.3f}},	    /* collinear but for rounding */
		{{NAN, 0.30f, 0.15f, 0.3127f}, {0.33f, 0.60f, 0.06f, 0.3290f}},
		{{0.64f, 0.30f, 0.15f, INFINITY}, {0.33f, 0.60f, 0.06f, 0.3290f}},
	};
	double m[3][3];
	for (size_t i = 0; i < sizeof none / sizeof *none; i++)
		if (primaries_to_bt709(&none[i], m))
			fail_msg("%zu has colours", i);
}

/* Returns an image of one colour with these primaries in its header. */
static unsigned char *make_exr(const struct primaries *p, const float *colour, size_t *size)
{
	struct exr_image x = {.width = 1, .height = 1, .channel_count = 3, .full_width = 1, .full_height = 1};
	float planes[3], stored[8];
	unsigned char *bytes;
	struct error e;
	for (int k = 0; k < 3; k++) {
		snprintf(x.channel_names[k], sizeof x.channel_names[k], "%c", "BGR"[k]);
		planes[k] = colour[2 - k];
		x.planes[k] = planes + k;
	}
	if (exr_write(&x, &bytes, size, &e))
		fail_msg("%s", e.text);
	for (int k = 0; k < 4; k++) {
		stored[2 * k] = p->x[k];
		stored[2 * k + 1] = p->y[k];
	}
	static const char name[] = "chromaticities\0chromaticities"; /* followed by a length of four bytes */
	size_t at = 0;
	while (memcmp(bytes + at, name, sizeof name) != 0)
		assert_true(++at < *size - sizeof name);
	memcpy(bytes + at + sizeof name + 4, stored, sizeof stored);
	return bytes;
}

static int decode(const struct primaries *p, const float *colour, struct arena *arena, struct image *img,
		  struct error *e)
{
	size_t size;
	unsigned char *bytes = make_exr(p, colour, &size);
	int r = image_decode(bytes, size, "a.exr", true, IMAGE_ALL, arena, img, e);
	mem_free(bytes);
	return r;
}

static void test_primaries_of_exr_files_are_applied(void **state)
{
	(void)state;
	static const float colour[3] = {0.8f, 0.3f, 0.1f}, huge[3] = {3e38f, 0, 0};
	struct arena arena = {0};
	struct image img;
	struct error e = {""};
	assert_int_equal(decode(&bt709, colour, &arena, &img, &e), 0);
	assert_memory_equal(img.pixels, colour, sizeof colour);
	assert_int_equal(decode(&bt2020, colour, &arena, &img, &e), 0);
	const double expected[3] = {1.6605 * 0.8 - 0.5876 * 0.3 - 0.0728 * 0.1,
				    -0.1246 * 0.8 + 1.1329 * 0.3 - 0.0083 * 0.1,
				    -0.0182 * 0.8 - 0.1006 * 0.3 + 1.1187 * 0.1};
	for (int k = 0; k < 3; k++)
		assert_true(fabs((double)img.pixels[k] - expected[k]) < 1e-4);
	assert_int_equal(decode(&(struct primaries){0}, colour, &arena, &img, &e), -EBADMSG);
	assert_non_null(strstr(e.text, "a.exr: OpenEXR: no colours have the chromaticities in its header"));
	assert_int_equal(decode(&bt2020, huge, &arena, &img, &e), -EBADMSG);
	assert_non_null(strstr(e.text, "pixel (0, 0) is not finite in BT.709"));
	arena_fini(&arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_matrices_match_known_primaries),
		cmocka_unit_test(test_invalid_primaries_are_refused),
		cmocka_unit_test(test_primaries_of_exr_files_are_applied),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
