/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads DWA-compressed images with OpenEXR's C++ library. That library trusts the sizes in headers, so it never gets to
 * see a foreign header: OpenEXRCore reads and checks the file, writes a new header, and copies the compressed chunks
 * behind it unchanged. The new file is in memory (memfd), but is opened as /proc/self/fd/N, because the library's C
 * interface (ImfCRgbaFile.h) opens files by name. It decodes 256 rows at a time.
 *
 * Refused with a sentence: whatever exr_check_header refuses, images with neither R, G and B nor Y, chunks larger than
 * the file, and whatever OpenEXR refuses.
 */
#include "common/exr/exr_dwa.h"

#include "common/base/io.h"
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "common/exr/exr_check.h"

#include <OpenEXR/ImfCRgbaFile.h>

#include <pthread.h>
#include <stdio.h>
#include <sys/mman.h>
#include <unistd.h>

/* DWA stores one number for a block of 64 equal ones, and deflate then compresses by up to 1032. */
#define INFLATION_MAX (INT64_C(64) * 1032)
/* DWAB compresses 256 rows at a time, DWAA 32. The library allocates memory for a whole chunk or tile even if the image
 * is smaller, so the size of chunks is bounded. */
enum { ROWS_MAX = 256, CHUNK_PIXELS_MAX = 1 << 25 };

/* OpenEXR's C interface keeps its last error message in a global variable. */
static pthread_mutex_t decode_lock = PTHREAD_MUTEX_INITIALIZER;

static int set_openexr_error(struct error *e)
{
	return error_set(e, EBADMSG, "OpenEXR: %.200s", ImfErrorMessage());
}

static bool has_channel(const struct exr_image *img, const char *name)
{
	return exr_channel_index(img, name) < EXR_CHANNELS_MAX;
}

/* Replaces the channels of img by R, G and B, or Y, and allocates their planes. */
static int choose_channels(struct exr_image *img, struct error *e)
{
	static const char *const rgb[3] = {"R", "G", "B"};
	bool colour = has_channel(img, "R") && has_channel(img, "G") && has_channel(img, "B");
	if (!colour && !has_channel(img, "Y"))
		return error_set(e, ENOTSUP, "compressed by DWA, without channels R, G and B, or Y");
	img->channel_count = colour ? 3 : 1;
	for (uint32_t c = 0; c < img->channel_count; c++) {
		snprintf(img->channel_names[c], sizeof img->channel_names[c], "%s", colour ? rgb[c] : "Y");
		img->planes[c] = mem_alloc((size_t)img->width * img->height, sizeof(float));
		if (!img->planes[c])
			return error_set(e, ENOMEM, "no memory for an image of %ux%u", img->width, img->height);
	}
	return 0;
}

