/* SPDX-License-Identifier: Apache-2.0 */
/* Version 1 of meshopt's coding of attributes, which meshoptimizer reads since its version 1.0. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_MESHOPT_V1_H
#define WORKER_RENDER_GLTF_GLTF_MESHOPT_V1_H

#include <stdbool.h>
#include <stddef.h>

enum { GLTF_MESHOPT_V1 = 0xa1 }; /* the first byte of a stream */

/* Decodes `count` elements of `stride` bytes, a multiple of 4 up to 256. Returns false if the bytes are not such a
 * stream. Pure. */
bool gltf_meshopt_v1_decode(const unsigned char *bytes, size_t size, size_t count, size_t stride, unsigned char *out);

#endif
