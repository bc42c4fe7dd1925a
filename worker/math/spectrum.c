#include "worker/math/spectrum.h"

#include "worker/math/cie.h"

struct wavelengths wavelengths_sample(double u)
{
	struct wavelengths w = {.grey = false};
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double x = u + (double)i / SPECTRUM_LANES;
		w.nm[i] = WAVELENGTH_MIN + (WAVELENGTH_MAX - WAVELENGTH_MIN) * (x - floor(x));
	}
	return w;
}

struct wavelengths wavelengths_sample_few(double u, unsigned count)
{
	if (count >= SPECTRUM_LANES)
		return wavelengths_sample(u);
	struct wavelengths w = {.grey = false, .few = count};
	for (unsigned i = 0; i < SPECTRUM_LANES; i++) {
		double x = u + (double)(i % count) / count;
		w.nm[i] = WAVELENGTH_MIN + (WAVELENGTH_MAX - WAVELENGTH_MIN) * (x - floor(x));
	}
	return w;
}

void spectrum_to_xyz(spectrum l, const struct wavelengths *w, double xyz[3])
{
	const double factor = (WAVELENGTH_MAX - WAVELENGTH_MIN) / (CIE_Y_SUM * SPECTRUM_LANES);
	double x = 0, y = 0, z = 0;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double position = w->nm[i] - CIE_FIRST_NM;
		int cell = (int)position;
		cell = cell < 0 ? 0 : cell > CIE_COUNT - 2 ? CIE_COUNT - 2 : cell;
		double b = position - cell, a = 1 - b;
		const double *p = cie_observer[cell], *q = cie_observer[cell + 1];
		x += l.v[i] * (a * p[0] + b * q[0]);
		y += l.v[i] * (a * p[1] + b * q[1]);
		z += l.v[i] * (a * p[2] + b * q[2]);
	}
	xyz[0] = factor * x;
	xyz[1] = factor * y;
	xyz[2] = factor * z;
}

spectrum spectrum_intensity_weights(const struct wavelengths *w)
{
	const double factor = (WAVELENGTH_MAX - WAVELENGTH_MIN) / (CIE_Y_SUM * SPECTRUM_LANES);
	spectrum sum;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double position = w->nm[i] - CIE_FIRST_NM;
		int cell = (int)position;
		cell = cell < 0 ? 0 : cell > CIE_COUNT - 2 ? CIE_COUNT - 2 : cell;
		double b = position - cell, a = 1 - b;
		const double *p = cie_observer[cell], *q = cie_observer[cell + 1];
		sum.v[i] = factor * (a * (p[0] + p[1] + p[2]) + b * (q[0] + q[1] + q[2]));
	}
	return sum;
}
