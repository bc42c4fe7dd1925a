/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The figures of hslt-compare against values worked out by hand on small images; its percentile, trimming, shrinking
 * and heat map; and --exact, which detects a single bit and each attribute that is not excluded.
 */
#include "worker/cli/image/compare.h"

#include "common/base/mem.h"
#include "common/exr/image_file.h"
#include "worker/cli/image/compare_exact.h"

#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

static struct picture make_picture(uint32_t width, uint32_t height, float value)
{
	struct picture p = {.image = {.width = width,
				      .height = height,
				      .channel_count = 3,
				      .full_width = width,
				      .full_height = height,
				      .channel_names = {"B", "G", "R"}}};
	for (int k = 0; k < 3; k++) {
		float *plane = p.image.planes[k] = mem_alloc((size_t)width * height, sizeof *plane);
		for (size_t i = 0; i < (size_t)width * height; i++)
			plane[i] = value;
		p.rgb[2 - k] = plane;
	}
	return p;
}

static float *value_at(struct picture *p, int rgb, size_t i)
{
	return &p->image.planes[2 - rgb][i];
}

static struct compare_result compare_pictures(const struct picture *a, const struct picture *b, double trim)
{
	struct compare_result r;
	struct error e;
	if (compare_to_reference(a, b, trim, &r, &e) != 0)
		fail_msg("%s", e.text);
	return r;
}

static bool is_near(double a, double b)
{
	return fabs(a - b) <= 1e-12 * fabs(b);
}

/*
 * B is 1 everywhere except for one pixel of (2, 4, 6): over 4 pixels its mean is (9 + 12) / 12 = 1.75. A is wrong in
 * two values: 0.5 in one pixel's R, and 3 where B has 4.
 */
static void figures_match_those_by_hand(void **unused)
{
	(void)unused;
	struct picture a = make_picture(2, 2, 1), b = make_picture(2, 2, 1);
	for (int k = 0; k < 3; k++)
		*value_at(&a, k, 3) = *value_at(&b, k, 3) = 2 * (float)(k + 1);
	*value_at(&a, 0, 0) = 0.5f;
	*value_at(&a, 1, 3) = 3;
	struct compare_result r = compare_pictures(&a, &b, 0);
	double least = 0.0175 * 0.0175;
	assert_true(is_near(r.rel_mse, (0.25 / (1 + least) + 1 / (16 + least)) / 12));
	assert_true(is_near(r.rel_error, sqrt(r.rel_mse)));
	assert_true(is_near(r.rmse, sqrt(1.25 / 12)));
	assert_true(is_near(r.peak, 6)); /* rank ceil(0.995 * 12) = 12 of 12 */
	assert_true(is_near(r.psnr, 10 * log10(36 / (1.25 / 12))));
	assert_true(is_near(r.ratio[0], 4.5 / 5) && is_near(r.ratio[1], 6.0 / 7) && is_near(r.ratio[2], 1));
	assert_true(is_near(r.luminance_ratio,
			    (0.2126 * 4.5 + 0.7152 * 6 + 0.0722 * 9) / (0.2126 * 5 + 0.7152 * 7 + 0.0722 * 9)));
	assert_true(r.pixel_count == 4 && r.trimmed_count == 0 && r.not_finite_count == 0);
	picture_fini(&a);
	picture_fini(&b);
}

static void peak_is_a_percentile(void **unused)
{
	(void)unused;
	struct picture b = make_picture(20, 10, 1);
	*value_at(&b, 1, 17) = 100; /* of 600 values, rank 597 leaves out the three largest */
	*value_at(&b, 0, 30) = 90;
	*value_at(&b, 2, 31) = 80;
	assert_true(is_near(compare_pictures(&b, &b, 0).peak, 1));
	*value_at(&b, 2, 32) = 70;
	assert_true(is_near(compare_pictures(&b, &b, 0).peak, 70));
	picture_fini(&b);
}

