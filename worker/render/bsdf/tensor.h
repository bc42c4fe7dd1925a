/* SPDX-License-Identifier: Apache-2.0 */
/* Files of named arrays of numbers ("tensor_file"), the format of the RGL database of materials. Pure; any thread. */
#ifndef WORKER_RENDER_BSDF_TENSOR_H
#define WORKER_RENDER_BSDF_TENSOR_H

#include <stddef.h>
#include <stdint.h>

enum tensor_type { TENSOR_BYTES = 1, TENSOR_SHORTS = 3, TENSOR_FLOATS = 10 }; /* of the 11 types of the format */
enum { TENSOR_DIMENSIONS_MAX = 8 };

struct tensor {
	unsigned type;
	unsigned dimension_count;
	uint64_t shape[TENSOR_DIMENSIONS_MAX]; /* row-major: the last index varies fastest */
	uint64_t count;			       /* product of the sizes */
	const unsigned char *bytes;	       /* `count` numbers, all of them within the file */
};

/* Finds the array `name` in a file of `size` bytes. Returns 0; -ENOENT if there is no such array; -EINVAL if this is
 * not a tensor file, or if it is truncated; -ENOTSUP if it has another version. */
int tensor_find(const unsigned char *file, size_t size, const char *name, struct tensor *out);

#endif
