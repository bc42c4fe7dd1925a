/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A range of a file's bytes, as files that hold others need it (glTF): as they stand there, or written in base64. The
 * node says which by `filename`, `first_byte`, `byte_count` and `base64`; without them it is the whole file. Any
 * thread.
 */
#ifndef WORKER_RENDER_SCENE_ASSET_PART_H
#define WORKER_RENDER_SCENE_ASSET_PART_H

#include "worker/render/scene/scene.h"

struct asset_part {
	const unsigned char *bytes;
	size_t size;
	struct asset file;
	unsigned char *decoded; /* NULL: the file's own */
};

/* -EINVAL where the range is not in the file, or is no base64. asset_part_close after 0 alone. */
int asset_part_open(struct asset_part *p, const struct scene_node *n, const struct asset_source *assets,
		    struct error *e);
void asset_part_close(struct asset_part *p, const struct asset_source *assets);

#define ASSET_PART_BYTES_MAX 4294967296.0
#define ASSET_PART_PARAMS                                                                          \
	{.name = "first_byte", .types = VALUE_INT, .min = 0, .max = ASSET_PART_BYTES_MAX},         \
		{.name = "byte_count", .types = VALUE_INT, .min = 0, .max = ASSET_PART_BYTES_MAX}, \
	{                                                                                          \
		.name = "base64", .types = VALUE_BOOL                                              \
	}

#endif
