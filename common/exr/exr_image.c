/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Writing builds the header with OpenEXRCore and compresses chunk by chunk, storing chunks raw if compression would
 * enlarge them. Reading checks the header against the file's size before it allocates, then decodes chunks directly
 * into the planes of the channels.
 *
 * Failures: anything that OpenEXR refuses, headers that promise more pixels than the bytes can hold, channels other
 * than floats, halves and integers, tiles with levels, deep data. All are -EBADMSG or -ENOTSUP with a sentence, and
 * nothing is kept.
 */
#include "common/exr/exr_image.h"

#include "common/base/mem.h"
#include "common/base/version.h"
#include "common/exr/exr_stream.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

enum { CHANNELS_MOST = 16, ATTRIBUTES_MOST = 256 };
#define PIXELS_MOST (INT64_C(1) << 28)
#define VALUES_MOST (INT64_C(1) << 30)
/* Bytes of pixels that one byte of the file can represent: deflate's 1032, times 4/3 because PXR24 drops every
 * fourth byte. */
#define INFLATION_MOST INT64_C(1376)
#define ATTRIBUTE_PREFIX "hslt:"

void exr_image_fini(struct exr_image *img)
{
	for (uint32_t c = 0; c < CHANNELS_MOST; c++)
		mem_free(img->planes[c]);
	for (size_t i = 0; img->attributes && i < img->attribute_count; i++) {
		char *name, *string; /* owned, const for readers only */
		memcpy(&name, &img->attributes[i].name, sizeof name);
		memcpy(&string, &img->attributes[i].string, sizeof string);
		mem_free(name);
		mem_free(string);
	}
	mem_free(img->attributes);
	*img = (struct exr_image){0};
}

/* ---- writing */

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

static const float *plane_of(const struct exr_image *img, const char *name)
{
	for (uint32_t c = 0; c < img->channel_count; c++)
		if (strcmp(img->names[c], name) == 0)
			return img->planes[c];
	return NULL;
}

/* Attributes for any viewer: who wrote the file, and that the colours are those of ITU-R BT.709, linear, white D65
 * (color.h). */
static exr_result_t write_origin(exr_context_t x, const struct exr_image *img)
{
	static const exr_attr_chromaticities_t bt709 = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
	exr_result_t rc = exr_attr_set_string(x, 0, "software", "HSLT Farm " HSLT_VERSION);
	return rc == EXR_ERR_SUCCESS && plane_of(img, "R") ? exr_attr_set_chromaticities(x, 0, "chromaticities", &bt709)
							   : rc;
}

