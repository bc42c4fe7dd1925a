/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The format: "VOL", the version 3, and as 32-bit little-endian numbers the type (1: floats, 3: bytes), three sizes,
 * the number of channels, a box of six floats, and the values.
 *
 * Reading fails if the format, the type or the number of channels is another one, if a side is longer than
 * GRID_SIDE_MAX, if the file is too short, or if a value is not finite.
 */
#include "worker/render/volume/grid_file.h"

#include "common/base/bytes.h"
#include "common/base/fnv.h"
#include "common/base/liveness.h"
#include "worker/render/scene/asset_part.h"
#include "worker/render/volume/grid.h"

#include <string.h>

enum { VERSION = 3, FLOATS = 1, BYTES = 3, HEADER_BYTES = 4 + 4 * 5 + 4 * 6, TICK_INTERVAL = 1 << 16 };

/* Reads and checks the header. *count: number of all values. */
static int read_header(const unsigned char *p, size_t size, const struct scene_node *n, const char *name,
		       uint32_t max_channels, struct grid_file *out, uint64_t *count, struct error *e)
{
	if (size < HEADER_BYTES || memcmp(p, "VOL", 3) != 0)
		return node_error(n, e, EINVAL, "%s: this is not a grid of numbers (.vol)", name);
	uint32_t type = get32(p + 4);
	out->channels = get32(p + 20);
	bool is_supported = out->channels == max_channels || (max_channels == 3 && out->channels == 1);
	if (p[3] != VERSION || (type != FLOATS && type != BYTES) || !is_supported)
		return node_error(n, e, ENOTSUP,
				  "%s: version %u, type %u, %u channels; supported are version 3, types 1 (floats) and "
				  "3 (bytes), %s",
				  name, p[3], type, out->channels,
				  max_channels == 1   ? "1 channel"
				  : max_channels == 3 ? "1 channel or 3"
						      : "6 channels");
	*count = out->channels;
	for (int i = 0; i < 3; i++) {
		out->size[i] = get32(p + 8 + 4 * i);
		if (out->size[i] < 1 || out->size[i] > GRID_SIDE_MAX)
			return node_error(n, e, ERANGE, "%s: %u values along %c; 1 to %d are supported", name,
					  out->size[i], "xyz"[i], GRID_SIDE_MAX);
		*count *= out->size[i];
		for (int k = 0; k < 2; k++)
			out->box[k][i] = (double)get_float(p + 24 + 4 * (3 * k + i));
	}
	if ((size - HEADER_BYTES) / (type == FLOATS ? 4 : 1) < *count)
		return node_error(n, e, EINVAL, "%s: too short for %llu values", name, (unsigned long long)*count);
	return 0;
}

static int read_grid(const unsigned char *p, size_t size, const struct scene_node *n, const char *name,
		     uint32_t max_channels, struct arena *arena, struct grid_file *out, struct error *e)
{
	uint64_t count = 0;
	int rc = read_header(p, size, n, name, max_channels, out, &count, e);
	if (rc)
		return rc;
	bool floats = get32(p + 4) == FLOATS;
	out->value = arena_alloc(arena, count, sizeof *out->value);
	if (!out->value)
		return node_error(n, e, ENOMEM, "%s: out of memory", name);
	out->min_value = INFINITY;
	out->max_value = -INFINITY;
	for (uint64_t i = 0; i < count; i++) {
		out->value[i] = floats ? get_float(p + HEADER_BYTES + 4 * i) : (float)p[HEADER_BYTES + i] / 255;
		if (!isfinite(out->value[i]))
			return node_error(n, e, EINVAL, "%s: value %llu is not finite", name, (unsigned long long)i);
		out->min_value = fmin(out->min_value, (double)out->value[i]);
		out->max_value = fmax(out->max_value, (double)out->value[i]);
		if (i % TICK_INTERVAL == 0)
			liveness_tick();
	}
	return 0;
}

int grid_file_read(const struct scene_node *n, const struct asset_source *assets, uint32_t max_channels,
		   struct arena *arena, struct grid_file *out, struct error *e)
{
	struct asset_range a;
	*out = (struct grid_file){.value = NULL};
	int rc = asset_part_open(&a, n, assets, e);
	if (rc)
		return rc;
	rc = read_grid(a.bytes, a.size, n, node_string(n, "filename", ""), max_channels, arena, out, e);
	asset_range_close(&a, assets);
	return rc;
}

/* ---- the cache ---- */

struct grid_cache_entry {
	const char *name;
	struct grid_file file;
	struct grid_cache_entry *next;
};

static struct grid_cache_entry **bucket_of(struct grid_cache *cache, const char *name)
{
	uint64_t h = fnv_add(FNV_OFFSET_BASIS, name, strlen(name));
	return &cache->bucket[(h ^ h >> 32) % GRID_CACHE_BUCKETS];
}

int grid_file_read_cached(struct grid_cache *cache, const struct scene_node *n, const struct asset_source *assets,
			  struct arena *arena, struct grid_file *out, struct error *e)
{
	const char *name = node_string(n, "filename", "");
	struct grid_cache_entry **bucket = bucket_of(cache, name), *entry;
	for (entry = *bucket; entry; entry = entry->next)
		if (strcmp(entry->name, name) == 0) {
			*out = entry->file;
			return 0;
		}
	int rc = grid_file_read(n, assets, 3, arena, out, e);
	if (rc)
		return rc;
	const struct grid g = {.size = {(int)out->size[0], (int)out->size[1], (int)out->size[2]},
			       .channels = (int)out->channels,
			       .value = out->value};
	out->occupied_bricks = arena_alloc(arena, grid_brick_count(&g), 1);
	entry = arena_alloc(arena, 1, sizeof *entry);
	if (!out->occupied_bricks || !entry)
		return node_error(n, e, ENOMEM, "out of memory");
	grid_find_occupied_bricks(&g, out->occupied_bricks);
	*entry = (struct grid_cache_entry){name, *out, *bucket};
	*bucket = entry;
	return 0;
}
