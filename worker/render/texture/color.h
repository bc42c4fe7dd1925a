/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Colour values as functions of wavelength (docs/design.md, rules 3).
 * Reflectances: Jakob and Hanika 2019 sigmoid polynomials, round trip under D65. Illuminants: largest component x
 * upsampled colour x D65 normalised to give Rec. 709 (1,1,1) for rgb 1. Unbounded (eta, k): scaled into [0,1] by
 * twice the maximum and back. Immutable after creation; any thread; evaluation allocates nothing.
 */
#ifndef WORKER_RENDER_TEXTURE_COLOR_H
#define WORKER_RENDER_TEXTURE_COLOR_H

#include "worker/render/math/spectrum.h"
#include "worker/render/scene/scene.h"

#include <assert.h>

/* The last two are for textures only, plain numbers of either sign rather than spectra: displacement heights, whose
 * images are used as stored, and relief, whose images are decoded like colours. */
enum color_role { COLOR_REFLECTANCE, COLOR_ILLUMINANT, COLOR_UNBOUNDED, COLOR_HEIGHT, COLOR_RELIEF };

static inline bool color_role_is_number(enum color_role r)
{
	return r == COLOR_HEIGHT || r == COLOR_RELIEF;
}

/* How a colour varies with wavelength. Grey scenes need all reflectances CONSTANT and all emitters of one kind. */
enum color_shape { COLOR_SHAPE_CONSTANT, COLOR_SHAPE_D65, COLOR_SHAPE_OTHER };

struct color {
	enum color_shape shape;
	double scale; /* multiplies everything */
	bool d65;     /* times D65 / its normalisation */
	bool sigmoid; /* times S(c0 x^2 + c1 x + c2), x = nm */
	double coefficient[3];
	uint32_t count; /* > 0: piecewise linear table instead; beyond it 0 if zero_outside, or the end values */
	double per_nm;	/* pieces, on average */
	const double *nm, *value; /* in the arena */
	bool zero_outside;
	bool tinted; /* where colours are rgb: the scale times rgb; otherwise three times the scale */
	double rgb[3];
};

/* value: one of VALUE_COLOR. Reflectances outside [0,1] are an error; negative values always are. */
int color_from_value(const struct value *v, enum color_role role, struct arena *arena, struct color *out,
		     struct error *e);
int color_from_rgb(const double rgb[3], enum color_role role, struct color *out);
/* Linear between n >= 2 values at ascending nm, which must outlive it. Beyond the ends it is 0 if zero_outside, as
 * Mitsuba has all tables, or has the value at the end: indices and coefficients of media, whose 0 nobody means. Where
 * colours are rgb it is that of light with these values, times D65's if under_d65. */
struct color color_of_table(uint32_t n, const double *nm, const double *value, bool zero_outside, bool under_d65);
struct color color_constant(double x);
spectrum color_eval_coloured(const struct color *c, const struct wavelengths *w); /* color_eval, if not grey */
static inline spectrum color_eval(const struct color *c, const struct wavelengths *w)
{
	if (WAVELENGTHS_GREY(w)) {
		assert(c->shape != COLOR_SHAPE_OTHER);
		return spectrum_of(c->scale);
	}
	return color_eval_coloured(c, w);
}
/* color_eval of two colours; one search if their tables have the same wavelengths, as a metal's n and k have. */
void color_eval_both(const struct color *a, const struct color *b, const struct wavelengths *w, spectrum out[2]);
double color_max(const struct color *c);  /* upper bound over wavelengths */
double color_mean(const struct color *c); /* averaged over wavelengths as they are drawn, to choose among emitters */

/* Fast reflectance for many rgb values (textures): from a table of coefficients made at build time. rgb in [0,1]. */
spectrum color_eval_rgb_reflectance(const double rgb[3], const struct wavelengths *w);
double color_max_rgb_reflectance(const double rgb[3]); /* of that spectrum */
/* The same for emitters: largest component x reflectance x D65. rgb >= 0. */
spectrum color_eval_rgb_illuminant(const double rgb[3], const struct wavelengths *w);
/* The same for what may exceed 1: COLOR_UNBOUNDED_OVER times the largest component x reflectance. */
#define COLOR_UNBOUNDED_OVER 2
spectrum color_eval_rgb_unbounded(const double rgb[3], const struct wavelengths *w);
double color_max_d65(void);

/* D65 normalised so that an emitter with this spectrum has Rec. 709 (1,1,1); by linear interpolation. */
double color_d65(double nm);

#endif
