/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Colours relative to the primaries and the white that an OpenEXR file names, as linear BT.709. As in OpenEXR's
 * RGBtoXYZ and XYZtoRGB, the colour stays the same stimulus: another white is not adapted to D65. Pure.
 */
#ifndef WORKER_RENDER_IMAGE_PRIMARIES_H
#define WORKER_RENDER_IMAGE_PRIMARIES_H

#include <stdbool.h>

struct primaries {
	float x[4], y[4]; /* CIE 1931 chromaticities of red, green, blue and white */
};

bool primaries_are_bt709(const struct primaries *p);
/* m: BT.709 from the file's colour, [row][column]. False: the primaries lie on a line, or the white on the alychne. */
bool primaries_to_bt709(const struct primaries *p, double m[3][3]);

#endif
