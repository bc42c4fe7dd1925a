/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Accessors as numbers, for what is computed while the file is read: of all types and components, sparse ones, and such
 * without a buffer view, which are zeros. Private to gltf*.c.
 */
#ifndef WORKER_RENDER_GLTF_GLTF_NUMBERS_H
#define WORKER_RENDER_GLTF_GLTF_NUMBERS_H

#include "worker/render/gltf/gltf_tree.h"

struct gltf_vectors {
	double *x; /* mem_alloc'd; NULL if there are none */
	uint64_t count;
	unsigned components;
};

/* Integers that represent -1 to 1 or 0 to 1 (`normalized`) become that. components: 1 to 4, and 16 for matrices; 0:
 * as the accessor says. use: what for, in messages. */
bool gltf_vectors_read(struct gltf *g, const struct gltf_at *accessor, const char *use, unsigned components,
		       struct gltf_vectors *out);
/* What a whole number x of that type represents then; others are as they are. */
double gltf_normalized(double x, uint64_t component);
void gltf_vectors_fini(struct gltf_vectors *v);
void gltf_numbers_close(struct gltf *g);

#endif
