/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/vol.h"

#include <assert.h>
#include <string.h>

void vol_put32(struct vol *v, size_t offset, uint32_t word)
{
	for (int i = 0; i < 4; i++)
		v->bytes[offset + (size_t)i] = (unsigned char)(word >> 8 * i);
}

static void store_float(struct vol *v, size_t offset, float x)
{
	uint32_t bits;
	memcpy(&bits, &x, sizeof bits);
	vol_put32(v, offset, bits);
}

void vol_set_box(struct vol *v, const float low[3], const float high[3])
{
	for (size_t i = 0; i < 3; i++) {
		store_float(v, 24 + 4 * i, low[i]);
		store_float(v, 36 + 4 * i, high[i]);
	}
}

void vol_write(struct vol *v)
{
	static const float zero[3] = {0, 0, 0}, one[3] = {1, 1, 1};
	size_t count = (size_t)v->channels * v->side[0] * v->side[1] * v->side[2];
	memcpy(v->bytes, "VOL\3", 4);
	vol_put32(v, 4, 1);
	for (size_t i = 0; i < 3; i++)
		vol_put32(v, 8 + 4 * i, v->side[i]);
	vol_put32(v, 20, v->channels);
	vol_set_box(v, zero, one);
	for (size_t i = 0; i < count; i++)
		store_float(v, VOL_HEADER_BYTES + 4 * i, v->value[i]);
	v->size = VOL_HEADER_BYTES + 4 * count;
}

static double grid_coordinate(uint32_t i, uint32_t side)
{
	return side > 1 ? i / (side - 1.0) : 0;
}

void vol_make(struct vol *v, const uint32_t side[3], uint32_t channels, vol_field *f)
{
	size_t at = 0;
	assert((size_t)side[0] * side[1] * side[2] * channels <= VOL_VALUES_MAX);
	memcpy(v->side, side, sizeof v->side);
	v->channels = channels;
	for (uint32_t k = 0; k < side[2]; k++)
		for (uint32_t j = 0; j < side[1]; j++)
			for (uint32_t i = 0; i < side[0]; i++)
				for (uint32_t c = 0; c < channels; c++)
					v->value[at++] =
						(float)f(grid_coordinate(i, side[0]), grid_coordinate(j, side[1]),
							 grid_coordinate(k, side[2]), c);
	vol_write(v);
}
