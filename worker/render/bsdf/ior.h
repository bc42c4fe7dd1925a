/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Indices of refraction: one number, by value or by name, as in Mitsuba; or, where the scene asks for it, a function of
 * the wavelength by Cauchy's or Sellmeier's law (Sellmeier 1871). Wavelengths in nm outside, in micrometres in
 * coefficients. Immutable after reading; any thread; nothing allocates.
 */
#ifndef WORKER_RENDER_BSDF_IOR_H
#define WORKER_RENDER_BSDF_IOR_H

#include "worker/render/scene/scene.h"

#define IOR_NM 587.6 /* helium's yellow line, near sodium's: where indices that are one number are taken */

enum { IOR_TERMS = 4 };

struct ior {
	double n;      /* at IOR_NM */
	double cauchy; /* n + cauchy (1 / L^2 - 1 / L_d^2) */
	int terms;     /* > 0: n^2 = 1 + sum b L^2 / (L^2 - c) instead */
	double b[IOR_TERMS], c[IOR_TERMS];
};

enum ior_side { IOR_INT, IOR_EXT };

/* The property `name` of n, a number of that range or a name, as one number; `fallback` when absent. */
int ior_read(const struct scene_node *n, const char *name, double fallback, double *out, struct error *e);

/* int_ior, int_cauchy_b, int_sellmeier or the three for ext; names have their own law where `dispersion` is on.
 * Defaults are Mitsuba's. What is returned is within [PARAM_IOR_MIN, PARAM_IOR_MAX] over all wavelengths. */
int ior_read_law(const struct scene_node *n, enum ior_side side, struct ior *out, struct error *e);
#define IOR_NUMBER(name_)                                                                             \
	{                                                                                             \
		.name = name_, .types = VALUE_FLOAT | VALUE_INT | VALUE_STRING, .min = PARAM_IOR_MIN, \
		.max = PARAM_IOR_MAX                                                                  \
	}
#define IOR_PARAMS                                                                                 \
	IOR_NUMBER("int_ior"), IOR_NUMBER("ext_ior"), {.name = "dispersion", .types = VALUE_BOOL}, \
		{.name = "int_cauchy_b", .types = VALUE_FLOAT | VALUE_INT, .min = -1, .max = 1},   \
		{.name = "ext_cauchy_b", .types = VALUE_FLOAT | VALUE_INT, .min = -1, .max = 1},   \
		{.name = "int_sellmeier", .types = VALUE_STRING},                                  \
	{                                                                                          \
		.name = "ext_sellmeier", .types = VALUE_STRING                                     \
	}

double ior_at(const struct ior *i, double nm);
/* The index inside over the one outside; by enum ior_side. */
double ior_eta(const struct ior side[2], double nm);

/* Names whose dispersion is known, for messages. */
const char *ior_dispersive_names(char *text, size_t size);

#define IOR_BK7_DEFAULT 1.5046	 /* what both Mitsuba dialects take for the inside when nothing is said */
#define IOR_AIR_DEFAULT 1.000277 /* ... and for the outside */

#endif
