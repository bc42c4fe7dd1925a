/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/tensor_file.h"

#include "common/base/bytes.h"

#include <stdlib.h>
#include <string.h>

unsigned char *tensor_file_add(struct tensor_file *f, const char *name, unsigned type, unsigned dimensions,
			       const int *shape)
{
	struct tensor_array *a = &f->array[f->count++];
	*a = (struct tensor_array){.name = name,
				   .type = type,
				   .dimensions = dimensions,
				   .size = type == TENSOR_FLOATS   ? 4
					   : type == TENSOR_SHORTS ? 2
								   : 1};
	for (unsigned i = 0; i < dimensions; i++) {
		a->shape[i] = (uint64_t)shape[i];
		a->size *= (size_t)shape[i];
	}
	a->bytes = calloc(1, a->size);
	if (!a->bytes)
		abort();
	return a->bytes;
}

void tensor_file_put_float(unsigned char **at, double x)
{
	put_float(*at, (float)x);
	*at += 4;
}

unsigned char *tensor_file_end(struct tensor_file *f, size_t *size)
{
	size_t head = 18, at, data;
	for (size_t i = 0; i < f->count; i++)
		head += 2 + strlen(f->array[i].name) + 11 + 8 * f->array[i].dimensions;
	*size = head;
	for (size_t i = 0; i < f->count; i++)
		*size += f->array[i].size;
	unsigned char *out = calloc(1, *size);
	if (!out)
		abort();
	memcpy(out, "tensor_file\0\1", 13);
	put32(out + 14, (uint32_t)f->count);
	at = 18;
	data = head;
	for (size_t i = 0; i < f->count; i++) {
		struct tensor_array *a = &f->array[i];
		size_t length = strlen(a->name);
		put_bytes(out + at, length, 2);
		memcpy(out + at + 2, a->name, length);
		at += 2 + length;
		put_bytes(out + at, a->dimensions, 2);
		out[at + 2] = (unsigned char)a->type;
		put64(out + at + 3, data);
		at += 11;
		for (unsigned d = 0; d < a->dimensions; d++, at += 8)
			put64(out + at, a->shape[d]);
		memcpy(out + data, a->bytes, a->size);
		data += a->size;
		free(a->bytes);
	}
	return out;
}
