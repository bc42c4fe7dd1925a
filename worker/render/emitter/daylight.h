/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Daylight after Preetham, Shirley and Smits 1999, "A Practical Analytic Model for Daylight". Angles in radians, from
 * the zenith; colours are linear Rec. 709 in W / (m^2 sr nm), like Mitsuba's spectra: CIE Y = 1 is 1 W / (m^2 sr nm) at
 * all wavelengths. Pure; any thread.
 */
#ifndef WORKER_RENDER_EMITTER_DAYLIGHT_H
#define WORKER_RENDER_EMITTER_DAYLIGHT_H

#include "worker/render/math/vec3.h"

#define DAYLIGHT_SUN_RADIUS 0.0046526 /* angular radius of the sun's disk seen from the earth */

struct daylight {
	double sun;		       /* the sun's angle */
	double perez[3][5], zenith[3]; /* of Y (kcd / m^2), x, y */
};

/* turbidity 1.7 (clear) to 10 (haze); sun below pi/2. */
struct daylight daylight_of(double turbidity, double sun);
/* The sky at `angle` from the zenith and `gamma` from the sun; not negative. Black below the horizon. */
void daylight_sky(const struct daylight *d, double angle, double gamma, double rgb[3]);
/* The sun's disk through the air: Planck's law at 5778 K, Rayleigh scattering and aerosols (no ozone). */
void daylight_sun(double turbidity, double sun, double rgb[3]);

/* Where and when; time in hours by the clock of the zone, east and north positive. */
struct daylight_time {
	double latitude, longitude; /* degrees */
	double zone, hour;
	int year, month, day;
};
/* x east, y up, z south; the appendix's formulas, good to about a degree. */
vec3 daylight_position(const struct daylight_time *t);

#endif
