/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Measured media with the names of Mitsuba 0.6, per millimetre, for R, G and B. The first ones are from Jensen,
 * Marschner, Levoy and Hanrahan 2001, A Practical Model for Subsurface Light Transport, fig. 5; their scattering
 * coefficients are reduced ones, with which light scatters evenly in all directions. Those from `lowfat milk` on are
 * from Narasimhan et al. 2006, Acquiring Scattering Properties of Participating Media by Dilution, table 3, with
 * their mean cosine g. Pure.
 */
#ifndef WORKER_RENDER_MATH_MEASURED_MEDIA_H
#define WORKER_RENDER_MATH_MEASURED_MEDIA_H

#include <stddef.h>

struct measured_medium {
	const char *name;
	double sigma_s[3], sigma_a[3], g[3];
};

#define MEASURED_MEDIUM_DEFAULT "skin1" /* 0.6's medium for a file that names none */

/* The factor by which 0.6 multiplies the coefficients, although its manual equates a scene unit with a millimetre. */
#define MEASURED_MEDIUM_SCALE 100.0

/* Finds a medium by its name, ignoring case. Returns NULL if there is none; then `list` has the names. */
const struct measured_medium *measured_medium_find(const char *name, char *list, size_t size);

#endif
