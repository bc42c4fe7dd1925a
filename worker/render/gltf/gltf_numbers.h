/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Accessors as numbers, for values that are computed while the file is read: of all types and components, sparse ones,
 * and those without a buffer view, which are zeros. Private to gltf*.c.
 */
#ifndef WORKER_RENDER_GLTF_GLTF_NUMBERS_H
#define WORKER_RENDER_GLTF_GLTF_NUMBERS_H

#include "worker/render/gltf/gltf_tree.h"

struct gltf_vectors {
	double *values; /* allocated with mem_alloc(), or NULL */
	uint64_t count;
	unsigned component_count;
};

/* Reads an accessor. `normalized` integers, which represent -1 to 1 or 0 to 1, are converted. components: the number
 * required, 1 to 4, or 16 for matrices; 0: any. purpose: what the numbers are for, in messages. Returns false after a
 * failure. */
bool gltf_vectors_read(struct gltf *g, const struct gltf_entry *accessor, const char *purpose, unsigned components,
		       struct gltf_vectors *out);
/* Returns what a normalized integer x of that type represents; floats and 32-bit integers are returned unchanged. */
double gltf_normalized_value(double x, uint64_t component);
void gltf_vectors_fini(struct gltf_vectors *v);
void gltf_buffers_close(struct gltf *g);

#endif
