/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The rough boundary of a clear coating seen from outside, shared by `roughplastic` and `roughcoating`. It reflects
 * like that of `roughdielectric` (Walter et al. 2007, eq. 20). Its transmittance, one minus the share of light that it
 * reflects to the same side, is tabulated over the cosine, and over the roughness if that comes from a texture. This
 * takes 5 ms per roughness when the material is created. Equal boundaries of a scene share a table. The roughness is
 * isotropic. Private to worker/render/bsdf.
 */
#ifndef WORKER_RENDER_BSDF_ROUGH_BOUNDARY_H
#define WORKER_RENDER_BSDF_ROUGH_BOUNDARY_H

#include "worker/render/bsdf/rough_map.h"

enum { BOUNDARY_NODES = 48, BOUNDARY_ROWS = 12 };

struct boundary_row {
	double transmittance[BOUNDARY_NODES]; /* of light from outside, at the cosines (i / (BOUNDARY_NODES - 1))^2 */
	double escape; /* twice the integral of that transmittance times the cosine, over the cosine */
};

struct boundary_table {
	bool is_ggx;
	double eta;		    /* index below over index above */
	double min_alpha, log_step; /* row i has the roughness min_alpha * exp(i * log_step) */
	int row_count;
	struct boundary_row *row;
	struct boundary_table *next; /* the next table of the scene */
};

struct rough_boundary {
	struct rough_map roughness;
	const struct boundary_table *table;
};

/* The boundary at a point of the surface. */
struct boundary_point {
	const struct boundary_table *table;
	struct microfacet facets;
	int row;
	double row_fraction; /* fraction towards the next row */
};

/* Reads alpha, alpha_u, alpha_v and distribution; sets b's texture flags and roughness. -ENOTSUP if the roughness is
 * anisotropic; -ENOMEM. */
int rough_boundary_read(struct rough_boundary *r, double eta, struct bsdf *b, const struct scene_node *n,
			const struct bsdf_build *build, struct error *e);
#define ROUGH_BOUNDARY_PARAMS                                                                                  \
	ROUGH_MAP_NUMBER("alpha"), {.name = "alpha_u", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 10}, \
		{.name = "alpha_v", .types = VALUE_FLOAT | VALUE_INT, .min = 0, .max = 10},                    \
		{.name = "distribution", .types = VALUE_STRING, .choices = "beckmann|ggx"},                    \
	{                                                                                                      \
		.name = "sample_visible", .types = VALUE_BOOL, .status = PARAM_IGNORED                         \
	}

struct boundary_point rough_boundary_at(const struct rough_boundary *r, const struct bsdf_point *p);
/* Returns the share of light from outside, at this cosine, that the boundary transmits. */
double rough_boundary_transmittance(const struct boundary_point *point, double cosine);
/* Returns the share of diffuse light from inside that leaves, times eta^2. */
double rough_boundary_escape(const struct boundary_point *point);

/* Calls microfacet_reflect() with the facets and the index of this boundary. */
double rough_boundary_reflect(const struct boundary_point *point, vec3 wo, vec3 wi, double *pdf);

#endif
