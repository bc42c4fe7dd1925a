/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The CIE's published tables at 1 nm, 360-830 nm: 1931 2-degree observer and illuminant D65 (100 at 560 nm).
 * Generated from worker/render/math/data at build time. Constants; any thread.
 */
#ifndef WORKER_RENDER_MATH_CIE_H
#define WORKER_RENDER_MATH_CIE_H

enum { CIE_FIRST_NM = 360, CIE_LAST_NM = 830, CIE_COUNT = CIE_LAST_NM - CIE_FIRST_NM + 1 };
#define CIE_Y_SUM 106.857 /* integral of y_bar, in nm */

extern const double cie_observer[CIE_COUNT][3];
extern const double cie_d65[CIE_COUNT];

/* For the nanometre that starts at CIE_FIRST_NM + i: the fraction of all drawn wavelengths that are below it, and the
 * fraction within it (which is also the density per nm). */
struct wavelength_cell {
	double cumulative, probability;
};
extern const struct wavelength_cell wavelength_cells[CIE_COUNT - 1];
/* Entry k is the cell that contains the fraction k / WAVELENGTH_GUIDE_COUNT. */
enum { WAVELENGTH_GUIDE_COUNT = 512 };
extern const unsigned short wavelength_guide[WAVELENGTH_GUIDE_COUNT];

#endif
