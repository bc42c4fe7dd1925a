/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Radiance, reflectance or importance at the wavelengths that a path carries: four lanes that travel together unless
 * something disperses them (hero wavelength, Wilkie et al. 2014).
 *
 * A path's wavelengths are computed from one number u in [0,1), and all of a path's densities are with respect to
 * u. Lane i has the wavelength at which the cumulative distribution is u + i/4 (mod 1): each lane alone has
 * density wavelength_pdf, any lane as the hero gives the same four, and equal weights are those of the balance
 * heuristic. The density is proportional to |r| + |g| + |b|, the matching functions of linear Rec. 709, mixed with
 * a uniform density of weight 5 %, so that no wavelength has density 0. The relative variance of R, G, B for white
 * (D65) is then 0.07, 0.03, 0.02; with uniform wavelengths it is 0.61, 0.17, 0.67. Multiplying the density by D65
 * would give 0.10, 0.03, 0.04.
 *
 * In a grey scene (struct wavelengths.is_grey) all lanes are equal and multiply the emitters' common spectrum. Where
 * colours are rgb (struct wavelengths.is_rgb) the lanes are R, G and B of linear Rec. 709 and G once more, so that the
 * mean over the lanes is close to a luminance; the fourth lane is not part of any colour.
 */
#ifndef WORKER_RENDER_MATH_SPECTRUM_H
#define WORKER_RENDER_MATH_SPECTRUM_H

#include <math.h>
#include <stdbool.h>

enum { SPECTRUM_LANES = 4 };
#define WAVELENGTH_MIN 360.0 /* nm */
#define WAVELENGTH_MAX 830.0

typedef struct {
	double v[SPECTRUM_LANES];
} spectrum;

struct wavelengths {
	double nm[SPECTRUM_LANES];
	bool is_grey; /* the scene has no colour: nm is undefined */
	bool is_rgb;  /* the lanes are not wavelengths: nm is undefined */
	double u;     /* the number from which nm was computed; 0 if grey or rgb */
	/* 0: all wavelengths differ; 1 or 2: nm repeats after this many, for the same mean from fewer wavelengths. */
	unsigned period;
};

/* See EFFECT_IS_ON in worker/render/world/world.h. */
#ifdef HSLT_PLAIN
#define WAVELENGTHS_GREY(w) ((void)(w), true)
#else
#define WAVELENGTHS_GREY(w) ((w)->is_grey)
#endif

static inline spectrum spectrum_constant(double x)
{
	return (spectrum){{x, x, x, x}};
}

static inline spectrum spectrum_from_rgb(const double rgb[3])
{
	return (spectrum){{rgb[0], rgb[1], rgb[2], rgb[1]}};
}

static inline spectrum spectrum_add(spectrum a, spectrum b)
{
	for (int i = 0; i < SPECTRUM_LANES; i++)
		a.v[i] += b.v[i];
	return a;
}

static inline spectrum spectrum_mul(spectrum a, spectrum b)
{
	for (int i = 0; i < SPECTRUM_LANES; i++)
		a.v[i] *= b.v[i];
	return a;
}

/* Returns the transmittance of an optical depth. */
static inline spectrum spectrum_transmittance(spectrum depth)
{
	for (int i = 0; i < SPECTRUM_LANES; i++)
		depth.v[i] = exp(-depth.v[i]);
	return depth;
}

static inline spectrum spectrum_scale(double s, spectrum a)
{
	for (int i = 0; i < SPECTRUM_LANES; i++)
		a.v[i] *= s;
	return a;
}

static inline bool spectrum_is_zero(spectrum a)
{
	for (int i = 0; i < SPECTRUM_LANES; i++)
		if (a.v[i] != 0)
			return false;
	return true;
}

static inline double spectrum_max(spectrum a)
{
	double m = a.v[0];
	for (int i = 1; i < SPECTRUM_LANES; i++)
		m = a.v[i] > m ? a.v[i] : m;
	return m;
}

/* Divides before adding, so that the mean of lanes near the largest double is finite. */
static inline double spectrum_mean(spectrum a)
{
	double m = 0;
	for (int i = 0; i < SPECTRUM_LANES; i++)
		m += a.v[i] / SPECTRUM_LANES;
	return m;
}

static inline bool spectrum_is_valid(spectrum a) /* finite and non-negative */
{
	for (int i = 0; i < SPECTRUM_LANES; i++)
		if (!(a.v[i] >= 0) || !isfinite(a.v[i]))
			return false;
	return true;
}

/* Returns the density of one lane's wavelength, per nm; positive from WAVELENGTH_MIN to WAVELENGTH_MAX. */
double wavelength_pdf(double nm);
/* Returns the four wavelengths described above for u in [0,1). */
struct wavelengths wavelengths_sample(double u);
/* Returns 1, 2 or 4 wavelengths, spaced evenly in the cumulative distribution. */
struct wavelengths wavelengths_sample_distinct(double u, unsigned count);

/* Fills all lanes by repeating the first `lanes`. */
static inline spectrum spectrum_repeat(spectrum s, int lanes)
{
	for (int i = lanes; i < SPECTRUM_LANES; i++)
		s.v[i] = s.v[i - lanes];
	return s;
}

/* Computes the CIE 1931 colour of a spectrum from its four lanes (a one-sample estimate of the integral of L x_bar /
 * 106.857 nm, with each lane divided by its density, so that an emitter of rgb 1 has Y = 1), or that of rgb. Not for
 * grey, for which the film has its own factor. */
void spectrum_to_xyz(spectrum l, const struct wavelengths *w, double xyz[3]);
/* Returns weights whose sum of products with the lanes of l is X + Y + Z of spectrum_to_xyz(). */
spectrum spectrum_intensity_weights(const struct wavelengths *w);

#endif
