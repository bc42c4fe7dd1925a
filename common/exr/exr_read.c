/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads EXR files from memory with OpenEXRCore: checks the header against the file's size before anything is allocated
 * (exr_check_header), then decodes the chunks directly into the planes of the channels, then reads the attributes
 * hslt:*.
 *
 * Failures: anything that OpenEXR refuses, and whatever exr_check_header refuses, such as deep data or a header with
 * more pixels than the file can hold, are -EBADMSG; planes beyond the caller's limit are -EFBIG, DWA compression is
 * -ENOTSUP. All come with a sentence, and the image is left empty.
 */
#include "common/exr/exr_read.h"

#include "common/base/mem.h"
#include "common/exr/exr_check.h"

#include <string.h>

enum { ATTRIBUTES_MAX = 256 };
/* Most bytes of pixels that one byte of the file can represent: deflate's 1032, times 4/3 because PXR24 drops every
 * fourth byte. */
#define INFLATION_MAX INT64_C(1376)
#define ATTRIBUTE_PREFIX "hslt:"

static int32_t int_min(int32_t a, int32_t b)
{
	return a < b ? a : b;
}

/* Decodes one chunk into the planes. Integer channels are converted afterwards, in read_planes. */
static exr_result_t read_chunk(exr_context_t x, struct exr_image *img, const exr_chunk_info_t *chunk, uint32_t px,
			       uint32_t py)
{
	exr_decode_pipeline_t decode = EXR_DECODE_PIPELINE_INITIALIZER;
	if (px + (uint64_t)chunk->width > img->width || py + (uint64_t)chunk->height > img->height)
		return EXR_ERR_INCORRECT_CHUNK;
	exr_result_t rc = exr_decoding_initialize(x, 0, chunk, &decode);
	for (int c = 0; rc == EXR_ERR_SUCCESS && c < decode.channel_count; c++) {
		exr_coding_channel_info_t *to = &decode.channels[c];
		to->decode_to_ptr = (uint8_t *)(img->planes[c] + (size_t)py * img->width + px);
		to->user_pixel_stride = sizeof(float);
		to->user_line_stride = (int32_t)(img->width * sizeof(float));
		to->user_bytes_per_element = sizeof(float);
		to->user_data_type = to->data_type == EXR_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
	}
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_decoding_choose_default_routines(x, 0, &decode);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_decoding_run(x, 0, &decode);
	exr_decoding_destroy(x, &decode);
	return rc;
}

static exr_result_t read_tiled(exr_context_t x, struct exr_image *img)
{
	int32_t tile_w, tile_h;
	exr_result_t rc = exr_get_tile_sizes(x, 0, 0, 0, &tile_w, &tile_h);
	if (rc != EXR_ERR_SUCCESS || tile_w < 1 || tile_h < 1)
		return rc ? rc : EXR_ERR_BAD_CHUNK_LEADER;
	for (uint32_t y = 0; y < img->height && rc == EXR_ERR_SUCCESS; y += (uint32_t)tile_h)
		for (uint32_t px = 0; px < img->width && rc == EXR_ERR_SUCCESS; px += (uint32_t)tile_w) {
			exr_chunk_info_t chunk;
			rc = exr_read_tile_chunk_info(x, 0, (int)(px / (uint32_t)tile_w), (int)(y / (uint32_t)tile_h),
						      0, 0, &chunk);
			if (rc == EXR_ERR_SUCCESS) {
				chunk.width = int_min(chunk.width, (int32_t)(img->width - px));
				chunk.height = int_min(chunk.height, (int32_t)(img->height - y));
				rc = read_chunk(x, img, &chunk, px, y);
			}
		}
	return rc;
}

static exr_result_t read_scanlines(exr_context_t x, struct exr_image *img)
{
	int32_t rows;
	exr_attr_box2i_t data;
	exr_result_t rc = exr_get_scanlines_per_chunk(x, 0, &rows);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_get_data_window(x, 0, &data);
	for (uint32_t y = 0; rc == EXR_ERR_SUCCESS && y < img->height; y += (uint32_t)rows) {
		exr_chunk_info_t chunk;
		rc = exr_read_scanline_chunk_info(x, 0, data.min.y + (int)y, &chunk);
		if (rc == EXR_ERR_SUCCESS)
			rc = read_chunk(x, img, &chunk, 0, y);
	}
	return rc;
}