static void equal_pictures_have_an_infinite_psnr(void **unused)
{
	(void)unused;
	struct picture a = make_picture(3, 1, 0), b = make_picture(3, 1, 0);
	struct compare_result r = compare_pictures(&a, &b, 0);
	assert_true(r.rel_mse == 0 && r.rmse == 0 && isinf(r.psnr) && r.psnr > 0);
	*value_at(&a, 0, 0) = 1; /* any value differs infinitely from a black reference */
	assert_true(isinf(compare_pictures(&a, &b, 0).rel_mse));
	picture_fini(&a);
	picture_fini(&b);
}

static void trimming_leaves_out_the_worst_pixels(void **unused)
{
	(void)unused;
	struct picture a = make_picture(100, 10, 2), b = make_picture(100, 10, 2);
	*value_at(&a, 0, 500) = 1e6f;
	*value_at(&a, 2, 7) = 2.5f;
	*value_at(&a, 1, 8) = 2.25f;
	assert_true(compare_pictures(&a, &b, 0).rmse > 1e4);
	struct compare_result r = compare_pictures(&a, &b, 0.001);
	assert_int_equal(r.trimmed_count, 1);
	assert_true(is_near(r.rmse, sqrt((0.25 + 0.0625) / (999 * 3))));
	assert_true(is_near(r.rel_mse, (0.25 + 0.0625) / (4 + 0.0004) / (999 * 3)));
	assert_true(r.ratio[0] > 100); /* the means are over all pixels */
	r = compare_pictures(&a, &b, 0.002);
	assert_true(r.trimmed_count == 2 && is_near(r.rmse, sqrt(0.0625 / (998 * 3))));
	assert_true(compare_pictures(&a, &b, 0.003).rmse == 0);
	*value_at(&a, 0, 500) = NAN;
	*value_at(&a, 0, 501) = INFINITY;
	r = compare_pictures(&a, &b, 0.002);
	assert_true(r.not_finite_count == 2 && is_near(r.rmse, sqrt((0.25 + 0.0625) / (998 * 3))));
	assert_true(isinf(compare_pictures(&a, &b, 0.001).rel_mse));
	picture_fini(&a);
	picture_fini(&b);
}

static void pictures_that_cannot_be_compared_are_refused(void **unused)
{
	(void)unused;
	struct picture a = make_picture(4, 2, 1), b = make_picture(2, 4, 1);
	struct compare_result r;
	struct error e;
	assert_int_equal(compare_to_reference(&a, &b, 0, &r, &e), -EINVAL);
	assert_non_null(strstr(e.text, "4x2"));
	picture_fini(&b);
	b = make_picture(4, 2, 1);
	*value_at(&b, 1, 6) = NAN;
	assert_int_equal(compare_to_reference(&a, &b, 0, &r, &e), -EINVAL);
	assert_non_null(strstr(e.text, "2,1"));
	picture_fini(&a);
	picture_fini(&b);
}

static void shrinking_takes_means_of_boxes(void **unused)
{
	(void)unused;
	struct picture p = make_picture(4, 6, 0);
	struct error e;
	for (size_t i = 0; i < 24; i++)
		*value_at(&p, 1, i) = (float)i;
	assert_int_equal(picture_shrink(&p, 3, 2, &e), -EINVAL);
	assert_int_equal(picture_shrink(&p, 0, 2, &e), -EINVAL);
	assert_int_equal(picture_shrink(&p, 2, 2, &e), 0);
	const float wanted[] = {4.5f, 6.5f, 16.5f, 18.5f}; /* means of 0 1 4 5, of 2 3 6 7, and so on */
	for (size_t i = 0; i < 4; i++)
		assert_true(p.rgb[1][i] == wanted[i] && p.rgb[0][i] == 0 && p.rgb[2][i] == 0);
	assert_true(p.image.width == 2 && p.image.height == 2);
	picture_fini(&p);
}

/* ---- exactness, by way of files, as the program reads them ---- */

