/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/math/spectrum.h"

#include "common/base/color.h"
#include "worker/render/math/cie.h"

static int cell_index(double nm)
{
	int cell = (int)(nm - CIE_FIRST_NM);
	return cell < 0 ? 0 : cell > CIE_COUNT - 2 ? CIE_COUNT - 2 : cell;
}

/* Returns the wavelength below which the fraction u of all drawn wavelengths lies. */
static double wavelength_at(double u)
{
	int part = (int)(u * WAVELENGTH_GUIDE_COUNT); /* u may be 1 by rounding */
	int low = wavelength_guide[part < WAVELENGTH_GUIDE_COUNT ? part : WAVELENGTH_GUIDE_COUNT - 1];
	while (low + 1 < CIE_COUNT - 1 && wavelength_cells[low + 1].cumulative <= u)
		low++;
	double fraction = (u - wavelength_cells[low].cumulative) / wavelength_cells[low].probability;
	return CIE_FIRST_NM + low + fmin(fraction, 1);
}

double wavelength_pdf(double nm)
{
	return wavelength_cells[cell_index(nm)].probability;
}

struct wavelengths wavelengths_sample(double u)
{
	return wavelengths_sample_distinct(u, SPECTRUM_LANES);
}

struct wavelengths wavelengths_sample_distinct(double u, unsigned count)
{
	struct wavelengths w = {.is_grey = false, .period = count >= SPECTRUM_LANES ? 0 : count, .u = u};
	for (unsigned i = 0; i < SPECTRUM_LANES; i++) {
		double x = u + (double)(i % count) / count;
		w.nm[i] = i < count ? wavelength_at(x - floor(x)) : w.nm[i - count];
	}
	return w;
}

/* Computes lane i's contribution to X, Y and Z for a value of 1; the fourth lane has none where
 * the lanes are R, G and B. */
static void lane_weights(const struct wavelengths *w, int i, double xyz[3])
{
	if (w->is_rgb) {
		const double unit[3] = {i == 0, i == 1, i == 2};
		rec709_to_xyz(unit, xyz);
		return;
	}
	int cell = cell_index(w->nm[i]);
	double b = w->nm[i] - CIE_FIRST_NM - cell, a = 1 - b;
	double factor = 1 / (wavelength_cells[cell].probability * (CIE_Y_SUM * SPECTRUM_LANES));
	for (int k = 0; k < 3; k++)
		xyz[k] = factor * (a * cie_observer[cell][k] + b * cie_observer[cell + 1][k]);
}

void spectrum_to_xyz(spectrum l, const struct wavelengths *w, double xyz[3])
{
	xyz[0] = xyz[1] = xyz[2] = 0;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double lane[3];
		lane_weights(w, i, lane);
		for (int k = 0; k < 3; k++)
			xyz[k] += l.v[i] * lane[k];
	}
}

spectrum spectrum_intensity_weights(const struct wavelengths *w)
{
	spectrum sum;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double lane[3];
		lane_weights(w, i, lane);
		sum.v[i] = lane[0] + lane[1] + lane[2];
	}
	return sum;
}
