/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Measured media by the names that Mitsuba 0.6 has for them, per millimetre, for R, G and B. The first are of Jensen,
 * Marschner, Levoy and Hanrahan 2001, A Practical Model for Subsurface Light Transport, fig. 5, whose scattering
 * coefficients are reduced ones: with them light scatters evenly in all directions. Those from `lowfat milk` on are of
 * Narasimhan et al. 2006, Acquiring Scattering Properties of Participating Media by Dilution, table 3, with their mean
 * cosine g. Pure.
 */
#ifndef WORKER_RENDER_MATH_MEASURED_MEDIA_H
#define WORKER_RENDER_MATH_MEASURED_MEDIA_H

#include <stddef.h>

struct measured_medium {
	const char *name;
	double sigma_s[3], sigma_a[3], g[3];
};

#define MEASURED_DEFAULT "skin1" /* of 0.6, where a file says nothing else */

/* What 0.6 multiplies the coefficients by, though its manual takes a scene unit for a millimetre. */
#define MEASURED_SCALE 100.0

/* By its name in any case; NULL: there is none, and list has the names. */
const struct measured_medium *measured_find(const char *name, char *list, size_t size);

#endif