static struct picture write_and_read(struct exr_image *img)
{
	char path[] = "/tmp/hslt-test-XXXXXX";
	unsigned char *bytes;
	size_t size;
	struct picture p;
	struct error e;
	int fd = mkstemp(path);
	assert_true(fd >= 0);
	close(fd);
	assert_int_equal(exr_write(img, &bytes, &size, &e), 0);
	assert_int_equal(image_file_write(path, bytes, size, &e), 0);
	assert_int_equal(picture_read(&p, path, &e), 0);
	unlink(path);
	mem_free(bytes);
	return p;
}

static const struct exr_attribute attributes[] = {
	{"hslt:seed", EXR_ATTRIBUTE_STRING, "7", 0, 0},	       {"hslt:b", EXR_ATTRIBUTE_DOUBLE, NULL, 0.1, 0},
	{"hslt:groups", EXR_ATTRIBUTE_INT, NULL, 0, 16},       {"hslt:wallSeconds", EXR_ATTRIBUTE_DOUBLE, NULL, 3, 0},
	{"hslt:cpuSeconds", EXR_ATTRIBUTE_DOUBLE, NULL, 3, 0}, {"hslt:workers", EXR_ATTRIBUTE_INT, NULL, 0, 2},
	{"hslt:date", EXR_ATTRIBUTE_STRING, "today", 0, 0},
};
enum { ATTRIBUTES = sizeof attributes / sizeof *attributes };

/* Returns whether the image counts as unchanged with these attributes. */
static bool is_same_with_attributes(const struct exr_attribute *changed, size_t count, char *why)
{
	struct exr_attribute copy[ATTRIBUTES];
	struct picture a = make_picture(5, 3, 1), b = make_picture(5, 3, 1);
	memcpy(copy, attributes, sizeof copy);
	a.image.attributes = copy;
	a.image.attribute_count = ATTRIBUTES;
	struct picture one = write_and_read(&a.image);
	memcpy(copy, changed, count * sizeof *changed);
	b.image.attributes = copy;
	b.image.attribute_count = count;
	struct picture other = write_and_read(&b.image);
	bool same = compare_exact(&one.image, &other.image, why, 256);
	assert_int_equal(compare_exact(&other.image, &one.image, why, 256), same);
	a.image.attributes = b.image.attributes = NULL;
	picture_fini(&a);
	picture_fini(&b);
	picture_fini(&one);
	picture_fini(&other);
	return same;
}

static void exact_comparison_sees_all_but_excluded_attributes(void **unused)
{
	(void)unused;
	char why[256];
	for (size_t i = 0; i < ATTRIBUTES; i++) {
		struct exr_attribute changed[ATTRIBUTES];
		memcpy(changed, attributes, sizeof changed);
		if (changed[i].type == EXR_ATTRIBUTE_STRING)
			changed[i].string = "8";
		changed[i].number = nextafter(changed[i].number, 9);
		changed[i].integer++;
		bool excluded = i >= 3;
		assert_int_equal(is_same_with_attributes(changed, ATTRIBUTES, why), excluded);
		if (!excluded)
			assert_non_null(strstr(why, attributes[i].name));
	}
	assert_true(is_same_with_attributes(attributes, ATTRIBUTES, why));
	assert_true(is_same_with_attributes(attributes, 3, why));  /* without the excluded attribute */
	assert_false(is_same_with_attributes(attributes, 2, why)); /* without the group count */
	assert_non_null(strstr(why, "hslt:groups"));
}

static void exact_comparison_sees_one_bit(void **unused)
{
	(void)unused;
	char why[256];
	struct picture a = make_picture(5, 3, 1), b = make_picture(5, 3, 1);
	assert_true(compare_exact(&a.image, &b.image, why, sizeof why));
	*value_at(&b, 2, 8) = nextafterf(1, 2);
	assert_false(compare_exact(&a.image, &b.image, why, sizeof why));
	assert_non_null(strstr(why, "channel B at pixel 3,1"));
	*value_at(&b, 2, 8) = 1;
	*value_at(&a, 0, 14) = -0.0f;
	*value_at(&b, 0, 14) = 0;
	assert_false(compare_exact(&a.image, &b.image, why, sizeof why)); /* equal as numbers */
	*value_at(&a, 0, 14) = *value_at(&b, 0, 14) = NAN;
	assert_true(compare_exact(&a.image, &b.image, why, sizeof why)); /* equal bits, but not equal as numbers */
	b.image.x = 1;
	assert_false(compare_exact(&a.image, &b.image, why, sizeof why));
	b.image.x = 0;
	snprintf(b.image.channel_names[0], sizeof b.image.channel_names[0], "A");
	assert_false(compare_exact(&a.image, &b.image, why, sizeof why));
	assert_non_null(strstr(why, "channel 0"));
	picture_fini(&a);
	picture_fini(&b);
}

