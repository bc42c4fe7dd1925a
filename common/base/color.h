/* SPDX-License-Identifier: Apache-2.0 */
/* Converts CIE XYZ to linear Rec. 709 (IEC 61966-2-1 primaries, D65) and back, and computes luminance. Colours outside
 * the gamut keep their negative values. Pure. */
#ifndef COMMON_BASE_COLOR_H
#define COMMON_BASE_COLOR_H

static inline void rec709_from_xyz(const double xyz[3], double rgb[3])
{
	rgb[0] = 3.2404541621141054 * xyz[0] - 1.5371385127977166 * xyz[1] - 0.4985314095560162 * xyz[2];
	rgb[1] = -0.9692660305051868 * xyz[0] + 1.8760108454466942 * xyz[1] + 0.0415560175303498 * xyz[2];
	rgb[2] = 0.0556434309591147 * xyz[0] - 0.2040259135167538 * xyz[1] + 1.0572251882231791 * xyz[2];
}

static inline void rec709_to_xyz(const double rgb[3], double xyz[3])
{
	xyz[0] = 0.41245643908969215 * rgb[0] + 0.3575760776439089 * rgb[1] + 0.18043748326639897 * rgb[2];
	xyz[1] = 0.2126728514056225 * rgb[0] + 0.7151521552878178 * rgb[1] + 0.0721749933065596 * rgb[2];
	xyz[2] = 0.01933389558232931 * rgb[0] + 0.11919202588130295 * rgb[1] + 0.9503040785363678 * rgb[2];
}

static inline double rec709_luminance(const double rgb[3])
{
	return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

#endif