static exr_result_t write_header(exr_context_t from, exr_context_t to, const struct exr_image *img, bool tiled)
{
	exr_compression_t compression = EXR_COMPRESSION_NONE;
	const exr_attr_chlist_t *channels = NULL;
	const exr_attr_v2f_t center = {{{0, 0}}};
	exr_attr_box2i_t all = exr_make_box(0, 0, img->width, img->height);
	int32_t tile_w, tile_h;
	int part;
	exr_result_t rc = exr_add_part(to, NULL, tiled ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_get_compression(from, 0, &compression);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_initialize_required_attr(to, part, &all, &all, 1, &center, 1, EXR_LINEORDER_INCREASING_Y,
						  compression);
	if (rc == EXR_ERR_SUCCESS && tiled)
		rc = exr_get_tile_sizes(from, 0, 0, 0, &tile_w, &tile_h);
	if (rc == EXR_ERR_SUCCESS && tiled)
		rc = exr_set_tile_descriptor(to, part, (uint32_t)tile_w, (uint32_t)tile_h, EXR_TILE_ONE_LEVEL,
					     EXR_TILE_ROUND_DOWN);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_get_channels(from, 0, &channels);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_set_channels(to, part, channels);
	return rc == EXR_ERR_SUCCESS ? exr_write_header(to) : rc;
}

/* Reads the compressed bytes of a chunk into new memory, which the caller frees also after an error. max_size: the size
 * of the file, which no chunk can exceed. */
static exr_result_t read_packed_chunk(exr_context_t from, const exr_chunk_info_t *chunk, size_t max_size, void **packed)
{
	if (chunk->packed_size > max_size)
		return EXR_ERR_BAD_CHUNK_LEADER;
	*packed = mem_alloc((size_t)chunk->packed_size, 1);
	return *packed ? exr_read_chunk(from, 0, chunk, *packed) : EXR_ERR_OUT_OF_MEMORY;
}

static exr_result_t copy_rows(exr_context_t from, exr_context_t to, const struct exr_image *img, size_t max_size)
{
	exr_attr_box2i_t data;
	int32_t rows = 1;
	exr_result_t rc = exr_get_data_window(from, 0, &data);
	if (rc == EXR_ERR_SUCCESS)
		rc = exr_get_scanlines_per_chunk(from, 0, &rows);
	for (uint32_t y = 0; rc == EXR_ERR_SUCCESS && y < img->height; y += (uint32_t)rows) {
		exr_chunk_info_t chunk;
		void *packed = NULL;
		rc = exr_read_scanline_chunk_info(from, 0, data.min.y + (int)y, &chunk);
		if (rc == EXR_ERR_SUCCESS)
			rc = read_packed_chunk(from, &chunk, max_size, &packed);
		if (rc == EXR_ERR_SUCCESS)
			rc = exr_write_scanline_chunk(to, 0, (int)y, packed, chunk.packed_size);
		mem_free(packed);
	}
	return rc;
}

static exr_result_t copy_tiles(exr_context_t from, exr_context_t to, const struct exr_image *img, size_t max_size)
{
	int32_t w = 0, h = 0;
	exr_result_t rc = exr_get_tile_sizes(from, 0, 0, 0, &w, &h);
	if (rc == EXR_ERR_SUCCESS && (w < 1 || h < 1))
		rc = EXR_ERR_BAD_CHUNK_LEADER;
	for (uint32_t y = 0; rc == EXR_ERR_SUCCESS && y * (uint64_t)h < img->height; y++)
		for (uint32_t x = 0; rc == EXR_ERR_SUCCESS && x * (uint64_t)w < img->width; x++) {
			exr_chunk_info_t chunk;
			void *packed = NULL;
			rc = exr_read_tile_chunk_info(from, 0, (int)x, (int)y, 0, 0, &chunk);
			if (rc == EXR_ERR_SUCCESS)
				rc = read_packed_chunk(from, &chunk, max_size, &packed);
			if (rc == EXR_ERR_SUCCESS)
				rc = exr_write_tile_chunk(to, 0, (int)x, (int)y, 0, 0, packed, chunk.packed_size);
			mem_free(packed);
		}
	return rc;
}

/* Writes a file with the same compressed pixels, but with a data window that begins at (0, 0). *bytes is freed with
 * mem_free. */
static int rewrite_file(exr_context_t from, size_t max_size, const struct exr_image *img, bool tiled,
			unsigned char **bytes, size_t *size, struct error *e)
{
	exr_context_t to;
	struct exr_stream s;
	int rc = exr_open_write(&to, &s, max_size, e);
	if (rc)
		return rc;
	exr_result_t result = write_header(from, to, img, tiled);
	if (result == EXR_ERR_SUCCESS)
		result = tiled ? copy_tiles(from, to, img, max_size) : copy_rows(from, to, img, max_size);
	return exr_close_write(&to, &s, result, bytes, size, e);
}

static int check_chunks(exr_context_t x, const struct exr_image *img, bool tiled, struct error *e)
{
	int32_t w = (int32_t)img->width, h = ROWS_MAX;
	if (tiled && (exr_get_tile_sizes(x, 0, 0, 0, &w, &h) != EXR_ERR_SUCCESS || w < 1 || h < 1))
		return error_set(e, EBADMSG, "the EXR file has no tiles");
	if ((int64_t)w * h > CHUNK_PIXELS_MAX)
		return error_set(e, EFBIG, "the EXR file is compressed in chunks of %d x %d pixels; at most %d", w, h,
				 CHUNK_PIXELS_MAX);
	return 0;
}

static int check_and_rewrite(const unsigned char *input, size_t input_size, int64_t max_bytes, struct exr_image *img,
			     unsigned char **bytes, size_t *size, struct error *e)
{
	exr_context_t x;
	struct exr_stream s;
	bool tiled;
	int rc = exr_open_read(&x, &s, input, input_size, e);
	if (rc)
		return rc;
	rc = exr_check_header(x, &s, &(struct exr_limits){max_bytes, INFLATION_MAX}, img, &tiled, e);
	if (!rc)
		rc = check_chunks(x, img, tiled, e);
	if (!rc)
		rc = rewrite_file(x, input_size, img, tiled, bytes, size, e);
	exr_finish(&x);
	return rc ? rc : choose_channels(img, e);
}

static int create_memory_file(const unsigned char *bytes, size_t size, struct error *e)
{
	int fd = memfd_create("image.exr", MFD_CLOEXEC);
	if (fd >= 0 && io_write_all(fd, bytes, size) == 0)
		return fd;
	if (fd >= 0)
		close(fd);
	return error_set(e, ENOMEM, "no memory for an EXR file");
}

/* Decodes into the planes. rows: a buffer for up to ROWS_MAX rows; the library takes the address that pixel (0, 0) of
 * the image would have. */
static int read_rows(ImfInputFile *in, ImfRgba *rows, struct exr_image *img, struct error *e)
{
	for (uint32_t y = 0; y < img->height; y += ROWS_MAX) {
		uint32_t count = img->height - y < ROWS_MAX ? img->height - y : ROWS_MAX;
		size_t first = (size_t)y * img->width, pixels = (size_t)count * img->width;
		ImfRgba *origin = (ImfRgba *)((uintptr_t)rows - first * sizeof *rows);
		if (!ImfInputSetFrameBuffer(in, origin, 1, img->width) ||
		    !ImfInputReadPixels(in, (int)y, (int)(y + count - 1)))
			return set_openexr_error(e);
		for (size_t i = 0; i < pixels; i++) {
			const ImfHalf value[3] = {rows[i].r, rows[i].g, rows[i].b};
			for (uint32_t c = 0; c < img->channel_count; c++)
				img->planes[c][first + i] = ImfHalfToFloat(value[c]);
		}
		liveness_tick();
	}
	return 0;
}

static int decode_file(int fd, struct exr_image *img, struct error *e)
{
	char path[32];
	snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
	size_t count = img->height < ROWS_MAX ? img->height : ROWS_MAX;
	ImfRgba *rows = mem_alloc(count * img->width, sizeof *rows);
	if (!rows)
		return error_set(e, ENOMEM, "no memory to decode an image");
	pthread_mutex_lock(&decode_lock);
	ImfInputFile *in = ImfOpenInputFile(path);
	int rc = in ? read_rows(in, rows, img, e) : set_openexr_error(e);
	if (in)
		ImfCloseInputFile(in);
	pthread_mutex_unlock(&decode_lock);
	mem_free(rows);
	return rc;
}

int exr_read_dwa(const unsigned char *bytes, size_t size, int64_t max_bytes, struct exr_image *img, struct error *e)
{
	unsigned char *rewritten = NULL;
	size_t rewritten_size = 0;
	*img = (struct exr_image){0};
	int rc = check_and_rewrite(bytes, size, max_bytes, img, &rewritten, &rewritten_size, e);
	int fd = rc ? -1 : create_memory_file(rewritten, rewritten_size, e);
	mem_free(rewritten);
	if (!rc && fd < 0)
		rc = fd;
	if (!rc)
		rc = decode_file(fd, img, e);
	if (fd >= 0)
		close(fd);
	if (rc)
		exr_image_fini(img);
	return rc;
}
