/* SPDX-License-Identifier: Apache-2.0 */
#include "common/exr/exr_check.h"

#include <stdio.h>
#include <string.h>

#define VALUES_MAX (INT64_C(1) << 30)

static int check_channels(const exr_attr_chlist_t *list, struct exr_image *img, struct error *e)
{
	if (list->num_channels < 1 || list->num_channels > EXR_CHANNELS_MAX)
		return error_set(e, EBADMSG, "%d channels; 1 to %d are supported", list->num_channels,
				 EXR_CHANNELS_MAX);
	for (int c = 0; c < list->num_channels; c++) {
		const exr_attr_chlist_entry_t *entry = list->entries + c;
		if (entry->x_sampling != 1 || entry->y_sampling != 1)
			return error_set(e, EBADMSG, "channel %s is subsampled", entry->name.str);
		if (entry->name.length >= (int)sizeof img->channel_names[0])
			return error_set(e, EBADMSG, "a channel's name has %d characters", entry->name.length);
		snprintf(img->channel_names[c], sizeof img->channel_names[c], "%s", entry->name.str);
	}
	img->channel_count = (uint32_t)list->num_channels;
	return 0;
}

/* Returns the bytes of a pixel in all channels, before compression. */
static int64_t pixel_bytes(const exr_attr_chlist_t *list)
{
	int64_t sum = 0;
	for (int c = 0; c < list->num_channels; c++)
		sum += list->entries[c].pixel_type == EXR_PIXEL_HALF ? 2 : 4;
	return sum;
}

bool exr_is_dwa(exr_compression_t c)
{
	return c == EXR_COMPRESSION_DWAA || c == EXR_COMPRESSION_DWAB;
}

static void read_primaries(exr_context_t x, struct exr_image *img)
{
	exr_attr_chromaticities_t c;
	if (exr_attr_get_chromaticities(x, 0, "chromaticities", &c) != EXR_ERR_SUCCESS)
		return;
	img->has_primaries = true;
	memcpy(img->primaries,
	       (float[]){c.red_x, c.red_y, c.green_x, c.green_y, c.blue_x, c.blue_y, c.white_x, c.white_y},
	       sizeof img->primaries);
}

int exr_check_header(exr_context_t x, const struct exr_stream *s, const struct exr_limits *limits,
		     struct exr_image *img, bool *tiled, struct error *e)
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
	if (exr_get_compression(x, 0, &compression) || compression < 0 || compression > EXR_COMPRESSION_DWAB)
		return error_set(e, EBADMSG, "the EXR file has an unknown compression");
	if (exr_get_data_window(x, 0, &data) || exr_get_display_window(x, 0, &display) ||
	    exr_get_channels(x, 0, &channels))
		return error_set(e, EBADMSG, "the EXR file's header is not complete");
	int64_t width = (int64_t)data.max.x - data.min.x + 1, height = (int64_t)data.max.y - data.min.y + 1;
	if (width < 1 || height < 1 || width > EXR_SIDE_MAX || height > EXR_SIDE_MAX ||
	    width * height > EXR_PIXELS_MAX || width * height * channels->num_channels > VALUES_MAX)
		return error_set(e, EBADMSG, "the EXR file has %lldx%lld pixels", (long long)width, (long long)height);
	if (width * height * channels->num_channels * (int64_t)sizeof(float) > limits->max_bytes)
		return error_set(e, EFBIG, "%lld x %lld pixels of %d channels take %lld MB decoded; at most %lld MB",
				 (long long)width, (long long)height, channels->num_channels,
				 (long long)(width * height * channels->num_channels * (int64_t)sizeof(float)) >> 20,
				 (long long)limits->max_bytes >> 20);
	if (width * height * pixel_bytes(channels) / limits->max_inflation > (int64_t)s->size)
		return error_set(e, EBADMSG, "the EXR file is too short for %lldx%lld pixels", (long long)width,
				 (long long)height);
	img->width = (uint32_t)width;
	img->height = (uint32_t)height;
	/* If a data window begins left of or above the display window, its position is lost: it would be negative. */
	int64_t dx = (int64_t)data.min.x - display.min.x, dy = (int64_t)data.min.y - display.min.y;
	img->x = dx > 0 ? (uint32_t)dx : 0;
	img->y = dy > 0 ? (uint32_t)dy : 0;
	img->full_width = (uint32_t)((int64_t)display.max.x - display.min.x + 1);
	img->full_height = (uint32_t)((int64_t)display.max.y - display.min.y + 1);
	read_primaries(x, img);
	*tiled = storage == EXR_STORAGE_TILED;
	return check_channels(channels, img, e);
}
