/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A range of a file's bytes, as files that hold others need it (glTF): as they stand there, or written in base64. The
 * node says which by `filename`, `first_byte`, `byte_count` and `base64`; without them it is the whole file. What is
 * base64 may begin within a group of four letters: the first `skip_bytes` that are decoded do not belong to it. Or the
 * node has the bytes itself, in base64, as `embedded`. Any thread.
 */
#ifndef WORKER_RENDER_SCENE_ASSET_PART_H
#define WORKER_RENDER_SCENE_ASSET_PART_H

#include "worker/render/asset/asset_range.h"
#include "worker/render/scene/scene.h"

/* Errors as of asset_range_open, with the node's place. asset_range_close after 0 alone. */
int asset_part_open(struct asset_range *p, const struct scene_node *n, const struct asset_source *assets,
		    struct error *e);

#define ASSET_PART_BYTES_MAX 4294967296.0
#define ASSET_PART_PARAMS                                                                          \
	{.name = "first_byte", .types = VALUE_INT, .min = 0, .max = ASSET_PART_BYTES_MAX},         \
		{.name = "byte_count", .types = VALUE_INT, .min = 0, .max = ASSET_PART_BYTES_MAX}, \
		{.name = "skip_bytes", .types = VALUE_INT, .min = 0, .max = 2},                    \
	{                                                                                          \
		.name = "base64", .types = VALUE_BOOL                                              \
	}

#endif
