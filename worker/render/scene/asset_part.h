/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A range of a file's bytes, for files that contain other files (glTF), stored as they are or encoded in base64. The
 * node gives the range by `filename`, `first_byte`, `byte_count` and `base64`; by default it is the whole file. Data in
 * base64 may begin in the middle of a group of four characters: the first `skip_bytes` decoded bytes do not belong to
 * it. Instead of a file, the node may have the bytes themselves, in base64, as `embedded`. Any thread.
 */
#ifndef WORKER_RENDER_SCENE_ASSET_PART_H
#define WORKER_RENDER_SCENE_ASSET_PART_H

#include "worker/render/asset/asset_range.h"
#include "worker/render/scene/scene.h"

/* Fails like asset_range_open(); the error begins with the node's place. Call asset_range_close() only after
 * success. */
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
