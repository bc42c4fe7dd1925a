/* SPDX-License-Identifier: Apache-2.0 */
/* Finds the bytes of buffers and images. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_BUFFER_H
#define WORKER_RENDER_GLTF_GLTF_BUFFER_H

#include "worker/render/gltf/gltf_tree.h"

int gltf_buffer_view(struct gltf *g, const struct gltf_at *view, struct gltf_range *buffer, uint64_t *first,
		     uint64_t *count);
int gltf_image_range(struct gltf *g, const struct gltf_at *image, struct gltf_range *out);
/* Returns the range of the bytes [begin, end) of a buffer. */
struct gltf_range gltf_range_part(const struct gltf_range *buffer, uint64_t begin, uint64_t end);
void gltf_put_range(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const struct gltf_range *r);

#endif
