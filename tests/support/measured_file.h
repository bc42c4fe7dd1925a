/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Synthetic files of measured materials (.bsdf): GGX facets with Schlick's Fresnel reflectance, measured_file_tint(nm)
 * at normal incidence, computed by independent formulas and an independent warp (bisection). One thread.
 */
#ifndef TESTS_SUPPORT_MEASURED_FILE_H
#define TESTS_SUPPORT_MEASURED_FILE_H

#include "tests/support/memory_assets.h"
#include "worker/render/math/vec3.h"

#include <stdbool.h>

struct measured_file_material {
	const char *name;
	double alpha_u, alpha_v;
	double rotation; /* rotation of the axes to which alpha_u and alpha_v refer; 0 if symmetry is 4 */
	int azimuths;	 /* 1: isotropic */
	int symmetry;	 /* 1, 2 or 4: the azimuths span the circle, half or a quarter of it */
	int elevations;	 /* number of elevations from 0 to MEASURED_THETA_MAX, with evenly spaced square roots */
	int normal_nodes, color_nodes; /* nodes of the tables of normals, and of those of colours */
	bool is_rgb;		       /* three channels: the tint at 600, 550 and 450 nm */
	bool is_absolute; /* the colours are the whole reflectance, without a factor for the facets' density */
	bool is_white;	  /* reflects everything */
};
#define MEASURED_THETA_MAX 1.5

double measured_file_tint(double nm);
double measured_file_theta(const struct measured_file_material *k, int i);

/* Returns f wi.z for light from wi, by the formula. */
double measured_file_reflected(const struct measured_file_material *k, double tint, vec3 wo, vec3 wi);

/* Returns the material's file, of *size bytes; the caller frees it. */
unsigned char *measured_file_make(const struct measured_file_material *k, size_t *size);

/* Returns small files for the generic tests: isotropic.bsdf, anisotropic.bsdf, rgb.bsdf, polarized.pbsdf. Made once. */
const struct memory_file *measured_file_all(void);

#endif
