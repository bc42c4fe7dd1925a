/* SPDX-License-Identifier: Apache-2.0 */
/* Finds the bytes of buffers and images. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_BUFFER_H
#define WORKER_RENDER_GLTF_GLTF_BUFFER_H

#include "worker/render/gltf/gltf_tree.h"

int gltf_locate_buffer_view(struct gltf *g, const struct gltf_entry *view, struct gltf_range *buffer, uint64_t *first,
			    uint64_t *count);
int gltf_locate_image(struct gltf *g, const struct gltf_entry *image, struct gltf_range *out);
/* Returns the range of the bytes [begin, end) of a buffer. */
struct gltf_range gltf_range_slice(const struct gltf_range *buffer, uint64_t begin, uint64_t end);
void gltf_put_range(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const struct gltf_range *r);

#endif
