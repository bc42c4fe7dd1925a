/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Compressed buffer views: EXT_meshopt_compression, and KHR_meshopt_compression, which adds codings to it. Private to
 * gltf*.c.
 */
#ifndef WORKER_RENDER_GLTF_GLTF_MESHOPT_H
#define WORKER_RENDER_GLTF_GLTF_MESHOPT_H

#include "worker/render/gltf/gltf_tree.h"

/* The extension's object, which names the compressed bytes as a view does; NULL: the view is as it stands. */
const json_t *gltf_meshopt(struct gltf *g, const struct gltf_at *view);
/* What the `size` bytes stand for; mem_alloc'd. NULL after a failure. */
unsigned char *gltf_meshopt_decode(struct gltf *g, const struct gltf_at *view, const json_t *packed,
				   const unsigned char *bytes, uint64_t size, uint64_t *count);

#endif
