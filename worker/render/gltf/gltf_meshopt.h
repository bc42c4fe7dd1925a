/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Compressed buffer views: EXT_meshopt_compression, and KHR_meshopt_compression, which adds further codings. Private to
 * gltf*.c.
 */
#ifndef WORKER_RENDER_GLTF_GLTF_MESHOPT_H
#define WORKER_RENDER_GLTF_GLTF_MESHOPT_H

#include "worker/render/gltf/gltf_tree.h"

/* Returns the extension's object, which locates the compressed bytes as a view does; NULL if the view is not
 * compressed. */
const json_t *gltf_meshopt_extension(struct gltf *g, const struct gltf_entry *view);
/* Returns the decompressed bytes, allocated with mem_alloc(), and stores their number in *count. NULL after a
 * failure. */
unsigned char *gltf_meshopt_decode(struct gltf *g, const struct gltf_entry *view, const json_t *packed,
				   const unsigned char *bytes, uint64_t size, uint64_t *count);

#endif
