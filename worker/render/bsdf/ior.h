/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Indices of refraction: a constant, given by its value or by a material's name, as in Mitsuba; or, if the scene
 * requests it, a function of the wavelength by Cauchy's or Sellmeier's law (Sellmeier 1871). Wavelengths are in nm in
 * the interface, and in micrometres in the coefficients and in the formulas below. Immutable after reading; any thread;
 * allocates nothing.
 */
#ifndef WORKER_RENDER_BSDF_IOR_H
#define WORKER_RENDER_BSDF_IOR_H

#include "worker/render/scene/scene.h"

#define IOR_REFERENCE_NM 587.6 /* helium's yellow line, near sodium's: the wavelength of constant indices */

enum { IOR_TERMS = 4 };

struct ior {
	double n;	/* index at IOR_REFERENCE_NM */
	double cauchy;	/* index n + cauchy (1 / L^2 - 1 / L_d^2) at the wavelength L, with L_d = IOR_REFERENCE_NM */
	int term_count; /* if > 0, n^2 = 1 + sum b L^2 / (L^2 - c) instead */
	double b[IOR_TERMS], c[IOR_TERMS];
};

enum ior_side { IOR_INT, IOR_EXT };

/* Reads the property `name` of n as a constant index: a number in [PARAM_IOR_MIN, PARAM_IOR_MAX] or a material's name,
 * `fallback` if absent. -ENOTSUP if the material is not known. */
int ior_read(const struct scene_node *n, const char *name, double fallback, double *out, struct error *e);

/* Reads the law of one side from int_ior, int_cauchy_b and int_sellmeier, or from the three with ext. With
 * `dispersion`, a name stands for the material's own law. Defaults are Mitsuba's. The resulting index is within
 * [PARAM_IOR_MIN, PARAM_IOR_MAX] at all wavelengths. Returns 0, -EINVAL, -ENOTSUP or -ERANGE. */
int ior_read_law(const struct scene_node *n, enum ior_side side, struct ior *out, struct error *e);
bool ior_has_coefficients(const struct scene_node *n); /* n has coefficients of a law */
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

/* Returns the index inside over the index outside at the wavelength nm; side: by enum ior_side. */
double ior_eta(const struct ior side[2], double nm);

/* Writes the names of the materials with known dispersion into text, for messages; returns text. */
const char *ior_dispersive_names(char *text, size_t size);

#define IOR_BK7_DEFAULT 1.5046	 /* default of int_ior in both Mitsuba dialects */
#define IOR_AIR_DEFAULT 1.000277 /* default of ext_ior in both Mitsuba dialects */

#endif
