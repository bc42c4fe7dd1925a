/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/emitter/daylight.h"

#include "worker/render/math/cie.h"

#include <stdbool.h>

/* By albedo 0 and 1, turbidity 1 to 10 and control point: A to G, I, H, and the mean radiance. */
enum { TURBIDITIES = 10, POINTS = 6, NUMBERS = 10 };
static const double table[3][2][TURBIDITIES][POINTS][NUMBERS] = {
#include "worker/render/emitter/data/hosek_wilkie.inc"
};

/* Weights of the control points: a Bezier curve of degree 5 in the cube root of the elevation over a right angle. */
static void point_weights(double sun, double weight[POINTS])
{
	static const double binomial[POINTS] = {1, 5, 10, 10, 5, 1};
	double t = cbrt(fmin(fmax(1 - 2 * sun / M_PI, 0), 1));
	for (int i = 0; i < POINTS; i++)
		weight[i] = binomial[i] * pow(t, i) * pow(1 - t, POINTS - 1 - i);
}

struct daylight daylight_of(double turbidity, const double albedo[3], double sun)
{
	struct daylight d = {.mean = {0}};
	double weight[POINTS], above = fmin(fmax(turbidity - 1, 0), TURBIDITIES - 1);
	int low = (int)fmin(above, TURBIDITIES - 2);
	point_weights(sun, weight);
	for (int k = 0; k < 3; k++)
		for (int corner = 0; corner < 4; corner++) {
			int ground = corner & 1, high = corner >> 1;
			double share = (ground ? albedo[k] : 1 - albedo[k]) * (high ? above - low : low + 1 - above);
			for (int i = 0; i < POINTS; i++) {
				const double *number = table[k][ground][low + high][i];
				for (int c = 0; c < 9; c++)
					d.shape[k][c] += share * weight[i] * number[c];
				d.mean[k] += share * weight[i] * number[9];
			}
		}
	return d;
}

/* Equation (8) with chi of equation (9). */
static double radiance_of(const double s[9], double angle, double gamma)
{
	double up = cos(angle), toward = cos(gamma);
	double chi = (1 + toward * toward) / pow(1 + s[8] * s[8] - 2 * s[8] * toward, 1.5);
	return (1 + s[0] * exp(s[1] / (up + 0.01))) *
	       (s[2] + s[3] * exp(s[4] * gamma) + s[5] * toward * toward + s[6] * chi + s[7] * sqrt(fmax(up, 0)));
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
	double xyz[3] = {0, 0, 0};
	for (int k = 0; k < 3 && angle < 0.5 * M_PI; k++)
		xyz[k] = fmax(d->mean[k] * radiance_of(d->shape[k], angle, gamma), 0) / CIE_Y_SUM;
	rgb_from_xyz(xyz, rgb);
}

/* Preetham's table 2: the sun outside the atmosphere, W / (m^2 sr nm), and absorption by ozone and water vapour, 1 /
 * cm, from 380 nm by 10. Other gases absorb next to 760 nm only. */
enum { TABLE_NM = 380, TABLE_STEP = 10, TABLE_COUNT = 38 };
static const double sun_outside[TABLE_COUNT] = {16559.0, 16233.7, 21127.5, 25888.2, 25829.1, 24232.3, 26760.5, 29658.3,
						30545.4, 30057.5, 30663.7, 28830.4, 28712.1, 27825.0, 27100.6, 27233.6,
						26361.3, 25503.8, 25060.2, 25311.6, 25355.9, 25134.2, 24631.5, 24173.2,
						23685.3, 23212.1, 22827.7, 22339.8, 21970.2, 21526.7, 21097.9, 20728.3,
						20240.4, 19870.8, 19427.2, 19072.4, 18628.9, 18259.2};
static const double ozone[TABLE_COUNT] = {0,	 0,	0,     0,     0,     0,	    0,	   0.003, 0.006, 0.009,
					  0.014, 0.021, 0.03,  0.04,  0.048, 0.063, 0.075, 0.085, 0.103, 0.12,
					  0.12,	 0.115, 0.125, 0.12,  0.105, 0.09,  0.079, 0.067, 0.057, 0.048,
					  0.036, 0.028, 0.023, 0.018, 0.014, 0.011, 0.01,  0.009};
static const double vapour[TABLE_COUNT] = {[31] = 0.016, 0.024, 0.0125, 1, 0.87, 0.061, 0.001};

/* Beyond the table its last value. */
static double at_wavelength(const double table_of[TABLE_COUNT], double nm)
{
	double x = fmin(fmax((nm - TABLE_NM) / TABLE_STEP, 0), TABLE_COUNT - 1);
	int low = (int)fmin(x, TABLE_COUNT - 2);
	return table_of[low] + (x - low) * (table_of[low + 1] - table_of[low]);
}

/* What an amount x of an absorber lets through. */
static double through_vapour(double x)
{
	return exp(-0.2385 * x / pow(1 + 20.07 * x, 0.45));
}

void daylight_sun(double turbidity, double sun, double rgb[3])
{
	double xyz[3] = {0, 0, 0}, degrees = sun * 180 / M_PI;
	/* Relative optical mass: Kasten 1966. Aerosols: Angstrom's law. 0.35 cm of ozone, 2 cm of water. */
	double mass = 1 / (cos(sun) + 0.15 * pow(93.885 - degrees, -1.253)),
	       beta = fmax(0.04608 * turbidity - 0.04586, 0);
	for (int i = 0; i < CIE_COUNT; i++) {
		double nm = CIE_FIRST_NM + i, l = nm / 1000;
		double through = exp(-mass * (0.008735 * pow(l, -4.08) + beta * pow(l, -1.3) +
					      0.35 * at_wavelength(ozone, nm))) *
				 through_vapour(2 * mass * at_wavelength(vapour, nm));
		for (int k = 0; k < 3; k++)
			xyz[k] += cie_observer[i][k] * at_wavelength(sun_outside, nm) * through / CIE_Y_SUM;
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
	double day = day_of_year(t), l = t->latitude * M_PI / 180;
	double solar = t->hour + 0.170 * sin(4 * M_PI * (day - 80) / 373) - 0.129 * sin(2 * M_PI * (day - 8) / 355) +
		       (t->longitude - 15 * t->zone) / 15;
	double declination = 0.4093 * sin(2 * M_PI * (day - 81) / 368), turn = M_PI * solar / 12;
	double up = sin(l) * sin(declination) - cos(l) * cos(declination) * cos(turn);
	/* From south, towards the west. */
	double west = -cos(declination) * sin(turn),
	       south = -(cos(l) * sin(declination) + sin(l) * cos(declination) * cos(turn));
	return vec3_normalize((vec3){-west, up, south});
}
