/* SPDX-License-Identifier: Apache-2.0 */
/* Synthetic files of Mueller matrices (.pbsdf): the first elements follow a formula, all others are 7. */
#ifndef TESTS_SUPPORT_POLARIZED_FILE_H
#define TESTS_SUPPORT_POLARIZED_FILE_H

#include <stddef.h>

/* Angles in radians: see worker/render/bsdf/measured_polarized.c. NAN: not measured. */
typedef double polarized_function(double phi_d, double theta_d, double theta_h, double nm);

enum { POLARIZED_WAVELENGTHS = 5 }; /* 450, 500, ... nm */

/* Makes a file with `phis` numbers along phi_d from -pi to pi, and `thetas` along each of the others from 0 to pi /
 * 2, of *size bytes; the caller frees it. */
unsigned char *polarized_file_make(polarized_function *f, int phis, int thetas, size_t *size);

#endif
