/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The model of Chiang, Bitterli, Tappan and Burley 2016, A Practical and Controllable Hair and Fur Model for Production
 * Path Tracing, which has the form of Marschner et al. 2003 and the M of d'Eon et al. 2011, An Energy-Conserving Hair
 * Reflectance Model. M and N are densities, and without absorption the shares of the lobes add up to 1, so the model
 * neither gains nor loses light, whatever the direction and the distance from the axis.
 *
 * No expression subtracts large numbers of similar size, so that results are as exact for a roughness of 0.001, light
 * along the axis, and light that only just touches the fibre as elsewhere. Nothing here fails.
 */
#include "worker/render/bsdf/hair_lobes.h"

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/warp.h"

#include <float.h>

/* The argument from which the asymptotic series is used; its error is about exp(-2 x). */
#define BESSEL_ASYMPTOTIC_MIN 15
enum { BESSEL_TERMS = 40 };

/* I0(x) = sum (x^2 / 4)^k / k!^2, and for large x exp(x) / sqrt(2 pi x) sum ((2k - 1)!!)^2 / (k! (8x)^k) (Abramowitz
 * and Stegun 1964, 9.6.12 and 9.7.1). The terms of the first series are positive and decrease after k = x / 2; the
 * second series is cut off where its terms are below rounding, or before they grow again. */
double hair_scaled_bessel_i0(double x)
{
	double sum = 1, term = 1;
	if (x < BESSEL_ASYMPTOTIC_MIN) {
		double y = 0.25 * x * x;
		for (int k = 1; k < BESSEL_TERMS && term > DBL_EPSILON * 0x1p-3 * sum; k++)
			sum += term *= y / (k * k);
		return exp(-x) * sum;
	}
	for (int k = 1; k < BESSEL_TERMS && term > DBL_EPSILON * 0x1p-3; k++) {
		double odd = 2 * k - 1, next = term * odd * odd / (8 * k * x);
		if (next > term)
			break;
		sum += term = next;
	}
	return sum / sqrt(2 * WARP_PI * x);
}

/* Chiang 2016, eqs. 7 and 8: variance along the fibre and width around it, chosen so that equal steps of roughness look
 * alike. */
static double variance_from_roughness(double roughness)
{
	double b2 = roughness * roughness, x = 0.726 * roughness + 0.812 * b2 + 3.7 * pow(roughness, 20);
	return x * x;
}

static double width_from_roughness(double roughness)
{
	return sqrt(WARP_PI / 8) * (0.265 * roughness + 1.194 * roughness * roughness + 5.372 * pow(roughness, 22));
}

void hair_fibre_init(struct hair_fibre *f, double eta, double longitudinal_roughness, double azimuthal_roughness,
		     double tilt)
{
	/* Transmission narrows a lobe, reflection inside widens it (Marschner 2003, table 1); the tilts are those of
	 * Chiang 2016, sec. 4.1. */
	static const double variance_factor[HAIR_LOBES] = {1, 0.25, 4, 4}, tilt_factor[HAIR_LOBES] = {-2, 1, 4, 0};
	double v = variance_from_roughness(max_of(longitudinal_roughness, HAIR_ROUGHNESS_MIN));
	f->eta = eta;
	for (int p = 0; p < HAIR_LOBES; p++) {
		struct hair_lobe_width *w = &f->longitudinal[p];
		w->variance = variance_factor[p] * v;
		w->exp_minus_2_over_variance = exp(-2 / w->variance);
		w->normalization = -1 / (w->variance * expm1(-2 / w->variance));
		f->tilt[p] = (struct hair_angle){sin(tilt_factor[p] * tilt), cos(tilt_factor[p] * tilt)};
	}
	f->azimuthal_width = width_from_roughness(max_of(azimuthal_roughness, HAIR_ROUGHNESS_MIN));
	f->logistic_tail = exp(-WARP_PI / f->azimuthal_width);
}

/*
 * In the plane across it, the fibre acts like one with the index eta' = sqrt(eta^2 - sin^2 theta) / cos theta
 * (Marschner 2003, appendix B): sin gamma_t = h / eta' with h = sin gamma_i, and one passage through it has the length
 * 2 cos gamma_t / cos theta_t. Since cos theta sin gamma_i = x and cos theta cos gamma_i = z, neither quotient has to
 * be computed.
 */
