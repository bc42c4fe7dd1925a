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

enum { MAGIC = 12, HEAD = MAGIC + 2 + 4, MAJOR = 1, TYPES = 11 };

static unsigned width_of(unsigned type)
{
	static const unsigned char widths[TYPES + 1] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
	return type <= TYPES ? widths[type] : 0;
}

/* Reads the header of an array; at: offset of its type. */
static int read_array(const unsigned char *file, size_t size, size_t at, unsigned dimensions, struct tensor *out)
{
	*out = (struct tensor){.type = file[at], .dimensions = dimensions, .count = 1};
	uint64_t first = get64(file + at + 1);
	unsigned width = width_of(out->type);
	if (width == 0 || dimensions > TENSOR_DIMENSIONS_MAX || first > size)
		return -EINVAL;
	uint64_t room = (size - first) / width;
	for (unsigned i = 0; i < dimensions; i++) {
		out->shape[i] = get64(file + at + 9 + 8 * (size_t)i);
		if (out->shape[i] > room)
			return -EINVAL;
		room = out->shape[i] ? room / out->shape[i] : room;
		out->count *= out->shape[i];
	}
	out->bytes = file + first;
	return 0;
}

int tensor_find(const unsigned char *file, size_t size, const char *name, struct tensor *out)
{
	if (size < HEAD || memcmp(file, "tensor_file", MAGIC) != 0)
		return -EINVAL;
	if (file[MAGIC] != MAJOR)
		return -ENOTSUP;
	size_t at = HEAD, wanted = strlen(name);
	for (uint32_t left = get32(file + MAGIC + 2); left > 0; left--) {
		if (size - at < 2)
			return -EINVAL;
		size_t length = get16(file + at), begin = at + 2;
		if (size - begin < length + 2 + 1 + 8)
			return -EINVAL;
		at = begin + length;
		unsigned dimensions = get16(file + at);
		if (size - at - (2 + 1 + 8) < 8 * (size_t)dimensions)
			return -EINVAL;
		if (length == wanted && memcmp(file + begin, name, length) == 0)
			return read_array(file, size, at + 2, dimensions, out);
		at += 2 + 1 + 8 + 8 * (size_t)dimensions;
	}
	return -ENOENT;
}
