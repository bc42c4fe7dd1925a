/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/image/picture.h"

#include "common/base/mem.h"
#include "common/exr/image_file.h"
#include "common/exr/exr_read.h"

#include <png.h>
#include <stdio.h>

static const char *const rgb_names[3] = {"R", "G", "B"};

static int find_rgb(struct picture *p, struct error *e)
{
	const struct exr_image *img = &p->image;
	for (int k = 0; k < 3; k++) {
		p->rgb[k] = exr_find_plane(img, rgb_names[k]);
		if (!p->rgb[k])
			return error_set(e, EINVAL, "it has no channel %s (of R, G and B); its first one is %s",
					 rgb_names[k], img->channel_names[0]);
	}
	return 0;
}

int picture_read(struct picture *p, const char *path, struct error *e)
{
	unsigned char *bytes = NULL;
	size_t size = 0;
	*p = (struct picture){0};
	int rc = image_file_read(path, &bytes, &size, e);
	if (rc)
		return rc;
	rc = exr_read(bytes, size, &p->image, e);
	mem_free(bytes);
	if (rc == 0)
		rc = find_rgb(p, e);
	if (rc) {
		picture_fini(p);
		return error_prefix(e, rc, "%s", path);
	}
	return 0;
}

void picture_fini(struct picture *p)
{
	exr_image_fini(&p->image);
	*p = (struct picture){0};
}

static void shrink_plane(const float *from, uint32_t from_width, float *to, uint32_t width, uint32_t height,
			 uint32_t box_width, uint32_t box_height)
{
	for (size_t y = 0; y < height; y++)
		for (size_t x = 0; x < width; x++) {
			double sum = 0;
			for (size_t j = y * box_height; j < (y + 1) * box_height; j++)
				for (size_t i = x * box_width; i < (x + 1) * box_width; i++)
					sum += (double)from[j * from_width + i];
			to[y * width + x] = (float)(sum / ((double)box_width * box_height));
		}
}

int picture_shrink(struct picture *p, uint32_t width, uint32_t height, struct error *e)
{
	const struct exr_image *from = &p->image;
	if (width < 1 || height < 1 || from->width % width || from->height % height)
		return error_set(e, EINVAL, "%ux%u pixels cannot be averaged to %ux%u: the sizes must divide",
				 from->width, from->height, width, height);
	struct picture small = {.image = {.width = width,
					  .height = height,
					  .channel_count = 3,
					  .full_width = width,
					  .full_height = height}};
	for (int k = 0; k < 3; k++) {
		float *plane = small.image.planes[k] = mem_alloc((size_t)width * height, sizeof *plane);
		if (!plane) {
			picture_fini(&small);
			return error_set(e, ENOMEM, "no memory for a picture of %ux%u", width, height);
		}
		snprintf(small.image.channel_names[k], sizeof small.image.channel_names[k], "%s", rgb_names[k]);
		shrink_plane(p->rgb[k], from->width, plane, width, height, from->width / width, from->height / height);
		small.rgb[k] = plane;
	}
	picture_fini(p);
	*p = small;
	return 0;
}

int picture_encode_png(const unsigned char *rgb, uint32_t width, uint32_t height, unsigned char **bytes, size_t *size,
		       struct error *e)
{
	png_image png = {.version = PNG_IMAGE_VERSION, .width = width, .height = height, .format = PNG_FORMAT_RGB};
	*size = PNG_IMAGE_PNG_SIZE_MAX(png);
	*bytes = mem_alloc(*size, 1);
	if (!*bytes)
		return error_set(e, ENOMEM, "no memory for a PNG of %ux%u", width, height);
	int rc = 0;
	if (!png_image_write_to_memory(&png, *bytes, size, 0, rgb, 0, NULL)) {
		rc = error_set(e, EINVAL, "PNG: %s", png.message);
		mem_free(*bytes);
		*bytes = NULL;
	}
	png_image_free(&png);
	return rc;
}

int picture_write_png(const char *path, const unsigned char *rgb, uint32_t width, uint32_t height, struct error *e)
{
	unsigned char *bytes;
	size_t size;
	int rc = picture_encode_png(rgb, width, height, &bytes, &size, e);
	if (rc)
		return error_prefix(e, rc, "%s", path);
	rc = image_file_write(path, bytes, size, e);
	mem_free(bytes);
	return rc;
}
