/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/emitter/daylight.h"

#include "worker/render/math/cie.h"

#include <stdbool.h>

#define PI 3.14159265358979323846
#define LUMENS_PER_WATT 683.0

/* Table A.2: coefficients A to E as slope and offset in the turbidity, of Y, x and y. */
static const double distribution[3][5][2] = {
	{{0.1787, -1.4630}, {-0.3554, 0.4275}, {-0.0227, 5.3251}, {0.1206, -2.5771}, {-0.0670, 0.3703}},
	{{-0.0193, -0.2592}, {-0.0665, 0.0008}, {-0.0004, 0.2125}, {-0.0641, -0.8989}, {-0.0033, 0.0452}},
	{{-0.0167, -0.2608}, {-0.0950, 0.0092}, {-0.0079, 0.2102}, {-0.0441, -1.6537}, {-0.0109, 0.0529}},
};

/* Zenith's chromaticities: rows T^2, T, 1; columns sun^3, sun^2, sun, 1. */
static const double zenith_x[3][4] = {
	{0.00166, -0.00375, 0.00209, 0}, {-0.02903, 0.06377, -0.03202, 0.00394}, {0.11693, -0.21196, 0.06052, 0.25886}};
static const double zenith_y[3][4] = {
	{0.00275, -0.00610, 0.00317, 0}, {-0.04214, 0.08970, -0.04153, 0.00516}, {0.15346, -0.26756, 0.06670, 0.26688}};

static double chromaticity(const double m[3][4], double t, double s)
{
	double sum = 0;
	for (int row = 0; row < 3; row++)
		sum = sum * t + ((m[row][0] * s + m[row][1]) * s + m[row][2]) * s + m[row][3];
	return sum;
}

static double perez(const double c[5], double angle, double gamma)
{
	return (1 + c[0] * exp(c[1] / cos(angle))) * (1 + c[2] * exp(c[3] * gamma) + c[4] * cos(gamma) * cos(gamma));
}

struct daylight daylight_of(double turbidity, double sun)
{
	struct daylight d = {.sun = sun};
	for (int k = 0; k < 3; k++)
		for (int c = 0; c < 5; c++)
			d.perez[k][c] = distribution[k][c][0] * turbidity + distribution[k][c][1];
	double chi = (4.0 / 9 - turbidity / 120) * (PI - 2 * sun);
	d.zenith[0] = fmax((4.0453 * turbidity - 4.9710) * tan(chi) - 0.2155 * turbidity + 2.4192, 0);
	d.zenith[1] = chromaticity(zenith_x, turbidity, sun);
	d.zenith[2] = chromaticity(zenith_y, turbidity, sun);
	return d;
}

static void rgb_from_xyz(const double xyz[3], double rgb[3])
{
	static const double m[3][3] = {{3.2404542, -1.5371385, -0.4985314},
				       {-0.9692660, 1.8760108, 0.0415560},
				       {0.0556434, -0.2040259, 1.0572252}};
	for (int i = 0; i < 3; i++)
		rgb[i] = fmax(m[i][0] * xyz[0] + m[i][1] * xyz[1] + m[i][2] * xyz[2], 0);
}

void daylight_sky(const struct daylight *d, double angle, double gamma, double rgb[3])
{
	double v[3];
	/* The horizon itself gets the limit from above. */
	double low = fmin(angle, 0.5 * PI - 1e-3);
	for (int k = 0; k < 3; k++)
		v[k] = d->zenith[k] * perez(d->perez[k], low, gamma) / perez(d->perez[k], 0, d->sun);
	double luminance = angle < 0.5 * PI ? fmax(v[0], 0) * 1000 / (LUMENS_PER_WATT * CIE_Y_SUM) : 0;
	const double xyz[3] = {luminance * v[1] / v[2], luminance, luminance * (1 - v[1] - v[2]) / v[2]};
	rgb_from_xyz(xyz, rgb);
}

/* W / (m^2 sr nm); nm in nanometres. */
static double planck(double nm, double kelvin)
{
	const double h = 6.62607015e-34, c = 299792458, k = 1.380649e-23, l = nm * 1e-9;
	return 2e-9 * h * c * c / (l * l * l * l * l * expm1(h * c / (l * k * kelvin)));
}

void daylight_sun(double turbidity, double sun, double rgb[3])
{
	double xyz[3] = {0, 0, 0}, degrees = sun * 180 / PI;
	/* Relative optical mass: Kasten 1966. Aerosols: Angstrom's law. */
	double mass = 1 / (cos(sun) + 0.15 * pow(93.885 - degrees, -1.253)),
	       beta = fmax(0.04608 * turbidity - 0.04586, 0);
	for (int i = 0; i < CIE_COUNT; i++) {
		double nm = CIE_FIRST_NM + i, l = nm / 1000;
		double through = exp(-mass * (0.008735 * pow(l, -4.08) + beta * pow(l, -1.3)));
		for (int k = 0; k < 3; k++)
			xyz[k] += cie_observer[i][k] * planck(nm, 5778) * through / CIE_Y_SUM;
	}
	rgb_from_xyz(xyz, rgb);
}

static int day_of_year(const struct daylight_time *t)
{
	static const int before[12] = {0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334};
	bool leap = (t->year % 4 == 0 && t->year % 100 != 0) || t->year % 400 == 0;
	return before[t->month - 1] + t->day + (leap && t->month > 2);
}

vec3 daylight_position(const struct daylight_time *t)
{
	double day = day_of_year(t), l = t->latitude * PI / 180;
	double solar = t->hour + 0.170 * sin(4 * PI * (day - 80) / 373) - 0.129 * sin(2 * PI * (day - 8) / 355) +
		       (t->longitude - 15 * t->zone) / 15;
	double declination = 0.4093 * sin(2 * PI * (day - 81) / 368), turn = PI * solar / 12;
	double up = sin(l) * sin(declination) - cos(l) * cos(declination) * cos(turn);
	/* From south, towards the west. */
	double west = -cos(declination) * sin(turn),
	       south = -(cos(l) * sin(declination) + sin(l) * cos(declination) * cos(turn));
	return vec3_normalize((vec3){-west, up, south});
}
