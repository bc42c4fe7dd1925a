/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The format: "tensor_file" and a 0, the version (two bytes), the number of arrays (32 bits); then for each array the
 * length of its name (16 bits), the name, the number of dimensions (16), the type (8), the offset of the numbers in the
 * file (64), and the sizes (64 each). Little-endian.
 *
 * Failures: see tensor_find. Every length and offset is checked against the size of the file before it is used.
 */
#include "worker/render/bsdf/tensor.h"

#include "common/base/bytes.h"

#include <errno.h>
#include <string.h>

enum { MAGIC_BYTES = 12, HEADER_BYTES = MAGIC_BYTES + 2 + 4, VERSION_MAJOR = 1, TYPE_MAX = 11 };

static unsigned number_bytes(unsigned type)
{
	static const unsigned char widths[TYPE_MAX + 1] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
	return type <= TYPE_MAX ? widths[type] : 0;
}

/* Reads the header of an array; header: offset of its type. */
static int read_array_header(const unsigned char *file, size_t size, size_t header, unsigned dimensions,
			     struct tensor *out)
{
	*out = (struct tensor){.type = file[header], .dimension_count = dimensions, .count = 1};
	uint64_t data_offset = get64(file + header + 1);
	unsigned width = number_bytes(out->type);
	if (width == 0 || dimensions > TENSOR_DIMENSIONS_MAX || data_offset > size)
		return -EINVAL;
	uint64_t capacity = (size - data_offset) / width;
	for (unsigned i = 0; i < dimensions; i++) {
		out->shape[i] = get64(file + header + 9 + 8 * (size_t)i);
		if (out->shape[i] > capacity)
			return -EINVAL;
		capacity = out->shape[i] ? capacity / out->shape[i] : capacity;
		out->count *= out->shape[i];
	}
	out->bytes = file + data_offset;
	return 0;
}

int tensor_find(const unsigned char *file, size_t size, const char *name, struct tensor *out)
{
	if (size < HEADER_BYTES || memcmp(file, "tensor_file", MAGIC_BYTES) != 0)
		return -EINVAL;
	if (file[MAGIC_BYTES] != VERSION_MAJOR)
		return -ENOTSUP;
	size_t offset = HEADER_BYTES, name_length = strlen(name);
	for (uint32_t remaining = get32(file + MAGIC_BYTES + 2); remaining > 0; remaining--) {
		if (size - offset < 2)
			return -EINVAL;
		size_t length = get16(file + offset), begin = offset + 2;
		if (size - begin < length + 2 + 1 + 8)
			return -EINVAL;
		offset = begin + length;
		unsigned dimensions = get16(file + offset);
		if (size - offset - (2 + 1 + 8) < 8 * (size_t)dimensions)
			return -EINVAL;
		if (length == name_length && memcmp(file + begin, name, length) == 0)
			return read_array_header(file, size, offset + 2, dimensions, out);
		offset += 2 + 1 + 8 + 8 * (size_t)dimensions;
	}
	return -ENOENT;
}
