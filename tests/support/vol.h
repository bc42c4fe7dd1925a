/* SPDX-License-Identifier: Apache-2.0 */
/* Mitsuba's grid files (.vol), made from functions. */
#ifndef TESTS_SUPPORT_VOL_H
#define TESTS_SUPPORT_VOL_H

#include <stddef.h>
#include <stdint.h>

enum { VOL_HEADER_BYTES = 48, VOL_VALUES_MAX = 24 * 24 * 24 };

struct vol {
	unsigned char bytes[VOL_HEADER_BYTES + 4 * VOL_VALUES_MAX];
	size_t size;
	uint32_t side[3], channels;
	float value[VOL_VALUES_MAX];
};

/* x, y, z: from 0 at the first point to 1 at the last. */
typedef double vol_field(double x, double y, double z, uint32_t channel);

/* Makes a grid whose box is the unit cube. */
void vol_make(struct vol *v, const uint32_t side[3], uint32_t channels, vol_field *f);
/* Writes the current values into the bytes. */
void vol_write(struct vol *v);
void vol_set_box(struct vol *v, const float low[3], const float high[3]);
void vol_put32(struct vol *v, size_t offset, uint32_t word);

#endif
