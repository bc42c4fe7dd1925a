/* SPDX-License-Identifier: Apache-2.0 */
/*
 * OpenEXRCore checks the header, then the bytes go into a memory file, because the RGBA interface opens files by name,
 * and are decoded some rows at a time. Failures: what exr_check refuses, images without R, G and B, or Y, and what
 * OpenEXR refuses, all with a sentence.
 */
#include "common/exr/exr_dwa.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "common/exr/exr_check.h"

#include <OpenEXR/ImfCRgbaFile.h>

#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* Of 64 numbers that are all the same, DWA stores one, and deflate compresses it. */
#define INFLATION_MOST (INT64_C(64) * 1032)
/* DWAB compresses 256 rows at a time, DWAA 32. */
enum { ROWS = 256 };

/* OpenEXR's C interface keeps its last message in one place. */
static pthread_mutex_t one_at_a_time = PTHREAD_MUTEX_INITIALIZER;

static int refused(struct error *e)
{
	return error_set(e, EBADMSG, "OpenEXR: %.200s", ImfErrorMessage());
}

static bool has(const struct exr_image *img, const char *name)
{
	for (uint32_t c = 0; c < img->channel_count; c++)
		if (strcmp(img->names[c], name) == 0)
			return true;
	return false;
}

/* Only the planes that are read. */
static int choose_channels(struct exr_image *img, struct error *e)
{
	static const char *const rgb[3] = {"R", "G", "B"};
	bool colour = has(img, "R") && has(img, "G") && has(img, "B");
	if (!colour && !has(img, "Y"))
		return error_set(e, ENOTSUP, "compressed by DWA, without channels R, G and B, or Y");
	img->channel_count = colour ? 3 : 1;
	for (uint32_t c = 0; c < img->channel_count; c++) {
		snprintf(img->names[c], sizeof img->names[c], "%s", colour ? rgb[c] : "Y");
		img->planes[c] = mem_alloc((size_t)img->width * img->height, sizeof(float));
		if (!img->planes[c])
			return error_set(e, ENOMEM, "no memory for an image of %ux%u", img->width, img->height);
	}
	return 0;
}

static int check(const unsigned char *bytes, size_t size, int64_t bytes_most, struct exr_image *img, struct error *e)
{
	exr_context_t x;
	struct exr_stream s;
	bool tiled;
	int rc = exr_open_read(&x, &s, bytes, size, e);
	if (rc)
		return rc;
	rc = exr_check(x, &s, &(struct exr_limits){bytes_most, INFLATION_MOST}, img, &tiled, e);
	exr_finish(&x);
	return rc ? rc : choose_channels(img, e);
}

static int memory_file(const unsigned char *bytes, size_t size, struct error *e)
{
	int fd = memfd_create("image.exr", MFD_CLOEXEC);
	for (size_t done = 0; fd >= 0 && done < size;) {
		ssize_t n = write(fd, bytes + done, size - done);
		if (n > 0) {
			done += (size_t)n;
			continue;
		}
		if (n < 0 && errno == EINTR)
			continue;
		close(fd);
		fd = -1;
	}
	return fd >= 0 ? fd : error_set(e, ENOMEM, "no memory for an EXR file");
}

/* rows: room for ROWS rows. The interface wants the address that pixel (0, 0) would have. */
static int read_rows(ImfInputFile *in, ImfRgba *rows, struct exr_image *img, struct error *e)
{
	int low_x, low_y, high_x, high_y;
	ImfHeaderDataWindow(ImfInputHeader(in), &low_x, &low_y, &high_x, &high_y);
	if ((int64_t)high_x - low_x + 1 != img->width || (int64_t)high_y - low_y + 1 != img->height)
		return error_set(e, EBADMSG, "the EXR file's header says two things");
	for (uint32_t y = 0; y < img->height; y += ROWS) {
		uint32_t count = img->height - y < ROWS ? img->height - y : ROWS;
		int64_t offset = (int64_t)low_x + ((int64_t)low_y + y) * img->width;
		ImfRgba *origin = (ImfRgba *)((intptr_t)rows - (intptr_t)(offset * (int64_t)sizeof *rows));
		if (!ImfInputSetFrameBuffer(in, origin, 1, img->width) ||
		    !ImfInputReadPixels(in, low_y + (int)y, low_y + (int)(y + count - 1)))
			return refused(e);
		size_t first = (size_t)y * img->width, pixels = (size_t)count * img->width;
		for (size_t i = 0; i < pixels; i++) {
			const ImfHalf value[3] = {rows[i].r, rows[i].g, rows[i].b};
			for (uint32_t c = 0; c < img->channel_count; c++)
				img->planes[c][first + i] = ImfHalfToFloat(value[c]);
		}
		tick();
	}
	return 0;
}

static int decode(int fd, struct exr_image *img, struct error *e)
{
	char path[32];
	snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
	ImfRgba *rows = mem_alloc((size_t)ROWS * img->width, sizeof *rows);
	if (!rows)
		return error_set(e, ENOMEM, "no memory to decode an image");
	pthread_mutex_lock(&one_at_a_time);
	ImfInputFile *in = ImfOpenInputFile(path);
	int rc = in ? read_rows(in, rows, img, e) : refused(e);
	if (in)
		ImfCloseInputFile(in);
	pthread_mutex_unlock(&one_at_a_time);
	mem_free(rows);
	return rc;
}

int exr_read_dwa(const unsigned char *bytes, size_t size, int64_t bytes_most, struct exr_image *img, struct error *e)
{
	*img = (struct exr_image){0};
	int rc = check(bytes, size, bytes_most, img, e);
	int fd = rc ? -1 : memory_file(bytes, size, e);
	if (!rc && fd < 0)
		rc = fd;
	if (!rc)
		rc = decode(fd, img, e);
	if (fd >= 0)
		close(fd);
	if (rc)
		exr_image_fini(img);
	return rc;
}
