/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/emitter/daylight.h"

#include "worker/render/math/cie.h"

/* For X, Y and Z, by albedo (0 and 1), turbidity (1 to 10) and control point: A to G, I, H, and the mean radiance. */
enum { TURBIDITIES = 10, POINTS = 6, NUMBERS = 10 };
static const double table[3][2][TURBIDITIES][POINTS][NUMBERS] = {
#include "worker/render/emitter/data/hosek_wilkie.inc"
};

/* Computes the weights of the control points of a Bezier curve of degree 5 in the cube root of the elevation over 90
 * degrees. */
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

/* Returns the value of equation (8), with chi of equation (9). */
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

/* Preetham's table 2: radiance of the sun outside the atmosphere, W / (m^2 sr nm), and absorption by ozone and by water
 * vapour, 1 / cm, from 380 nm in steps of 10 nm. Other gases absorb near 760 nm only and are left out. */
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

/* Interpolates linearly; beyond the table, its first or last value applies. */
static double at_wavelength(const double table_of[TABLE_COUNT], double nm)
{
	double x = fmin(fmax((nm - TABLE_NM) / TABLE_STEP, 0), TABLE_COUNT - 1);
	int low = (int)fmin(x, TABLE_COUNT - 2);
	return table_of[low] + (x - low) * (table_of[low + 1] - table_of[low]);
}

/* Returns the transmittance of an amount x of water vapour. */
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

/* Returns the days since noon (UT) of January 1, 2000, in the Gregorian calendar. Years are counted from March, so that
 * leap days are their last days. */
static double days_of(const struct daylight_time *t)
{
	int y = t->month > 2 ? t->year : t->year - 1, m = (t->month + 9) % 12;
	int day = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + t->day - 1;
	const int first = 730425; /* the day number of January 1, 2000 */
	return day - first - 0.5 + (t->hour - t->zone) / 24;
}

/* Section 3 of the paper: ecliptic coordinates, right ascension and declination, then hour angle, azimuth from north,
 * and angle from the zenith, corrected for the parallax of an observer on the earth's surface. */
vec3 daylight_position(const struct daylight_time *t)
{
	double n = days_of(t), omega = 2.1429 - 0.0010394594 * n, anomaly = 6.2400600 + 0.0172019699 * n;
	double along = 4.8950630 + 0.017202791698 * n + 0.03341607 * sin(anomaly) + 0.00034894 * sin(2 * anomaly) -
		       0.0001134 - 0.0000203 * sin(omega);
	double tilt = 0.4090928 - 6.2140e-9 * n + 0.0000396 * cos(omega);
	double ascension = atan2(cos(tilt) * sin(along), cos(along)), declination = asin(sin(tilt) * sin(along));
	double sidereal = 6.6974243242 + 0.0657098283 * n + t->hour - t->zone; /* sidereal time at Greenwich, hours */
	double turn = (sidereal * 15 + t->longitude) * M_PI / 180 - ascension, l = t->latitude * M_PI / 180;
	double zenith = acos(fmax(fmin(cos(l) * cos(turn) * cos(declination) + sin(declination) * sin(l), 1), -1));
	double azimuth = atan2(-sin(turn), tan(declination) * cos(l) - sin(l) * cos(turn));
	zenith += 6371.01 / 149597890 * sin(zenith);
	return (vec3){sin(zenith) * sin(azimuth), cos(zenith), -sin(zenith) * cos(azimuth)};
}

int daylight_days_between(const struct daylight_time *from, const struct daylight_time *to)
{
	struct daylight_time a = *from, b = *to;
	a.hour = b.hour = a.zone = b.zone = 0;
	return (int)(days_of(&b) - days_of(&a));
}
