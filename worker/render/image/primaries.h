/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Converts colours relative to the primaries and the white point that an OpenEXR file states to linear BT.709. As with
 * OpenEXR's RGBtoXYZ and XYZtoRGB, the colour stays the same stimulus: there is no chromatic adaptation to D65. Pure.
 */
#ifndef WORKER_RENDER_IMAGE_PRIMARIES_H
#define WORKER_RENDER_IMAGE_PRIMARIES_H

#include <stdbool.h>

struct primaries {
	float x[4], y[4]; /* CIE 1931 chromaticities of red, green, blue and white */
};

bool primaries_are_bt709(const struct primaries *p);
/* m: the matrix from the file's RGB to BT.709, [row][column]. Returns false if the primaries lie on a line or the
 * white point lies on the alychne (y = 0). */
bool primaries_to_bt709(const struct primaries *p, double m[3][3]);

#endif
