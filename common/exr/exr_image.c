/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Writes images as EXR files in memory: OpenEXRCore builds the header and compresses the pixels chunk by chunk; chunks
 * that compression would enlarge are stored raw.
 */
#include "common/exr/exr_image.h"

#include "common/base/mem.h"
#include "common/base/version.h"
#include "common/exr/exr_stream.h"

#include <string.h>

void exr_image_fini(struct exr_image *img)
{
	for (uint32_t c = 0; c < EXR_CHANNELS_MAX; c++)
		mem_free(img->planes[c]);
	for (size_t i = 0; img->attributes && i < img->attribute_count; i++) {
		char *name, *string; /* const in struct exr_attribute, but owned by an image that was read */
		memcpy(&name, &img->attributes[i].name, sizeof name);
		memcpy(&string, &img->attributes[i].string, sizeof string);
		mem_free(name);
		mem_free(string);
	}
	mem_free(img->attributes);
	*img = (struct exr_image){0};
}

const struct exr_attribute *exr_find_attribute(const struct exr_image *img, const char *name)
{
	for (size_t i = 0; i < img->attribute_count; i++)
		if (strcmp(img->attributes[i].name, name) == 0)
			return &img->attributes[i];
	return NULL;
}

static exr_result_t write_attributes(exr_context_t x, const struct exr_image *img)
{
	exr_result_t rc = EXR_ERR_SUCCESS;
	for (size_t i = 0; i < img->attribute_count && rc == EXR_ERR_SUCCESS; i++) {
		const struct exr_attribute *a = &img->attributes[i];
		if (a->type == EXR_ATTRIBUTE_STRING)
			rc = exr_attr_set_string(x, 0, a->name, a->string);
		else if (a->type == EXR_ATTRIBUTE_DOUBLE)
			rc = exr_attr_set_double(x, 0, a->name, a->number);
		else
			rc = exr_attr_set_int(x, 0, a->name, a->integer);
	}
	return rc;
}

uint32_t exr_channel_index(const struct exr_image *img, const char *name)
{
	for (uint32_t c = 0; c < img->channel_count; c++)
		if (strcmp(img->channel_names[c], name) == 0)
			return c;
	return EXR_CHANNELS_MAX;
}

const float *exr_find_plane(const struct exr_image *img, const char *name)
{
	uint32_t c = exr_channel_index(img, name);
	return c < EXR_CHANNELS_MAX ? img->planes[c] : NULL;
}

/* Writes standard attributes: the program that wrote the file and, if there are colours, the primaries of ITU-R BT.709
 * with white D65 (color.h). */
static exr_result_t write_origin(exr_context_t x, const struct exr_image *img)
{
	static const exr_attr_chromaticities_t bt709 = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
	exr_result_t rc = exr_attr_set_string(x, 0, "software", "HSLT Farm " HSLT_VERSION);
	return rc == EXR_ERR_SUCCESS && exr_find_plane(img, "R")
		       ? exr_attr_set_chromaticities(x, 0, "chromaticities", &bt709)
		       : rc;
}

static exr_result_t write_header(exr_context_t x, const struct exr_image *img)
{
	exr_attr_box2i_t data = exr_make_box(img->x, img->y, img->width, img->height);
	exr_attr_box2i_t display = exr_make_box(0, 0, img->full_width, img->full_height);
	const exr_attr_v2f_t center = {{{0, 0}}};
	int part;
	exr_result_t rc = exr_add_part(x, NULL, EXR_STORAGE_SCANLINE, &part);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_initialize_required_attr(x, part, &display, &data, 1, &center, 1, EXR_LINEORDER_INCREASING_Y,
						  EXR_COMPRESSION_ZIP);
	for (uint32_t c = 0; c < img->channel_count && rc == EXR_ERR_SUCCESS; c++)
		rc = exr_add_channel(x, part, img->channel_names[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1,
				     1);
	if (rc == EXR_ERR_SUCCESS)
		rc = write_origin(x, img);
	if (rc == EXR_ERR_SUCCESS)
		rc = write_attributes(x, img);
	return rc == EXR_ERR_SUCCESS ? exr_write_header(x) : rc;
}

struct compressor {
	exr_result_t (*compress)(exr_encode_pipeline_t *encode); /* the library's function for the file's compression */
};

/*
 * Compresses a chunk, or leaves it raw. Readers take a chunk for raw if its stored size equals the size of its pixels.
 * OpenEXRCore 3.1.5 stores a chunk raw only if deflate enlarges it; if deflate's output has exactly the size of the
 * pixels, readers would take it for pixels. Such a chunk is stored raw here.
 */
static exr_result_t compress_or_store(exr_encode_pipeline_t *encode)
{
	const struct compressor *c = encode->encoding_user_data;
	exr_result_t rc = c->compress(encode);
	if (rc == EXR_ERR_SUCCESS && encode->compressed_bytes == encode->packed_bytes)
		memcpy(encode->compressed_buffer, encode->packed_buffer, encode->packed_bytes);
	return rc;
}

static exr_result_t write_chunk(exr_context_t x, const struct exr_image *img, uint32_t first_row)
{
	exr_chunk_info_t chunk;
	exr_encode_pipeline_t encode = EXR_ENCODE_PIPELINE_INITIALIZER;
	exr_result_t rc = exr_write_scanline_chunk_info(x, 0, (int)(img->y + first_row), &chunk);
	if (rc != EXR_ERR_SUCCESS)
		return rc;
	rc = exr_encoding_initialize(x, 0, &chunk, &encode);
	if (rc != EXR_ERR_SUCCESS)
		return rc;
	for (int c = 0; c < encode.channel_count; c++) {
		exr_coding_channel_info_t *to = &encode.channels[c];
		const float *plane = exr_find_plane(img, to->channel_name) + (size_t)first_row * img->width;
		to->encode_from_ptr = (const uint8_t *)plane;
		to->user_pixel_stride = sizeof(float);
		to->user_line_stride = (int32_t)(img->width * sizeof(float));
	}
	rc = exr_encoding_choose_default_routines(x, 0, &encode);
	struct compressor library = {encode.compress_fn};
	if (library.compress) {
		encode.encoding_user_data = &library;
		encode.compress_fn = compress_or_store;
	}
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_encoding_run(x, 0, &encode);
	exr_encoding_destroy(x, &encode);
	return rc;
}

int exr_write(const struct exr_image *img, unsigned char **bytes, size_t *size, struct error *e)
{
	exr_context_t x;
	struct exr_stream s;
	if (img->width < 1 || img->height < 1 || img->channel_count < 1 || img->channel_count > EXR_CHANNELS_MAX ||
	    (int64_t)img->width * img->height > EXR_PIXELS_MAX)
		return error_set(e, EINVAL, "an image of %ux%u with %u channels cannot be written", img->width,
				 img->height, img->channel_count);
	int rc = exr_open_write(&x, &s, 1 << 16, e);
	if (rc)
		return rc;
	int32_t rows = 1;
	exr_result_t written = write_header(x, img);
	if (written == EXR_ERR_SUCCESS)
		written = exr_get_scanlines_per_chunk(x, 0, &rows);
	for (uint32_t y = 0; y < img->height && written == EXR_ERR_SUCCESS; y += (uint32_t)rows)
		written = write_chunk(x, img, y);
	return exr_close_write(&x, &s, written, bytes, size, e);
}
