/* SPDX-License-Identifier: Apache-2.0 */
/* Reflection at a smooth boundary, unpolarised. Cosines are on the incident side, in [0,1]. */
#ifndef WORKER_RENDER_BSDF_FRESNEL_H
#define WORKER_RENDER_BSDF_FRESNEL_H

#include "worker/render/math/minmax.h"

#include <math.h>
#include <stdbool.h>

/* The reflected and the transmitted share of light; both keep their precision where they are small. */
struct fresnel {
	double reflectance, transmittance;
	double cos_t; /* cosine of the refracted ray, 0 at total reflection */
};

/* Returns the Fresnel terms for the cosines c here and t beyond, of directions related by Snell's law; eta: index
 * beyond over index here. The differences of amplitudes are expanded, so that no digits cancel when eta is close to
 * 1. */
static inline struct fresnel fresnel_between(double c, double t, double eta)
{
	double s = 1 / (c + eta * t), p = 1 / (eta * c + t), e = (eta - 1) * (eta + 1);
	double rs = e * s * s, rp = e * p * ((c * c * (eta * eta + 1) - 1) * p) / (eta * eta);
	double ts = 2 * c * s * (eta * t * s), tp = 2 * c * p * (eta * t * p);
	return (struct fresnel){min_of(0.5 * (rs * rs + rp * rp), 1), min_of(ts + tp, 1), t};
}

/* Returns the Fresnel terms for the cosine c; eta: index beyond over index here. */
static inline struct fresnel fresnel_dielectric(double c, double eta)
{
	/* (eta cos_t)^2: the first form is precise at grazing angles with eta close to 1, the second close to the
	 * normal. */
	double t2 = c * c < 0.5 ? (eta - 1) * (eta + 1) + c * c : eta * eta - (1 - c) * (1 + c);
	if (!(t2 > 0))
		return (struct fresnel){1, 0, 0};
	return fresnel_between(c, sqrt(t2) / eta, eta);
}

/* Returns the probability of following the reflection or the transmission at a smooth boundary. Water reflects two
 * per cent of the light of a lamp, but the mirrored lamp is much brighter than anything below the surface.
 * Reflection is therefore followed with a probability of at least FRESNEL_REFLECT_CHANCE_MIN; but at most with
 * FRESNEL_REFLECT_BOOST_MAX its share of light, since a boundary between nearly equal indices would waste samples.
 * Transmitted paths become rarer by at most a tenth. */
#define FRESNEL_REFLECT_CHANCE_MIN 0.1
#define FRESNEL_REFLECT_BOOST_MAX 8
static inline double fresnel_reflection_probability(const struct fresnel *f, bool reflect)
{
	double reflection_probability = fmin(FRESNEL_REFLECT_CHANCE_MIN, FRESNEL_REFLECT_BOOST_MAX * f->reflectance);
	if (!(f->transmittance > 0) || !(f->reflectance < reflection_probability))
		return reflect ? f->reflectance : f->transmittance;
	return reflect ? reflection_probability : 1 - reflection_probability;
}

/* Returns the reflectance of a conductor with the index eta - i k, relative to the index here. eta = 0, k = 1 is a
 * perfect mirror. There are no branches, so that a loop over wavelengths can be vectorised, and nothing overflows: eta
 * and k are at most 1e9. */
static inline double fresnel_conductor(double c, double eta, double k)
{
	double c2 = c * c, s2 = (1 - c) * (1 + c), ek = 2 * eta * k;
	double t0 = (eta - k) * (eta + k) - s2, n2 = sqrt(t0 * t0 + ek * ek), half = 0.5 * (n2 + t0);
	double t1 = n2 + c2, t2 = 2 * c * sqrt(half > 0 ? half : 0);
	double t3 = c2 * n2 + s2 * s2, t4 = t2 * s2, s = t1 + t2, p = t3 + t4;
	double rs = (s > 0 ? t1 - t2 : 1) / (s > 0 ? s : 1);
	double rp = rs * ((p > 0 ? t3 - t4 : 1) / (p > 0 ? p : 1));
	double r = 0.5 * (rs + rp);
	return r > 0 ? r : 0; /* may be negative by rounding if both indices are equal */
}

#endif