static int read_planes(exr_context_t x, const struct exr_stream *s, struct exr_image *img, bool tiled, struct error *e)
{
	size_t pixels = (size_t)img->width * img->height;
	for (uint32_t c = 0; c < img->channel_count; c++) {
		img->planes[c] = mem_alloc(pixels, sizeof(float));
		if (!img->planes[c])
			return error_set(e, ENOMEM, "no memory for an image of %ux%u", img->width, img->height);
	}
	exr_result_t rc = tiled ? read_tiled(x, img) : read_scanlines(x, img);
	if (rc != EXR_ERR_SUCCESS)
		return exr_set_error(s, rc, e);
	const exr_attr_chlist_t *list;
	exr_get_channels(x, 0, &list);
	for (uint32_t c = 0; c < img->channel_count; c++)
		for (size_t i = 0; list->entries[c].pixel_type == EXR_PIXEL_UINT && i < pixels; i++) {
			uint32_t integer;
			memcpy(&integer, &img->planes[c][i], sizeof integer);
			img->planes[c][i] = (float)integer;
		}
	return 0;
}

static int read_attribute(const exr_attribute_t *a, struct exr_attribute *to, struct error *e)
{
	to->type = EXR_ATTRIBUTE_STRING;
	if (a->type == EXR_ATTR_DOUBLE) {
		to->type = EXR_ATTRIBUTE_DOUBLE;
		to->number = a->d;
	} else if (a->type == EXR_ATTR_INT) {
		to->type = EXR_ATTRIBUTE_INT;
		to->integer = a->i;
	}
	to->name = mem_strdup(a->name);
	if (to->type == EXR_ATTRIBUTE_STRING)
		to->string = mem_strdup(a->string->str ? a->string->str : "");
	if (!to->name || (to->type == EXR_ATTRIBUTE_STRING && !to->string))
		return error_set(e, ENOMEM, "no memory for an attribute");
	return 0;
}

static int read_attributes(exr_context_t x, struct exr_image *img, struct error *e)
{
	int32_t count;
	if (exr_get_attribute_count(x, 0, &count) != EXR_ERR_SUCCESS || count > ATTRIBUTES_MAX)
		return error_set(e, EBADMSG, "the EXR file's header has too many attributes");
	img->attributes = mem_alloc((size_t)count, sizeof *img->attributes);
	if (!img->attributes)
		return error_set(e, ENOMEM, "no memory for %d attributes", count);
	int rc = 0;
	for (int32_t i = 0; i < count && rc == 0; i++) {
		const exr_attribute_t *a;
		if (exr_get_attribute_by_index(x, 0, EXR_ATTR_LIST_SORTED_ORDER, i, &a) != EXR_ERR_SUCCESS)
			return error_set(e, EBADMSG, "the EXR file's header is invalid");
		bool is_known_type =
			a->type == EXR_ATTR_DOUBLE || a->type == EXR_ATTR_INT || a->type == EXR_ATTR_STRING;
		if (is_known_type && strncmp(a->name, ATTRIBUTE_PREFIX, strlen(ATTRIBUTE_PREFIX)) == 0)
			rc = read_attribute(a, &img->attributes[img->attribute_count++], e);
	}
	return rc;
}

int exr_read_limited(const unsigned char *bytes, size_t size, int64_t max_bytes, struct exr_image *img, struct error *e)
{
	exr_context_t x;
	struct exr_stream s;
	bool tiled = false;
	*img = (struct exr_image){0};
	int rc = exr_open_read(&x, &s, bytes, size, e);
	if (rc)
		return rc;
	exr_compression_t compression;
	if (exr_get_compression(x, 0, &compression) == EXR_ERR_SUCCESS && exr_is_dwa(compression))
		rc = error_set(e, ENOTSUP,
			       "the EXR file is compressed by DWA; supported: none, RLE, ZIP, PIZ, PXR24, B44");
	else
		rc = exr_check_header(x, &s, &(struct exr_limits){max_bytes, INFLATION_MAX}, img, &tiled, e);
	if (rc == 0)
		rc = read_planes(x, &s, img, tiled, e);
	if (rc == 0)
		rc = read_attributes(x, img, e);
	exr_finish(&x);
	if (rc)
		exr_image_fini(img);
	return rc;
}

int exr_read(const unsigned char *bytes, size_t size, struct exr_image *img, struct error *e)
{
	return exr_read_limited(bytes, size, INT64_MAX, img, e);
}
