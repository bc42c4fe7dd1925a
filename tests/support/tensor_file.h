/* SPDX-License-Identifier: Apache-2.0 */
/* Writes tensor files, arrays of numbers (worker/render/bsdf/tensor.h). One thread; out of memory aborts. */
#ifndef TESTS_SUPPORT_TENSOR_FILE_H
#define TESTS_SUPPORT_TENSOR_FILE_H

#include "worker/render/bsdf/tensor.h"

struct tensor_array {
	const char *name;
	unsigned type, dimensions;
	uint64_t shape[TENSOR_DIMENSIONS_MAX];
	unsigned char *bytes;
	size_t size;
};

struct tensor_file {
	struct tensor_array array[12];
	size_t count;
};

/* Returns the bytes of a new array, which are zeros. */
unsigned char *tensor_file_add(struct tensor_file *f, const char *name, unsigned type, unsigned dimensions,
			       const int *shape);
void tensor_file_put_float(unsigned char **at, double x); /* stores a float and advances *at */

/* Returns the file, of *size bytes; the caller frees it. */
unsigned char *tensor_file_end(struct tensor_file *f, size_t *size);

#endif
