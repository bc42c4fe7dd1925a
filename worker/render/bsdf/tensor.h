/* SPDX-License-Identifier: Apache-2.0 */
/* Files of named arrays of numbers ("tensor_file"), as the RGL database of materials has them. Any thread. */
#ifndef WORKER_RENDER_BSDF_TENSOR_H
#define WORKER_RENDER_BSDF_TENSOR_H

#include <stddef.h>
#include <stdint.h>

enum tensor_type { TENSOR_BYTES = 1, TENSOR_SHORTS = 3, TENSOR_FLOATS = 10 }; /* of those that files number 1 to 11 */
enum { TENSOR_DIMENSIONS_MAX = 8 };

struct tensor {
	unsigned type;
	unsigned dimensions;
	uint64_t shape[TENSOR_DIMENSIONS_MAX]; /* the last one's numbers are neighbours */
	uint64_t count;			       /* their product */
	const unsigned char *bytes;	       /* in the file: `count` numbers, all of them there */
};

/* The array `name` of a file of `size` bytes. -ENOENT: it is not there. -EINVAL: this is no such file, or it ends too
 * early. -ENOTSUP: another version. */
int tensor_find(const unsigned char *file, size_t size, const char *name, struct tensor *out);

#endif
