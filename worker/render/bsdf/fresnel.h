/* SPDX-License-Identifier: Apache-2.0 */
/* Reflection at a smooth boundary, unpolarised. Cosines are on the incident side, in [0,1]. */
#ifndef WORKER_RENDER_BSDF_FRESNEL_H
#define WORKER_RENDER_BSDF_FRESNEL_H

#include "worker/render/math/minmax.h"

#include <math.h>
#include <stdbool.h>

/* Shares of light; both keep their precision where they are small. */
struct fresnel {
	double reflected, transmitted;
	double cos_t; /* cosine of the refracted ray, 0 at total reflection */
};

/* Cosines on both sides, of directions related by Snell's law; eta: index beyond over index here. The differences of
 * amplitudes are written out, so that no digits cancel when eta is close to 1. */
static inline struct fresnel fresnel_between(double c, double t, double eta)
{
	double s = 1 / (c + eta * t), p = 1 / (eta * c + t), e = (eta - 1) * (eta + 1);
	double rs = e * s * s, rp = e * p * ((c * c * (eta * eta + 1) - 1) * p) / (eta * eta);
	double ts = 2 * c * s * (eta * t * s), tp = 2 * c * p * (eta * t * p);
	return (struct fresnel){min_of(0.5 * (rs * rs + rp * rp), 1), min_of(ts + tp, 1), t};
}

static inline struct fresnel fresnel_dielectric(double c, double eta)
{
	/* (eta cos_t)^2; each form keeps its precision where it is used, close to eta = 1 and to the normal. */
	double t2 = c * c < 0.5 ? (eta - 1) * (eta + 1) + c * c : eta * eta - (1 - c) * (1 + c);
	if (!(t2 > 0))
		return (struct fresnel){1, 0, 0};
	return fresnel_between(c, sqrt(t2) / eta, eta);
}

/* The probability of following the reflection or the transmission at a smooth boundary. A lamp that is mirrored by
 * water is seen by the two per cent of light that are reflected, and is so much brighter than what lies below that a
 * path has to follow the reflection more often than light does: with FRESNEL_LEAST, but at most FRESNEL_TIMES as often,
 * lest a boundary between nearly equal indices waste its samples. Transmitted paths become rarer by a tenth at most. */
#define FRESNEL_LEAST 0.1
#define FRESNEL_TIMES 8
static inline double fresnel_chance(const struct fresnel *f, bool reflect)
{
	double often = fmin(FRESNEL_LEAST, FRESNEL_TIMES * f->reflected);
	if (!(f->transmitted > 0) || !(f->reflected < often))
		return reflect ? f->reflected : f->transmitted;
	return reflect ? often : 1 - often;
}

/* Index eta - i k beyond, relative to the index here. eta = 0, k = 1 is a perfect mirror. No branches, so that a loop
 * over wavelengths is vectorised. Nothing overflows: eta and k are at most 1e9. */
static inline double fresnel_conductor(double c, double eta, double k)
{
	double c2 = c * c, s2 = (1 - c) * (1 + c), ek = 2 * eta * k;
	double t0 = (eta - k) * (eta + k) - s2, n2 = sqrt(t0 * t0 + ek * ek), half = 0.5 * (n2 + t0);
	double t1 = n2 + c2, t2 = 2 * c * sqrt(half > 0 ? half : 0);
	double t3 = c2 * n2 + s2 * s2, t4 = t2 * s2, s = t1 + t2, p = t3 + t4;
	double rs = (s > 0 ? t1 - t2 : 1) / (s > 0 ? s : 1);
	double rp = rs * ((p > 0 ? t3 - t4 : 1) / (p > 0 ? p : 1));
	double r = 0.5 * (rs + rp);
	return r > 0 ? r : 0; /* rounding, where both sides are alike */
}

#endif
