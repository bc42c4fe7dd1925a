/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Daylight: the sky of Hosek and Wilkie 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance", and the sun of
 * Preetham, Shirley and Smits 1999, "A Practical Analytic Model for Daylight", appendix A.1. Angles in radians, from
 * the zenith; colours are linear Rec. 709 in W / (m^2 sr nm), like Mitsuba's spectra: CIE Y = 1 is 1 W / (m^2 sr nm) at
 * all wavelengths. Pure; any thread.
 */
#ifndef WORKER_RENDER_EMITTER_DAYLIGHT_H
#define WORKER_RENDER_EMITTER_DAYLIGHT_H

#include "worker/render/math/vec3.h"

/* Angular radius of the sun's disk seen from the earth, in radians: half of 0.5358 degrees. */
#define DAYLIGHT_SUN_RADIUS 0.0046757

/* Parameters of the sky for one position of the sun, for each of X, Y and Z. */
struct daylight {
	double coefficient[3][9]; /* A to G, I and H of equations (8) and (9) */
	double mean_radiance[3];  /* W / (m^2 sr) */
};

/* Computes the sky. turbidity: 1 (clear) to 10 (haze); albedo: of the ground for X, Y and Z, 0 to 1; sun_angle: from
 * the zenith, 0 to pi/2. */
struct daylight daylight_make(double turbidity, const double albedo[3], double sun_angle);
/* Computes the radiance of the sky at `angle` from the zenith and `gamma` from the sun, which is never negative, and 0
 * below the horizon. */
void daylight_sky_radiance(const struct daylight *d, double angle, double gamma, double rgb[3]);
/* Computes the radiance of the sun's disk, seen through an atmosphere that scatters (Rayleigh, aerosols) and absorbs
 * (ozone, water vapour); sun_angle: from the zenith. */
void daylight_sun_radiance(double turbidity, double sun_angle, double rgb[3]);

/* A place and a time. */
struct daylight_time {
	double latitude, longitude; /* degrees; north and east are positive */
	double utc_offset, hour;    /* hours; utc_offset: of the zone, positive eastwards; hour: by the zone's clock */
	int year, month, day;
};
/* Returns the unit direction to the sun, x east, y up, z south: Blanco-Muriel et al. 2001, "Computing the Solar
 * Vector", as in both Mitsuba dialects. Accurate to an arcminute until 2050. */
vec3 daylight_sun_direction(const struct daylight_time *t);
/* Returns the number of days from one date to the other. A day beyond the end of its month lies in the next month. */
int daylight_days_between(const struct daylight_time *first, const struct daylight_time *last);

#endif
