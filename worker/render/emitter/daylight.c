/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/emitter/daylight.h"

#include "worker/render/math/cie.h"

/* For X, Y and Z, by albedo (0 and 1), turbidity (1 to 10) and control point: A to G, I, H, and the mean radiance. */
enum { TURBIDITY_COUNT = 10, CONTROL_POINTS = 6, NUMBERS_PER_POINT = 10 };
static const double hosek_wilkie[3][2][TURBIDITY_COUNT][CONTROL_POINTS][NUMBERS_PER_POINT] = {
#include "worker/render/emitter/data/hosek_wilkie.inc"
};

/* Computes the weights of the control points of a Bezier curve of degree 5 in the cube root of the elevation over 90
 * degrees. */
static void bezier_weights(double sun_angle, double weight[CONTROL_POINTS])
{
	static const double binomial[CONTROL_POINTS] = {1, 5, 10, 10, 5, 1};
	double t = cbrt(fmin(fmax(1 - 2 * sun_angle / M_PI, 0), 1));
	for (int i = 0; i < CONTROL_POINTS; i++)
		weight[i] = binomial[i] * pow(t, i) * pow(1 - t, CONTROL_POINTS - 1 - i);
}

struct daylight daylight_make(double turbidity, const double albedo[3], double sun_angle)
{
	struct daylight d = {.mean_radiance = {0}};
	double weight[CONTROL_POINTS], above = fmin(fmax(turbidity - 1, 0), TURBIDITY_COUNT - 1);
	int low = (int)fmin(above, TURBIDITY_COUNT - 2);
	bezier_weights(sun_angle, weight);
	for (int k = 0; k < 3; k++)
		for (int corner = 0; corner < 4; corner++) {
			int ground = corner & 1, high = corner >> 1;
			double share = (ground ? albedo[k] : 1 - albedo[k]) * (high ? above - low : low + 1 - above);
			for (int i = 0; i < CONTROL_POINTS; i++) {
				const double *number = hosek_wilkie[k][ground][low + high][i];
				for (int c = 0; c < 9; c++)
					d.coefficient[k][c] += share * weight[i] * number[c];
				d.mean_radiance[k] += share * weight[i] * number[9];
			}
		}
	return d;
}

/* Returns the value of equation (8), with chi of equation (9). */
static double eval_sky_radiance(const double s[9], double angle, double gamma)
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

void daylight_sky_radiance(const struct daylight *d, double angle, double gamma, double rgb[3])
{
	double xyz[3] = {0, 0, 0};
	for (int k = 0; k < 3 && angle < 0.5 * M_PI; k++)
		xyz[k] = fmax(d->mean_radiance[k] * eval_sky_radiance(d->coefficient[k], angle, gamma), 0) / CIE_Y_SUM;
	rgb_from_xyz(xyz, rgb);
}

/* Preetham's table 2: radiance of the sun outside the atmosphere, W / (m^2 sr nm), and absorption by ozone and by water
 * vapour, 1 / cm, from 380 nm in steps of 10 nm. Other gases absorb near 760 nm only and are left out. */
enum { SUN_TABLE_FIRST_NM = 380, SUN_TABLE_STEP_NM = 10, SUN_TABLE_COUNT = 38 };
static const double extraterrestrial_sun[SUN_TABLE_COUNT] = {
	16559.0, 16233.7, 21127.5, 25888.2, 25829.1, 24232.3, 26760.5, 29658.3, 30545.4, 30057.5,
	30663.7, 28830.4, 28712.1, 27825.0, 27100.6, 27233.6, 26361.3, 25503.8, 25060.2, 25311.6,
	25355.9, 25134.2, 24631.5, 24173.2, 23685.3, 23212.1, 22827.7, 22339.8, 21970.2, 21526.7,
	21097.9, 20728.3, 20240.4, 19870.8, 19427.2, 19072.4, 18628.9, 18259.2};
static const double ozone_absorption[SUN_TABLE_COUNT] = {
	0,     0,     0,     0,	    0,	   0,	  0,	 0.003, 0.006, 0.009, 0.014, 0.021, 0.03,
	0.04,  0.048, 0.063, 0.075, 0.085, 0.103, 0.12,	 0.12,	0.115, 0.125, 0.12,  0.105, 0.09,
	0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023, 0.018, 0.014, 0.011, 0.01,  0.009};
static const double vapour_absorption[SUN_TABLE_COUNT] = {[31] = 0.016, 0.024, 0.0125, 1, 0.87, 0.061, 0.001};

