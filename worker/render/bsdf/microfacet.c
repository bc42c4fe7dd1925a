/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/microfacet.h"

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/warp.h"

#include <float.h>
#include <string.h>

/* Returns the length of v's tangential part, with its component along the v axis stretched by the ratio. Times alpha,
 * this length takes the place of the sine in Smith's masking function. */
static double stretched_sine(const struct microfacet *m, vec3 v)
{
	return sqrt(v.x * v.x + m->ratio * m->ratio * (v.y * v.y));
}

double microfacet_d(const struct microfacet *m, vec3 h)
{
	if (!(h.z > 0))
		return 0;
	/* a2 = alpha_u alpha_v; s2 / c2 is a2 times the sum of the squared slopes, each over its squared roughness. */
	double a2 = m->alpha * m->alpha * m->ratio, c2 = h.z * h.z, s2 = h.x * h.x * m->ratio + h.y * h.y / m->ratio;
	if (m->is_ggx) {
		double d = a2 * c2 + s2;
		return a2 / (WARP_PI * d * d);
	}
	if (s2 > 700 * a2 * c2) /* below the smallest double */
		return 0;
	return exp(-s2 / (a2 * c2)) / (WARP_PI * a2 * c2 * c2);
}

double microfacet_g1_over_cos(const struct microfacet *m, vec3 v)
{
	double c = v.z, s = m->alpha * stretched_sine(m, v);
	if (m->is_ggx)
		return 2 / (c + sqrt(c * c + s * s));
	if (c >= 6 * s) /* 1 - G1 is below the rounding of double */
		return 1 / c;
	double a = c / s;
	return 2 / (c * (1 + erf(a)) + s * exp(-a * a) * (1 / sqrt(WARP_PI)));
}

/* The inverse of erf for |x| < 1: Giles 2010, Approximating the erfinv function, followed by one Newton step to full
 * precision. */
static double erf_inverse(double x)
{
	double w = -log((1 - x) * (1 + x)), p;
	if (w < 5) {
		w -= 2.5;
		p = 2.81022636e-08;
		p = 3.43273939e-07 + p * w;
		p = -3.5233877e-06 + p * w;
		p = -4.39150654e-06 + p * w;
		p = 0.00021858087 + p * w;
		p = -0.00125372503 + p * w;
		p = -0.00417768164 + p * w;
		p = 0.246640727 + p * w;
		p = 1.50140941 + p * w;
	} else {
		w = sqrt(w) - 3;
		p = -0.000200214257;
		p = 0.000100950558 + p * w;
		p = 0.00134934322 + p * w;
		p = -0.00367342844 + p * w;
		p = 0.00573950773 + p * w;
		p = -0.0076224613 + p * w;
		p = 0.00943887047 + p * w;
		p = 1.00167406 + p * w;
		p = 2.83297682 + p * w;
	}
	p *= x;
	return p - (erf(p) - x) * (0.5 * sqrt(WARP_PI)) * exp(p * p);
}

/* Samples a slope x below c/s with density proportional to (c - s x) exp(-x^2), by Newton's method inside a bracket. */
static double sample_visible_slope(double c, double s, double u)
{
	const double half_root = 0.5 * sqrt(WARP_PI);
	double low = -6, high = c < 6 * s ? c / s : 6;
	double total = c * half_root * erfc(-high) + 0.5 * s * exp(-high * high), target = u * total;
	/* Exact for s = 0 and for c = 0. */
	double x =
		c > s ? erf_inverse(fmin(fmax(2 * u - 1, -1 + 0x1p-52), 1 - 0x1p-52)) : -sqrt(-log(fmax(u, 0x1p-52)));
	for (int i = 0; i < 100; i++) {
		if (!(x > low && x < high))
			x = 0.5 * (low + high);
		double bell = exp(-x * x), f = c * half_root * erfc(-x) + 0.5 * s * bell - target,
		       slope = (c - s * x) * bell;
		if (f > 0)
			high = x;
		else
			low = x;
		double next = slope > 0 ? x - f / slope : low;
		if (fabs(f) <= 4 * DBL_EPSILON * total || high - low <= 4 * DBL_EPSILON * (1 + fabs(x)))
			return x;
		x = next;
	}
	return x;
}

