/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Indices of refraction: a constant, by value or by name, as in Mitsuba; or, if the scene requests it, a function of
 * the wavelength by Cauchy's or Sellmeier's law (Sellmeier 1871). Wavelengths are in nm in the interface and in
 * micrometres in coefficients. Immutable after reading; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_BSDF_IOR_H
#define WORKER_RENDER_BSDF_IOR_H

#include "worker/render/scene/scene.h"

#define IOR_NM 587.6 /* helium's yellow line, near sodium's: the wavelength of constant indices */

enum { IOR_TERMS = 4 };

struct ior {
	double n;      /* at IOR_NM */
	double cauchy; /* n + cauchy (1 / L^2 - 1 / L_d^2) */
	int terms;     /* > 0: n^2 = 1 + sum b L^2 / (L^2 - c) instead */
	double b[IOR_TERMS], c[IOR_TERMS];
};

enum ior_side { IOR_INT, IOR_EXT };

/* Reads the property `name` of n, a number in that range or a material's name, as a constant; `fallback` if absent. */
int ior_read(const struct scene_node *n, const char *name, double fallback, double *out, struct error *e);

/* int_ior, int_cauchy_b, int_sellmeier, or the three for ext; with `dispersion`, names stand for the material's own
 * law. Defaults are Mitsuba's. The result is within [PARAM_IOR_MIN, PARAM_IOR_MAX] at all wavelengths. */
int ior_read_law(const struct scene_node *n, enum ior_side side, struct ior *out, struct error *e);
bool ior_has_coefficients(const struct scene_node *n); /* a law of the node's own */
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

/* The index inside over the index outside; by enum ior_side. */
double ior_eta(const struct ior side[2], double nm);

/* Names with known dispersion, for messages. */
const char *ior_dispersive_names(char *text, size_t size);

#define IOR_BK7_DEFAULT 1.5046	 /* the default inside, in both Mitsuba dialects */
#define IOR_AIR_DEFAULT 1.000277 /* ... and for the outside */

#endif