static exr_result_t write_header(exr_context_t x, const struct exr_image *img)
{
	exr_attr_box2i_t data = exr_box(img->x, img->y, img->width, img->height);
	exr_attr_box2i_t display = exr_box(0, 0, img->full_width, img->full_height);
	const exr_attr_v2f_t center = {{{0, 0}}};
	int part;
	exr_result_t rc = exr_add_part(x, NULL, EXR_STORAGE_SCANLINE, &part);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_initialize_required_attr(x, part, &display, &data, 1, &center, 1, EXR_LINEORDER_INCREASING_Y,
						  EXR_COMPRESSION_ZIP);
	for (uint32_t c = 0; c < img->channel_count && rc == EXR_ERR_SUCCESS; c++)
		rc = exr_add_channel(x, part, img->names[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
	if (rc == EXR_ERR_SUCCESS)
		rc = write_origin(x, img);
	if (rc == EXR_ERR_SUCCESS)
		rc = write_attributes(x, img);
	return rc == EXR_ERR_SUCCESS ? exr_write_header(x) : rc;
}

struct compressor {
	exr_result_t (*run)(exr_encode_pipeline_t *encode); /* the library's own attributes */
};

/*
 * A chunk whose stored size equals the size of its pixels is read as raw. OpenEXRCore 3.1.5 stores raw only what
 * deflate enlarges, so deflated data of exactly that size would be taken for pixels.
 */
static exr_result_t compress_or_store(exr_encode_pipeline_t *encode)
{
	const struct compressor *c = encode->encoding_user_data;
	exr_result_t rc = c->run(encode);
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
		const float *plane = plane_of(img, to->channel_name) + (size_t)first_row * img->width;
		to->encode_from_ptr = (const uint8_t *)plane;
		to->user_pixel_stride = sizeof(float);
		to->user_line_stride = (int32_t)(img->width * sizeof(float));
	}
	rc = exr_encoding_choose_default_routines(x, 0, &encode);
	struct compressor library = {encode.compress_fn};
	if (library.run) {
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
	if (img->width < 1 || img->height < 1 || img->channel_count < 1 || img->channel_count > CHANNELS_MOST ||
	    (int64_t)img->width * img->height > PIXELS_MOST)
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

/* ---- reading */

static int check_channels(const exr_attr_chlist_t *list, struct exr_image *img, struct error *e)
{
	if (list->num_channels < 1 || list->num_channels > CHANNELS_MOST)
		return error_set(e, EBADMSG, "%d channels; 1 to %d are supported", list->num_channels, CHANNELS_MOST);
	for (int c = 0; c < list->num_channels; c++) {
		const exr_attr_chlist_entry_t *entry = list->entries + c;
		if (entry->x_sampling != 1 || entry->y_sampling != 1)
			return error_set(e, EBADMSG, "channel %s is subsampled", entry->name.str);
		if (entry->name.length >= (int)sizeof img->names[0])
			return error_set(e, EBADMSG, "a channel's name has %d characters", entry->name.length);
		snprintf(img->names[c], sizeof img->names[c], "%s", entry->name.str);
	}
	img->channel_count = (uint32_t)list->num_channels;
	return 0;
}

/* The bytes of a pixel in all channels, before compression. */
static int64_t pixel_bytes(const exr_attr_chlist_t *list)
{
	int64_t sum = 0;
	for (int c = 0; c < list->num_channels; c++)
		sum += list->entries[c].pixel_type == EXR_PIXEL_HALF ? 2 : 4;
	return sum;
}

static int check_header(exr_context_t x, const struct exr_stream *s, int64_t bytes_most, struct exr_image *img,
			bool *tiled, struct error *e)
{
	int parts;
	exr_storage_t storage;
	exr_compression_t compression;
	exr_attr_box2i_t data, display;
	const exr_attr_chlist_t *channels;
	if (exr_get_count(x, &parts) || parts != 1)
		return error_set(e, EBADMSG, "the EXR file has several parts; one is supported");
	if (exr_get_storage(x, 0, &storage) || (storage != EXR_STORAGE_TILED && storage != EXR_STORAGE_SCANLINE))
		return error_set(e, EBADMSG, "a deep EXR file; only flat images are supported");
	if (exr_get_compression(x, 0, &compression) || compression >= EXR_COMPRESSION_DWAA)
		return error_set(e, EBADMSG,
				 "the EXR file is compressed by DWA; supported: none, RLE, ZIP, PIZ, PXR24, B44");
	if (exr_get_data_window(x, 0, &data) || exr_get_display_window(x, 0, &display) ||
	    exr_get_channels(x, 0, &channels))
		return error_set(e, EBADMSG, "the EXR file's header is not complete");
	int64_t width = (int64_t)data.max.x - data.min.x + 1, height = (int64_t)data.max.y - data.min.y + 1;
	if (width < 1 || height < 1 || width > EXR_MAX_SIDE || height > EXR_MAX_SIDE || width * height > PIXELS_MOST ||
	    width * height * channels->num_channels > VALUES_MOST)
		return error_set(e, EBADMSG, "the EXR file has %lldx%lld pixels", (long long)width, (long long)height);
	if (width * height * channels->num_channels * (int64_t)sizeof(float) > bytes_most)
		return error_set(e, EFBIG, "%lld x %lld pixels of %d channels take %lld MB decoded; at most %lld MB",
				 (long long)width, (long long)height, channels->num_channels,
				 (long long)(width * height * channels->num_channels * (int64_t)sizeof(float)) >> 20,
				 (long long)bytes_most >> 20);
	if (width * height * pixel_bytes(channels) / INFLATION_MOST > (int64_t)s->size)
		return error_set(e, EBADMSG, "the EXR file is too short for %lldx%lld pixels", (long long)width,
				 (long long)height);
	img->width = (uint32_t)width;
	img->height = (uint32_t)height;
	/* Windows that begin left of or above the display window cannot be expressed by unsigned numbers; only the
	 * size is reported. */
	int64_t dx = (int64_t)data.min.x - display.min.x, dy = (int64_t)data.min.y - display.min.y;
	img->x = dx > 0 ? (uint32_t)dx : 0;
	img->y = dy > 0 ? (uint32_t)dy : 0;
	img->full_width = (uint32_t)((int64_t)display.max.x - display.min.x + 1);
	img->full_height = (uint32_t)((int64_t)display.max.y - display.min.y + 1);
	*tiled = storage == EXR_STORAGE_TILED;
	return check_channels(channels, img, e);
}

static int32_t smaller(int32_t a, int32_t b)
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
				chunk.width = smaller(chunk.width, (int32_t)(img->width - px));
				chunk.height = smaller(chunk.height, (int32_t)(img->height - y));
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
		return exr_failed(s, rc, e);
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
	if (exr_get_attribute_count(x, 0, &count) != EXR_ERR_SUCCESS || count > ATTRIBUTES_MOST)
		return error_set(e, EBADMSG, "the EXR file's header has too many attributes");
	img->attributes = mem_alloc((size_t)count, sizeof *img->attributes);
	if (!img->attributes)
		return error_set(e, ENOMEM, "no memory for %d attributes", count);
	int rc = 0;
	for (int32_t i = 0; i < count && rc == 0; i++) {
		const exr_attribute_t *a;
		if (exr_get_attribute_by_index(x, 0, EXR_ATTR_LIST_SORTED_ORDER, i, &a) != EXR_ERR_SUCCESS)
			return error_set(e, EBADMSG, "the EXR file's header is invalid");
		bool known = a->type == EXR_ATTR_DOUBLE || a->type == EXR_ATTR_INT || a->type == EXR_ATTR_STRING;
		if (known && strncmp(a->name, ATTRIBUTE_PREFIX, strlen(ATTRIBUTE_PREFIX)) == 0)
			rc = read_attribute(a, &img->attributes[img->attribute_count++], e);
	}
	return rc;
}

int exr_read_within(const unsigned char *bytes, size_t size, int64_t bytes_most, struct exr_image *img, struct error *e)
{
	exr_context_t x;
	struct exr_stream s;
	bool tiled = false;
	*img = (struct exr_image){0};
	int rc = exr_open_read(&x, &s, bytes, size, e);
	if (rc)
		return rc;
	rc = check_header(x, &s, bytes_most, img, &tiled, e);
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
	return exr_read_within(bytes, size, INT64_MAX, img, e);
}