static vec3 sample_beckmann_visible(const struct microfacet *m, vec3 v, double u0, double u1)
{
	double sv = stretched_sine(m, v), s = m->alpha * sv, r = sqrt(s * s + v.z * v.z), along_v = m->alpha * m->ratio;
	double x = sample_visible_slope(v.z / r, s / r, u0);
	double y = erf_inverse(fmin(fmax(2 * u1 - 1, -1 + 0x1p-52), 1 - 0x1p-52));
	double cos_phi = sv > 0 ? v.x / sv : 1, sin_phi = sv > 0 ? m->ratio * v.y / sv : 0;
	return vec3_normalize(
		(vec3){-m->alpha * (cos_phi * x - sin_phi * y), -along_v * (sin_phi * x + cos_phi * y), 1});
}

static vec3 sample_ggx_visible(const struct microfacet *m, vec3 v, double u0, double u1)
{
	double along_v = m->alpha * m->ratio;
	vec3 stretched = vec3_normalize((vec3){m->alpha * v.x, along_v * v.y, v.z});
	double z = (1 - u1) * (1 + stretched.z) - stretched.z, r = sqrt(fmax(0, (1 - z) * (1 + z)));
	double phi = 2 * WARP_PI * u0;
	vec3 h = {m->alpha * (r * cos(phi) + stretched.x), along_v * (r * sin(phi) + stretched.y), z + stretched.z};
	/* h.z rounds to 0 only on the rim of the cap for v in the surface's plane, where any normal on the rim is
	 * valid. */
	return h.z > 0 ? vec3_normalize(h) : (vec3){0, 0, 1};
}

vec3 microfacet_sample_visible(const struct microfacet *m, vec3 v, double u0, double u1)
{
	return m->is_ggx ? sample_ggx_visible(m, v, u0, u1) : sample_beckmann_visible(m, v, u0, u1);
}

double microfacet_reflect(const struct microfacet *m, double eta, vec3 wo, vec3 wi, double *pdf)
{
	double length;
	vec3 h;
	*pdf = 0;
	if (!microfacet_half_vector(wo, 1, wi, &h, &length))
		return 0;
	*pdf = 0.25 * microfacet_d(m, h) * microfacet_g1_over_cos(m, wo);
	return *pdf * microfacet_g1_over_cos(m, wi) * fresnel_dielectric(fmin(0.5 * length, 1), eta).reflectance;
}

void microfacet_init(struct microfacet *m, bool is_ggx, double alpha_u, double alpha_v)
{
	m->is_ggx = is_ggx;
	m->alpha = fmax(alpha_u, MICROFACET_ALPHA_MIN);
	m->ratio = fmax(alpha_v, MICROFACET_ALPHA_MIN) / m->alpha;
}

double microfacet_min_alpha(const struct microfacet *m)
{
	return m->alpha * fmin(m->ratio, 1);
}

double microfacet_mean_alpha(const struct microfacet *m)
{
	return m->alpha * sqrt(m->ratio);
}

int microfacet_read(struct microfacet *m, const struct scene_node *n, struct error *e)
{
	double alpha = node_float(n, "alpha", 0.1);
	bool is_ggx = strcmp(node_string(n, "distribution", "beckmann"), "ggx") == 0;
	microfacet_init(m, is_ggx, node_float(n, "alpha_u", alpha), node_float(n, "alpha_v", alpha));
	if (m->ratio > MICROFACET_RATIO_MAX || m->ratio < 1 / MICROFACET_RATIO_MAX)
		return node_error(n, e, ERANGE, "alpha_u = %g and alpha_v = %g are more than a factor of %g apart",
				  m->alpha, m->alpha * m->ratio, MICROFACET_RATIO_MAX);
	return 0;
}
