/* SPDX-License-Identifier: Apache-2.0 */
/* Mitsuba's grids of numbers (.vol, version 3), as 32-bit floats or bytes. One thread. */
#ifndef WORKER_RENDER_VOLUME_GRID_FILE_H
#define WORKER_RENDER_VOLUME_GRID_FILE_H

#include "worker/render/scene/scene.h"

enum { GRID_SIDE_MAX = 1024 };

struct grid_file {
	uint32_t size[3]; /* 1 .. GRID_SIDE_MAX */
	uint32_t channels;
	double box[2][3];      /* two corners, as the file states them */
	float *value;	       /* channels fastest, then x, z slowest; finite; bytes count as 0 to 1; in the arena */
	double least, largest; /* of all values */
	unsigned char *full;   /* the grid's bricks (grid.h), of files that are shared; in the arena */
};

/* The files that a scene has read: volumes of one file share its numbers. By hashes of their names. */
struct grid_entry;
enum { GRID_LISTS = 1 << 10 };
struct grid_cache {
	struct grid_entry *first[GRID_LISTS];
};

/* The file that a node names, of one channel, with `most` 3 of one or three, with 6 of six. -ENOENT, -EINVAL,
 * -ENOTSUP, -ERANGE, -ENOMEM. */
int grid_file_read(const struct scene_node *n, const struct asset_source *assets, uint32_t most, struct arena *arena,
		   struct grid_file *out, struct error *e);
/* The same with 3, from the cache if it is there. The arena must outlive the cache. */
int grid_file_share(struct grid_cache *cache, const struct scene_node *n, const struct asset_source *assets,
		    struct arena *arena, struct grid_file *out, struct error *e);

#endif
