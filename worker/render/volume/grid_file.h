/* SPDX-License-Identifier: Apache-2.0 */
/* Reads Mitsuba's grid volumes (.vol, version 3) of 32-bit floats or bytes. One thread. */
#ifndef WORKER_RENDER_VOLUME_GRID_FILE_H
#define WORKER_RENDER_VOLUME_GRID_FILE_H

#include "worker/render/scene/scene.h"

enum { GRID_SIDE_MAX = 1024 };

struct grid_file {
	uint32_t size[3]; /* 1 .. GRID_SIDE_MAX */
	uint32_t channels;
	double box[2][3]; /* two corners, as the file states them */
	float *value;	  /* channels vary fastest, z slowest; finite; bytes become 0 to 1; in the arena */
	double min_value, max_value;
	unsigned char *occupied_bricks; /* as in struct grid; only set by grid_file_read_cached; in the arena */
};

/* A hash table, by name, of the files that a scene has read: volumes from the same file share its values. */
struct grid_cache_entry;
enum { GRID_CACHE_BUCKETS = 1 << 10 };
struct grid_cache {
	struct grid_cache_entry *bucket[GRID_CACHE_BUCKETS];
};

/* Reads the file that a node names. max_channels: 1 accepts files of one channel, 3 of one or three, 6 of six. Returns
 * 0, -ENOENT, -EINVAL, -ENOTSUP, -ERANGE or -ENOMEM. */
int grid_file_read(const struct scene_node *n, const struct asset_source *assets, uint32_t max_channels,
		   struct arena *arena, struct grid_file *out, struct error *e);
/* Like grid_file_read() with max_channels 3, but from the cache if the file has been read before. The arena must
 * outlive the cache. */
int grid_file_read_cached(struct grid_cache *cache, const struct scene_node *n, const struct asset_source *assets,
			  struct arena *arena, struct grid_file *out, struct error *e);

#endif
