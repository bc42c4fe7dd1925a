/* SPDX-License-Identifier: Apache-2.0 */
/* Mitsuba's grids of numbers (.vol, version 3), of one channel of 32-bit floats. One thread. */
#ifndef WORKER_RENDER_SHAPE_VOLUME_FILE_H
#define WORKER_RENDER_SHAPE_VOLUME_FILE_H

#include "worker/render/scene/scene.h"

enum { VOLUME_SIDE_MAX = 1024 };

struct volume_grid {
	uint32_t size[3]; /* 2 .. VOLUME_SIDE_MAX */
	float *value;	  /* x fastest, z slowest; finite; mem_alloc'd */
};

/* The file that a shape names. The box in it is not used. */
int volume_file_read(const struct scene_node *n, const struct asset_source *assets, struct volume_grid *out,
		     struct error *e);
void volume_grid_free(struct volume_grid *g);

#endif
