/* SPDX-License-Identifier: Apache-2.0 */
/* Linear Rec. 709 (IEC 61966-2-1 primaries, D65) from CIE XYZ, where values outside the gamut stay negative, and its
 * luminance. Pure. */
#ifndef COMMON_BASE_COLOR_H
#define COMMON_BASE_COLOR_H

static inline void rec709_from_xyz(const double xyz[3], double rgb[3])
{
	rgb[0] = 3.2404541621141054 * xyz[0] - 1.5371385127977166 * xyz[1] - 0.4985314095560162 * xyz[2];
	rgb[1] = -0.9692660305051868 * xyz[0] + 1.8760108454466942 * xyz[1] + 0.0415560175303498 * xyz[2];
	rgb[2] = 0.0556434309591147 * xyz[0] - 0.2040259135167538 * xyz[1] + 1.0572251882231791 * xyz[2];
}

static inline double rec709_luminance(const double rgb[3])
{
	return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

#endif
