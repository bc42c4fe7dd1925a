/* SPDX-License-Identifier: Apache-2.0 */
#include "common/exr/exr_tile.h"

#include "common/base/bytes.h"
#include "common/base/mem.h"
#include "common/exr/exr_stream.h"

#include <string.h>

static const char *const channel_names[TILE_CHANNELS] = {"X", "Y", "Z"}; /* in the file's order */

enum { HEADER_SIZE_MAX = 1024 };

size_t exr_tile_size_max(uint32_t width, uint32_t height)
{
	return (size_t)width * height * TILE_CHANNELS * sizeof(float) + HEADER_SIZE_MAX;
}

static exr_result_t write_header(exr_context_t x, const struct tile *t, uint32_t full_width, uint32_t full_height)
{
	exr_attr_box2i_t data = exr_make_box(t->x, t->y, t->width, t->height),
			 display = exr_make_box(0, 0, full_width, full_height);
	const exr_attr_v2f_t center = {{{0, 0}}};
	int part;
	exr_result_t rc = exr_add_part(x, "tile", EXR_STORAGE_TILED, &part);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_initialize_required_attr(x, part, &display, &data, 1, &center, 1, EXR_LINEORDER_RANDOM_Y,
						  EXR_COMPRESSION_NONE);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_set_tile_descriptor(x, part, TILE_SIZE, TILE_SIZE, EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN);
	for (int c = 0; c < TILE_CHANNELS && rc == EXR_ERR_SUCCESS; c++)
		rc = exr_add_channel(x, part, channel_names[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
	return rc == EXR_ERR_SUCCESS ? exr_write_header(x) : rc;
}

/* Converts from [row][pixel][channel] to the file's [row][channel][pixel], little endian. */
static void pack_rows(const struct tile *t, float *to)
{
	size_t width = t->width;
	for (size_t y = 0; y < t->height; y++, to += width * TILE_CHANNELS) {
		const float *row = t->xyz + y * width * TILE_CHANNELS;
		for (size_t x = 0; x < width; x++)
			for (size_t c = 0; c < TILE_CHANNELS; c++)
				to[c * width + x] = row[x * TILE_CHANNELS + c];
		copy_numbers(to, to, sizeof *to, width * TILE_CHANNELS);
	}
}

/* The inverse of pack_rows. */
static void unpack_rows(const unsigned char *from, const struct tile *t)
{
	float line[TILE_CHANNELS][TILE_SIZE];
	size_t row_bytes = t->width * sizeof(float);
	for (size_t y = 0; y < t->height; y++) {
		float *row = t->xyz + y * t->width * TILE_CHANNELS;
		for (size_t c = 0; c < TILE_CHANNELS; c++, from += row_bytes)
			copy_numbers(line[c], from, sizeof(float), t->width);
		for (size_t x = 0; x < t->width; x++) {
			row[x * TILE_CHANNELS] = line[0][x];
			row[x * TILE_CHANNELS + 1] = line[1][x];
			row[x * TILE_CHANNELS + 2] = line[2][x];
		}
	}
}

int exr_tile_write(const struct tile *t, uint32_t full_width, uint32_t full_height, unsigned char **bytes, size_t *size,
		   struct error *e)
{
	exr_context_t x;
	struct exr_stream s;
	float packed[TILE_SIZE * TILE_SIZE * TILE_CHANNELS];
	if (t->width < 1 || t->height < 1 || t->width > TILE_SIZE || t->height > TILE_SIZE)
		return error_set(e, EINVAL, "a tile of %ux%u pixels", t->width, t->height);
	int rc = exr_open_write(&x, &s, exr_tile_size_max(t->width, t->height), e);
	if (rc)
		return rc;
	pack_rows(t, packed);
	exr_result_t written = write_header(x, t, full_width, full_height);
	if (written == EXR_ERR_SUCCESS)
		written = exr_write_tile_chunk(x, 0, 0, 0, 0, 0, packed,
					       (uint64_t)t->width * t->height * TILE_CHANNELS * sizeof(float));
	return exr_close_write(&x, &s, written, bytes, size, e);
}

/* Checks that the header is one that exr_tile_write produces. Returns NULL and sets the place and size of *t, or
 * returns the reason for refusing the file. */
static const char *check_header(exr_context_t x, uint32_t full_width, uint32_t full_height, struct tile *t)
{
	int parts;
	exr_storage_t storage;
	exr_compression_t compression;
	exr_lineorder_t order;
	const exr_attr_chlist_t *channels;
	exr_attr_box2i_t data, display;
	uint32_t tile_w, tile_h;
	exr_tile_level_mode_t levels;
	exr_tile_round_mode_t rounding;
	if (exr_get_count(x, &parts) || parts != 1 || exr_get_storage(x, 0, &storage) || storage != EXR_STORAGE_TILED)
		return "not one tiled part";
	if (exr_get_compression(x, 0, &compression) || compression != EXR_COMPRESSION_NONE ||
	    exr_get_lineorder(x, 0, &order) || order != EXR_LINEORDER_RANDOM_Y)
		return "compressed, or in another order of lines";
	if (exr_get_tile_descriptor(x, 0, &tile_w, &tile_h, &levels, &rounding) || tile_w != TILE_SIZE ||
	    tile_h != TILE_SIZE || levels != EXR_TILE_ONE_LEVEL)
		return "another size of tiles";
	if (exr_get_channels(x, 0, &channels) || channels->num_channels != TILE_CHANNELS)
		return "another number of channels";
	for (int c = 0; c < TILE_CHANNELS; c++) {
		const exr_attr_chlist_entry_t *entry = channels->entries + c;
		if (strcmp(entry->name.str, channel_names[c]) != 0 || entry->pixel_type != EXR_PIXEL_FLOAT ||
		    entry->x_sampling != 1 || entry->y_sampling != 1)
			return "other channels than X Y Z float";
	}
	if (exr_get_data_window(x, 0, &data) || exr_get_display_window(x, 0, &display) || display.min.x != 0 ||
	    display.min.y != 0 || (int64_t)display.max.x + 1 != full_width || (int64_t)display.max.y + 1 != full_height)
		return "a display window that is not the film";
	int64_t width = (int64_t)data.max.x - data.min.x + 1, height = (int64_t)data.max.y - data.min.y + 1;
	if (data.min.x < 0 || data.min.y < 0 || data.max.x >= (int64_t)full_width ||
	    data.max.y >= (int64_t)full_height || width < 1 || height < 1 || width > TILE_SIZE || height > TILE_SIZE)
		return "a data window that is no tile of the film";
	*t = (struct tile){(uint32_t)data.min.x, (uint32_t)data.min.y, (uint32_t)width, (uint32_t)height, NULL};
	return NULL;
}

int exr_tile_read(const unsigned char *bytes, size_t size, uint32_t full_width, uint32_t full_height, struct tile *t,
		  struct error *e)
{
	exr_context_t x;
	struct exr_stream s;
	exr_chunk_info_t chunk;
	*t = (struct tile){0};
	int rc = exr_open_read(&x, &s, bytes, size, e);
	if (rc)
		return error_prefix(e, rc, "tile");
	struct tile found;
	const char *why = check_header(x, full_width, full_height, &found);
	if (why) {
		rc = error_set(e, EBADMSG, "not a tile of the film: %s", why);
	} else if (exr_read_tile_chunk_info(x, 0, 0, 0, 0, 0, &chunk) != EXR_ERR_SUCCESS) {
		rc = error_set(e, EBADMSG, "a tile without its pixels");
	} else {
		uint64_t expected = (uint64_t)found.width * found.height * TILE_CHANNELS * sizeof(float);
		if (chunk.packed_size != expected || chunk.data_offset > size || expected > size - chunk.data_offset)
			rc = error_set(e, EBADMSG, "a tile of %llu bytes where there should be %llu",
				       (unsigned long long)chunk.packed_size, (unsigned long long)expected);
		else if (!(found.xyz = mem_alloc(expected, 1)))
			rc = error_set(e, ENOMEM, "no memory for a tile");
		else
			unpack_rows(bytes + chunk.data_offset, &found);
	}
	exr_finish(&x);
	if (rc == 0)
		*t = found;
	return rc;
}