/* Interpolates linearly; beyond the table, its first or last value applies. */
static double interpolate_at(const double table[SUN_TABLE_COUNT], double nm)
{
	double x = fmin(fmax((nm - SUN_TABLE_FIRST_NM) / SUN_TABLE_STEP_NM, 0), SUN_TABLE_COUNT - 1);
	int low = (int)fmin(x, SUN_TABLE_COUNT - 2);
	return table[low] + (x - low) * (table[low + 1] - table[low]);
}

/* Returns the transmittance of an amount x of water vapour. */
static double vapour_transmittance(double x)
{
	return exp(-0.2385 * x / pow(1 + 20.07 * x, 0.45));
}

void daylight_sun_radiance(double turbidity, double sun_angle, double rgb[3])
{
	double xyz[3] = {0, 0, 0}, degrees = sun_angle * 180 / M_PI;
	/* Relative optical mass: Kasten 1966. Aerosols: Angstrom's law. 0.35 cm of ozone, 2 cm of water. */
	double mass = 1 / (cos(sun_angle) + 0.15 * pow(93.885 - degrees, -1.253)),
	       beta = fmax(0.04608 * turbidity - 0.04586, 0);
	for (int i = 0; i < CIE_COUNT; i++) {
		double nm = CIE_FIRST_NM + i, l = nm / 1000;
		double transmittance = exp(-mass * (0.008735 * pow(l, -4.08) + beta * pow(l, -1.3) +
						    0.35 * interpolate_at(ozone_absorption, nm))) *
				       vapour_transmittance(2 * mass * interpolate_at(vapour_absorption, nm));
		for (int k = 0; k < 3; k++)
			xyz[k] += cie_observer[i][k] * interpolate_at(extraterrestrial_sun, nm) * transmittance /
				  CIE_Y_SUM;
	}
	rgb_from_xyz(xyz, rgb);
}

/* Returns the days since noon (UT) of January 1, 2000, in the Gregorian calendar. Years are counted from March, so that
 * leap days are their last days. */
static double days_since_2000(const struct daylight_time *t)
{
	int y = t->month > 2 ? t->year : t->year - 1, m = (t->month + 9) % 12;
	int day = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + t->day - 1;
	const int first = 730425; /* the day number of January 1, 2000 */
	return day - first - 0.5 + (t->hour - t->utc_offset) / 24;
}

/* Section 3 of the paper: ecliptic coordinates, right ascension and declination, then hour angle, azimuth from north,
 * and angle from the zenith, corrected for the parallax of an observer on the earth's surface. */
vec3 daylight_sun_direction(const struct daylight_time *t)
{
	double n = days_since_2000(t), omega = 2.1429 - 0.0010394594 * n, anomaly = 6.2400600 + 0.0172019699 * n;
	double ecliptic_longitude = 4.8950630 + 0.017202791698 * n + 0.03341607 * sin(anomaly) +
				    0.00034894 * sin(2 * anomaly) - 0.0001134 - 0.0000203 * sin(omega);
	double obliquity = 0.4090928 - 6.2140e-9 * n + 0.0000396 * cos(omega);
	double right_ascension = atan2(cos(obliquity) * sin(ecliptic_longitude), cos(ecliptic_longitude)),
	       declination = asin(sin(obliquity) * sin(ecliptic_longitude));
	/* Sidereal time at Greenwich, hours. */
	double sidereal = 6.6974243242 + 0.0657098283 * n + t->hour - t->utc_offset;
	double hour_angle = (sidereal * 15 + t->longitude) * M_PI / 180 - right_ascension, l = t->latitude * M_PI / 180;
	double zenith =
		acos(fmax(fmin(cos(l) * cos(hour_angle) * cos(declination) + sin(declination) * sin(l), 1), -1));
	double azimuth = atan2(-sin(hour_angle), tan(declination) * cos(l) - sin(l) * cos(hour_angle));
	zenith += 6371.01 / 149597890 * sin(zenith);
	return (vec3){sin(zenith) * sin(azimuth), cos(zenith), -sin(zenith) * cos(azimuth)};
}

int daylight_days_between(const struct daylight_time *first, const struct daylight_time *last)
{
	struct daylight_time a = *first, b = *last;
	a.hour = b.hour = a.utc_offset = b.utc_offset = 0;
	return (int)(days_since_2000(&b) - days_since_2000(&a));
}
