/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of measured materials (.bsdf) that were not measured: GGX facets whose Fresnel reflectance is Schlick's, of
 * measured_tint(nm) at normal incidence, by formulas and a warp of their own (bisection). One thread.
 */
#ifndef TESTS_SUPPORT_MEASURED_FILE_H
#define TESTS_SUPPORT_MEASURED_FILE_H

#include "tests/support/memory_assets.h"
#include "worker/render/math/vec3.h"

#include <stdbool.h>

struct measured_kind {
	const char *name;
	double alpha_u, alpha_v;
	double turn;	/* of the axes that these are along; 0 where symmetry is 4 */
	int azimuths;	/* 1: isotropic */
	int symmetry;	/* 1, 2 or 4: the azimuths span the circle, or a part of it */
	int elevations; /* from 0 to MEASURED_THETA_MAX, their squares roots evenly */
	int fine, side; /* nodes of the tables of normals, and of those of colours */
	bool rgb;	/* three channels: the tint at 600, 550 and 450 nm */
	bool absolute;	/* the colours are all there is, without the facets' density */
	bool white;	/* reflects everything */
};
#define MEASURED_THETA_MAX 1.5

double measured_tint(double nm);
double measured_kind_theta(const struct measured_kind *k, int i);

/* f wi.z of light from wi, by the formula. */
double measured_kind_reflected(const struct measured_kind *k, double tint, vec3 wo, vec3 wi);

/* Its file, of *size bytes; the caller frees it. */
unsigned char *measured_file_make(const struct measured_kind *k, size_t *size);

/* Small files for the generic tests: isotropic.bsdf, anisotropic.bsdf, rgb.bsdf, polarized.pbsdf. Made once. */
const struct memory_file *measured_files(void);

#endif
