/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Colours as functions of wavelength (docs/design.md, rules 3).
 * Reflectances are sigmoid polynomials (Jakob and Hanika 2019) that give back their RGB values under D65. Illuminants
 * are the largest component x the upsampled colour x D65, normalised to give Rec. 709 (1,1,1) for rgb 1. Unbounded
 * quantities (eta, k) are divided by twice their maximum, upsampled, and multiplied again. Immutable after creation;
 * any thread; evaluation allocates nothing.
 */
#ifndef WORKER_RENDER_TEXTURE_COLOR_H
#define WORKER_RENDER_TEXTURE_COLOR_H

#include "worker/render/math/spectrum.h"
#include "worker/render/scene/scene.h"

#include <assert.h>

/* COLOR_HEIGHT and COLOR_RELIEF are for textures only, and are numbers of either sign rather than spectra: heights of
 * displacement, whose images are used as stored, and bump and normal maps, whose images are decoded like colours. */
enum color_role { COLOR_REFLECTANCE, COLOR_ILLUMINANT, COLOR_UNBOUNDED, COLOR_HEIGHT, COLOR_RELIEF };

static inline bool color_role_is_number(enum color_role r)
{
	return r == COLOR_HEIGHT || r == COLOR_RELIEF;
}

/* How a colour varies with wavelength. In a grey scene, all reflectances are CONSTANT and all emitters are of one
 * kind. */
enum color_kind { COLOR_KIND_CONSTANT, COLOR_KIND_D65, COLOR_KIND_OTHER };

struct color {
	enum color_kind kind;
	double scale;	   /* factor of the following */
	bool is_times_d65; /* times normalised D65 */
	bool is_sigmoid;   /* times S(c0 x^2 + c1 x + c2), x the wavelength in nm */
	double coefficient[3];
	uint32_t count; /* > 0: times a piecewise linear table; beyond its ends 0 if is_zero_outside, otherwise the end
			   values */
	double intervals_per_nm;  /* pieces per nm, on average */
	const double *nm, *value; /* in the arena */
	bool is_zero_outside;
	bool has_rgb; /* with colour=rgb, the components are scale times rgb; otherwise each is the scale */
	double rgb[3];
};

/* Makes a colour from v, one of VALUE_COLOR; tables are copied to the arena. Returns 0, -EINVAL with a sentence if a
 * value is negative, or above 1 for a reflectance, or -ENOMEM. */
int color_from_value(const struct value *v, enum color_role role, struct arena *arena, struct color *out,
		     struct error *e);
/* Makes a colour from linear Rec. 709. Returns 0, or -EINVAL if a component is out of the role's range. */
int color_from_rgb(const double rgb[3], enum color_role role, struct color *out);
/* Returns a colour that is linear between n >= 2 values at ascending nm; both arrays must outlive it. Beyond the ends
 * it is 0 if is_zero_outside, like all of Mitsuba's tables; otherwise it keeps the value at the end, which suits
 * indices and coefficients of media, where 0 is never meant. With colour=rgb, its components are those of light with
 * these values, times D65 if under_d65. */
struct color color_from_samples(uint32_t n, const double *nm, const double *value, bool zero_outside, bool under_d65);
struct color color_constant(double x);
spectrum color_eval_colored(const struct color *c, const struct wavelengths *w); /* color_eval, if not grey */
static inline spectrum color_eval(const struct color *c, const struct wavelengths *w)
{
	if (WAVELENGTHS_GREY(w)) {
		assert(c->kind != COLOR_KIND_OTHER);
		return spectrum_constant(c->scale);
	}
	return color_eval_colored(c, w);
}
/* Evaluates two colours; with a single search if their tables share the wavelengths, as those of a metal's n and k
 * do. */
void color_eval_pair(const struct color *a, const struct color *b, const struct wavelengths *w, spectrum out[2]);
double color_max(const struct color *c);  /* upper bound over wavelengths */
double color_mean(const struct color *c); /* mean over wavelengths as they are sampled, to choose among emitters */

/* Returns the reflectance of an RGB value of a texture, fast, from a table of coefficients that is computed when the
 * program is built. rgb in [0,1]. */
spectrum color_eval_rgb_reflectance(const double rgb[3], const struct wavelengths *w);
double color_max_rgb_reflectance(const double rgb[3]); /* the maximum of that spectrum */
/* Likewise for emitters: largest component x reflectance x D65. rgb >= 0. */
spectrum color_eval_rgb_illuminant(const double rgb[3], const struct wavelengths *w);
/* Likewise for quantities that may exceed 1: COLOR_UNBOUNDED_SCALE x largest component x reflectance. */
#define COLOR_UNBOUNDED_SCALE 2
spectrum color_eval_rgb_unbounded(const double rgb[3], const struct wavelengths *w);
double color_max_d65(void);

/* Returns D65, normalised so that an emitter with this spectrum has Rec. 709 (1,1,1), by linear interpolation;
 * color_max_d65 returns its maximum. */
double color_d65(double nm);

#endif