struct hair_entry hair_enter(const struct hair_fibre *f, double x, double z)
{
	struct fresnel fresnel = fresnel_dielectric(min_of(z, 1), f->eta);
	struct hair_entry e = {fresnel.reflectance, fresnel.transmittance, 0, 0};
	double e2 = (f->eta - 1) * (f->eta + 1), across = e2 + x * x + z * z, beyond = e2 + z * z;
	if (!(e.transmittance > 0 && across > 0 && beyond >= 0))
		return (struct hair_entry){1, 0, 0, 0};
	e.gamma_t = -atan2(x, sqrt(beyond));
	e.passage_length = 2 * f->eta * sqrt(beyond) / across;
	return e;
}

/* Chiang 2016, sec. 3.2; the last share is the sum of the geometric series of all further reflections (eq. 6). */
void hair_lobe_shares(const struct hair_entry *e, double t, double share[HAIR_LOBES])
{
	share[0] = e->reflectance;
	for (int p = 1; p < HAIR_LOBES; p++)
		share[p] = 0;
	if (!(e->transmittance > 0))
		return;
	share[1] = e->transmittance * e->transmittance * t;
	for (int p = 2; p < HAIR_LOBES; p++)
		share[p] = share[p - 1] * t * e->reflectance;
	share[HAIR_LOBES - 1] /= (1 - t) + t * e->transmittance; /* 1 - t reflected */
}

/* Turns theta by the tilt of the scales (Chiang 2016, sec. 4.1). Beyond the axis, the direction comes down on the other
 * side. */
static struct hair_angle tilt_direction(const struct hair_fibre *f, int p, struct hair_angle a)
{
	const struct hair_angle *t = &f->tilt[p];
	return (struct hair_angle){a.sin * t->cos + a.cos * t->sin, fabs(a.cos * t->cos - a.sin * t->sin)};
}

/*
 * d'Eon 2011, eq. 7: M = exp(-sin sin / v) I0(cos cos / v) / (2 v sinh(1 / v)). The exponents of the three factors add
 * up to (cos(theta_i + theta_o) - 1) / v, where cos - 1 is minus half the squared distance between two points of the
 * unit circle, which is computed without cancellation.
 */
double hair_longitudinal_pdf(const struct hair_fibre *f, int p, struct hair_angle theta_i, struct hair_angle theta_o)
{
	const struct hair_lobe_width *w = &f->longitudinal[p];
	theta_i = tilt_direction(f, p, theta_i);
	double ds = theta_i.sin + theta_o.sin, dc = theta_i.cos - theta_o.cos;
	return exp(-0.5 * (ds * ds + dc * dc) / w->variance) *
	       hair_scaled_bessel_i0(theta_i.cos * theta_o.cos / w->variance) * w->normalization;
}

/* d'Eon 2013, A Fiber Scattering Model with Non-Separable Lobes, sec. 3: samples a direction around one of the cone,
 * and keeps only its theta. */
struct hair_angle hair_sample_longitudinal(const struct hair_fibre *f, int p, struct hair_angle theta_i, double u0,
					   double u1)
{
	const struct hair_lobe_width *w = &f->longitudinal[p];
	theta_i = tilt_direction(f, p, theta_i);
	/* 1 - cos of the angle to the cone, within [0, 2]. */
	double down = min_of(-w->variance * log(max_of(u0 + (1 - u0) * w->exp_minus_2_over_variance, DBL_MIN)), 2),
	       c = 1 - down, s = sqrt(max_of(down * (2 - down), 0));
	double sine = -c * theta_i.sin + s * cos(2 * WARP_PI * u1) * theta_i.cos;
	sine = min_of(max_of(sine, -1), 1);
	return (struct hair_angle){sine, sqrt((1 - sine) * (1 + sine))};
}

/* Chiang 2016, eqs. 11 and 12: the logistic distribution, truncated to [-pi, pi]. */
double hair_azimuthal_pdf(const struct hair_fibre *f, double offset)
{
	double x = exp(-fabs(remainder(offset, 2 * WARP_PI)) / f->azimuthal_width), sum = 1 + x;
	return x / (f->azimuthal_width * sum * sum) * ((1 + f->logistic_tail) / (1 - f->logistic_tail));
}

double hair_sample_azimuthal(const struct hair_fibre *f, double u)
{
	double below = f->logistic_tail + u * (1 - f->logistic_tail), above = 1 - u * (1 - f->logistic_tail);
	double x = f->azimuthal_width * log(max_of(below, DBL_MIN) / max_of(above, DBL_MIN));
	return min_of(max_of(x, -WARP_PI), WARP_PI);
}

double hair_azimuth_change(int p, double gamma_i, double gamma_t)
{
	return 2 * p * gamma_t - 2 * gamma_i + p * WARP_PI;
}
