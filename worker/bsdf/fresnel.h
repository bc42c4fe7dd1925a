/* Reflection at a smooth boundary, unpolarised. Cosines on the side that the light is on, in [0,1]. */
#ifndef WORKER_BSDF_FRESNEL_H
#define WORKER_BSDF_FRESNEL_H

#include <math.h>

/* Shares of light; both keep their digits where they are small. */
struct fresnel {
	double reflected, transmitted;
	double cos_t; /* cosine beyond, 0 at total reflection */
};

/* eta: index beyond over index here. */
static inline struct fresnel fresnel_dielectric(double c, double eta)
{
	double s2 = (1 - c) * (1 + c), t2 = 1 - s2 / (eta * eta);
	if (!(t2 > 0))
		return (struct fresnel){1, 0, 0};
	double t = sqrt(t2), s = 1 / (c + eta * t), p = 1 / (eta * c + t);
	double rs = (c - eta * t) * s, rp = (eta * c - t) * p;
	return (struct fresnel){0.5 * (rs * rs + rp * rp), 2 * c * eta * t * (s * s + p * p), t};
}

/* Index eta - i k beyond, over the index here. eta = 0, k = 1 is a perfect mirror. */
static inline double fresnel_conductor(double c, double eta, double k)
{
	double c2 = c * c, s2 = (1 - c) * (1 + c);
	double t0 = (eta - k) * (eta + k) - s2, n2 = hypot(t0, 2 * eta * k);
	double t1 = n2 + c2, t2 = 2 * c * sqrt(fmax(0, 0.5 * (n2 + t0)));
	double t3 = c2 * n2 + s2 * s2, t4 = t2 * s2;
	double rs = t1 + t2 > 0 ? (t1 - t2) / (t1 + t2) : 1;
	double rp = t3 + t4 > 0 ? rs * (t3 - t4) / (t3 + t4) : rs;
	return 0.5 * (rs + rp);
}

#endif
