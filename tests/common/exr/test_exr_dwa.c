/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Images compressed by DWA, as OpenEXR writes them: the pixels are read back except for DWA's losses; damaged files are
 * refused, or read as some image.
 */
#include "common/exr/exr_dwa.h"

#include "common/base/mem.h"
#include "common/exr/exr_read.h"

#include <OpenEXR/ImfCRgbaFile.h>

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmocka.h>

enum { W = 71, H = 300, LEFT = -9, TOP = 4 };

/* Smooth, from 0.2 to 3. */
static double value_at(int channel, int x, int y)
{
	return 1.6 + (channel == 1 ? -1 : 1) * 1.4 * sin(0.05 * x + 0.02 * y + channel);
}

/* Makes a file of W x H pixels, in tiles of 32 x 16 if `tiled`. */
static unsigned char *make_dwa_file(int compression, int channels, bool tiled, size_t *size)
{
	static ImfRgba pixels[W * H];
	char path[32];
	int fd = memfd_create("written.exr", MFD_CLOEXEC);
	assert_true(fd >= 0);
	snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
	for (int i = 0; i < W * H; i++) {
		ImfFloatToHalf((float)value_at(0, i % W, i / W), &pixels[i].r);
		ImfFloatToHalf((float)value_at(channels == IMF_WRITE_Y ? 0 : 1, i % W, i / W), &pixels[i].g);
		ImfFloatToHalf((float)value_at(channels == IMF_WRITE_Y ? 0 : 2, i % W, i / W), &pixels[i].b);
		ImfFloatToHalf(0.5f, &pixels[i].a);
	}
	ImfHeader *h = ImfNewHeader();
	ImfHeaderSetDataWindow(h, LEFT, TOP, LEFT + W - 1, TOP + H - 1);
	ImfHeaderSetDisplayWindow(h, LEFT, TOP, LEFT + W - 1, TOP + H - 1);
	ImfHeaderSetCompression(h, compression);
	const ImfRgba *origin = (const ImfRgba *)((intptr_t)pixels - (LEFT + TOP * W) * (intptr_t)sizeof *pixels);
	if (tiled) {
		ImfTiledOutputFile *out = ImfOpenTiledOutputFile(path, h, channels, 32, 16, IMF_ONE_LEVEL, 0);
		assert_non_null(out);
		assert_int_equal(ImfTiledOutputSetFrameBuffer(out, origin, 1, W), 1);
		assert_int_equal(ImfTiledOutputWriteTiles(out, 0, (W + 31) / 32 - 1, 0, (H + 15) / 16 - 1, 0, 0), 1);
		assert_int_equal(ImfCloseTiledOutputFile(out), 1);
	} else {
		ImfOutputFile *out = ImfOpenOutputFile(path, h, channels);
		assert_non_null(out);
		assert_int_equal(ImfOutputSetFrameBuffer(out, origin, 1, W), 1);
		assert_int_equal(ImfOutputWritePixels(out, H), 1);
		assert_int_equal(ImfCloseOutputFile(out), 1);
	}
	ImfDeleteHeader(h);
	*size = (size_t)lseek(fd, 0, SEEK_END);
	unsigned char *bytes = mem_alloc(*size, 1);
	assert_int_equal(pread(fd, bytes, *size, 0), (ssize_t)*size);
	close(fd);
	return bytes;
}

static void test_pixels_survive_dwa_compression(void **state)
{
	(void)state;
	static const struct {
		int compression, channels;
		bool tiled;
	} cases[] = {{IMF_DWAA_COMPRESSION, IMF_WRITE_RGB, false},
		     {IMF_DWAB_COMPRESSION, IMF_WRITE_RGBA, false},
		     {IMF_DWAA_COMPRESSION, IMF_WRITE_Y, false},
		     {IMF_DWAB_COMPRESSION, IMF_WRITE_RGB, true},
		     {IMF_DWAA_COMPRESSION, IMF_WRITE_RGBA, true}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct exr_image img;
		struct error e = {""};
		size_t size;
		unsigned char *bytes = make_dwa_file(cases[i].compression, cases[i].channels, cases[i].tiled, &size);
		bool grey = cases[i].channels == IMF_WRITE_Y;
		assert_int_equal(exr_read_limited(bytes, size, INT64_MAX, &img, &e), -ENOTSUP);
		assert_non_null(strstr(e.text, "DWA"));
		if (exr_read_dwa(bytes, size, INT64_MAX, &img, &e))
			fail_msg("%zu: %s", i, e.text);
		assert_int_equal(img.width, W);
		assert_int_equal(img.height, H);
		assert_int_equal(img.channel_count, grey ? 1 : 3);
		assert_string_equal(img.channel_names[0], grey ? "Y" : "R");
		double worst = 0;
		for (uint32_t c = 0; c < img.channel_count; c++)
			for (int k = 0; k < W * H; k++)
				worst = fmax(worst,
					     fabs((double)img.planes[c][k] / value_at((int)c, k % W, k / W) - 1));
		print_message("file %zu: %zu bytes, off by at most %.4f\n", i, size, worst);
		assert_true(worst < 0.05);
		exr_image_fini(&img);
		mem_free(bytes);
	}
}

/* Larger than allowed; not DWA; truncated; with changed bits. */
static void test_damaged_or_oversized_files_are_refused(void **state)
{
	(void)state;
	struct exr_image img;
	struct error e = {""};
	size_t size, refused = 0, count = 0;
	unsigned char *bytes = make_dwa_file(IMF_DWAA_COMPRESSION, IMF_WRITE_RGB, false, &size),
		      *copy = mem_alloc(size, 1);
	assert_int_equal(exr_read_dwa(bytes, size, (int64_t)W * H * 3 * 4 - 1, &img, &e), -EFBIG);
	assert_int_equal(exr_read_dwa(bytes, 3, INT64_MAX, &img, &e), -EBADMSG);
	for (size_t n = 0; n < size; n += 61, count++) {
		memcpy(copy, bytes, n);
		if (exr_read_dwa(copy, n, INT64_MAX, &img, &e) == 0)
			exr_image_fini(&img);
		else
			refused++;
	}
	assert_int_equal(refused, count);
	for (size_t i = 0; i < 600; i++) {
		memcpy(copy, bytes, size);
		copy[i * (size - 1) / 600] ^= (unsigned char)(1u << (i * 7 % 8));
		if (exr_read_dwa(copy, size, INT64_MAX, &img, &e) == 0)
			exr_image_fini(&img);
	}
	/* The image is so wide that the library's buffer for 256 rows would take 300 MB. */
	static const char window[] = "dataWindow\0box2i\0\x10\0\0";
	const int32_t right = LEFT + 140000 - 1;
	size_t offset = 0;
	while (memcmp(bytes + offset, window, sizeof window) != 0)
		offset++;
	memcpy(bytes + offset + sizeof window + 8, &right, sizeof right);
	assert_int_equal(exr_read_dwa(bytes, size, INT64_MAX, &img, &e), -EFBIG);
	assert_non_null(strstr(e.text, "chunks of 140000 x 256 pixels"));
	mem_free(copy);
	mem_free(bytes);
	bytes = make_dwa_file(IMF_DWAA_COMPRESSION, IMF_WRITE_A, false, &size);
	assert_int_equal(exr_read_dwa(bytes, size, INT64_MAX, &img, &e), -ENOTSUP);
	assert_non_null(strstr(e.text, "without channels R, G and B, or Y"));
	mem_free(bytes);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_pixels_survive_dwa_compression),
					   cmocka_unit_test(test_damaged_or_oversized_files_are_refused)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
