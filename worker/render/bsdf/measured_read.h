/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A material of the RGL database (Dupuy and Jakob 2018, An Adaptive Parameterization for Efficient Material Acquisition
 * and Rendering), read from its file. Immutable after reading; any thread.
 */
#ifndef WORKER_RENDER_BSDF_MEASURED_READ_H
#define WORKER_RENDER_BSDF_MEASURED_READ_H

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/warp_table.h"

/* A function over the unit square, bilinear between the nodes of a grid. */
struct measured_plane {
	uint32_t width, height;
	const double *value;
};

struct measured_material {
	bool is_isotropic;    /* azimuths of half vectors are relative to that of the camera */
	bool has_microfacets; /* colours have to be multiplied by D(h) / (4 sigma(wo)): `normal_density` and
				 `projected_area` below */
	int symmetry; /* if anisotropic: the file covers 1 / symmetry of the circle of azimuths, with 1, 2 or 4 */
	struct warp_axes axes;		   /* azimuth and polar angle of the direction to the camera */
	struct warp_table visible_normals; /* density of half vectors visible from there, in the square of measured.c */
	struct warp_table luminance;	   /* mean of S over wavelengths, by the numbers that `visible_normals` warps */
	struct measured_plane normal_density;	   /* D, the density of microfacet normals, by half vector */
	struct measured_plane projected_area;	   /* sigma, the projected area of the microfacets, by direction */
	uint32_t nodes_per_side, wavelength_count; /* nodes_per_side: of the table of colours */
	const double *nm;			   /* ascending; NULL: the file has rgb only */
	const float *spectra; /* `wavelength_count` values for each slice and node of `luminance`; NULL if nm is NULL */
	const float *rgb;     /* three values for each slice and node: linear Rec. 709 under D65 */
};

/* Reads the file that n names. Returns 0, -ENOENT, -EINVAL, -ENOTSUP or -ENOMEM. */
int measured_material_read(struct measured_material *m, const struct scene_node *n, const struct bsdf_build *build,
			   struct error *e);

/* Returns the roughness of the Beckmann distribution whose density has the same maximum; INFINITY if there are no
 * normals. */
double measured_material_alpha(const struct measured_material *m);

#endif