static void a_picture_needs_red_green_and_blue(void **unused)
{
	(void)unused;
	char path[] = "/tmp/hslt-test-XXXXXX";
	struct picture a = make_picture(2, 2, 1), p;
	unsigned char *bytes;
	size_t size;
	struct error e;
	int fd = mkstemp(path);
	assert_true(fd >= 0);
	close(fd);
	snprintf(a.image.channel_names[1], sizeof a.image.channel_names[1], "Y");
	assert_int_equal(exr_write(&a.image, &bytes, &size, &e), 0);
	assert_int_equal(image_file_write(path, bytes, size, &e), 0);
	assert_int_equal(picture_read(&p, path, &e), -EINVAL);
	assert_non_null(strstr(e.text, path));
	assert_non_null(strstr(e.text, "no channel G"));
	assert_int_equal(image_file_write(path, (const unsigned char *)"text", 4, &e), 0);
	assert_true(picture_read(&p, path, &e) < 0);
	unlink(path);
	assert_int_equal(picture_read(&p, path, &e), -ENOENT);
	mem_free(bytes);
	picture_fini(&a);
}

static void heatmap_is_written_as_png(void **unused)
{
	(void)unused;
	char path[] = "/tmp/hslt-test-XXXXXX";
	struct picture a = make_picture(4, 1, 1), b = make_picture(4, 1, 1);
	unsigned char rgb[12], back[12];
	struct error e;
	for (int k = 0; k < 3; k++) {
		*value_at(&a, k, 1) = 3;
		*value_at(&a, k, 2) = 1.03162f; /* halfway from 0.1 % to 100 % on a logarithmic scale */
	}
	*value_at(&a, 1, 3) = NAN;
	assert_int_equal(compare_heatmap(&a, &b, rgb, &e), 0);
	assert_true(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
	assert_true(rgb[3] == 255 && rgb[4] == 255 && rgb[5] == 255);
	assert_true(rgb[6] > 210 && rgb[6] < 225 && rgb[7] > 55 && rgb[7] < 75);
	assert_true(rgb[9] == 0 && rgb[10] == 255 && rgb[11] == 255);
	int fd = mkstemp(path);
	assert_true(fd >= 0);
	close(fd);
	if (picture_write_png(path, rgb, 4, 1, &e) != 0)
		fail_msg("%s", e.text);
	png_image png = {.version = PNG_IMAGE_VERSION};
	assert_true(png_image_begin_read_from_file(&png, path));
	assert_true(png.width == 4 && png.height == 1 && png.format == PNG_FORMAT_RGB);
	assert_true(png_image_finish_read(&png, NULL, back, 0, NULL));
	assert_memory_equal(rgb, back, sizeof back);
	unlink(path);
	assert_true(picture_write_png("/dev/null/a.png", rgb, 4, 1, &e) < 0);
	picture_fini(&a);
	picture_fini(&b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(figures_match_those_by_hand),
		cmocka_unit_test(peak_is_a_percentile),
		cmocka_unit_test(equal_pictures_have_an_infinite_psnr),
		cmocka_unit_test(trimming_leaves_out_the_worst_pixels),
		cmocka_unit_test(pictures_that_cannot_be_compared_are_refused),
		cmocka_unit_test(shrinking_takes_means_of_boxes),
		cmocka_unit_test(exact_comparison_sees_all_but_excluded_attributes),
		cmocka_unit_test(exact_comparison_sees_one_bit),
		cmocka_unit_test(a_picture_needs_red_green_and_blue),
		cmocka_unit_test(heatmap_is_written_as_png),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
