/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A material of the RGL database (Dupuy and Jakob 2018, An Adaptive Parameterization for Efficient Material Acquisition
 * and Rendering), from its file. Immutable afterwards; any thread.
 */
#ifndef WORKER_RENDER_BSDF_MEASURED_READ_H
#define WORKER_RENDER_BSDF_MEASURED_READ_H

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/warp_table.h"

/* Numbers over the unit square, bilinear between the nodes of a grid. */
struct measured_plane {
	uint32_t width, height;
	const double *value;
};

struct measured {
	bool isotropic;	  /* azimuths of half vectors are relative to that of the direction */
	bool microfacets; /* colours are relative to a microfacet model without shadows of normals and areas below */
	int symmetry;	  /* of anisotropic ones: how many equal parts the circle of azimuths has: 1, 2 or 4 */
	struct warp_axes axes;	       /* azimuth and polar angle of the direction to the camera */
	struct warp_table visible;     /* half vectors seen from there, in the square of measured_place */
	struct warp_table luminance;   /* what comes from there, by the numbers that `visible` takes to half vectors */
	struct measured_plane normals; /* density of microfacets, by half vector */
	struct measured_plane area;    /* that they show in a direction, by direction */
	uint32_t side, count;	       /* of the table of colours; wavelengths */
	const double *nm;	       /* ascending; NULL: the file has rgb only */
	const float *spectrum;	       /* by slice and node as in `luminance`, `count` each; NULL without nm */
	const float *rgb;	       /* the same, three each: linear Rec. 709 under D65 */
};

/* The file that n names. -ENOENT, -EINVAL, -ENOTSUP, -ENOMEM. */
int measured_read(struct measured *m, const struct scene_node *n, const struct bsdf_build *build, struct error *e);

/* The roughness of Beckmann facets with the same share of normals at the maximum. */
double measured_alpha(const struct measured *m);

#endif
