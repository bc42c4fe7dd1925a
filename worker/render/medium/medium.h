/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Media. Light that travels through one along s keeps exp(-integral of sigma_t ds) of its radiance, the optical depth:
 * sigma_a of sigma_t = sigma_a + sigma_s is absorbed, sigma_s scattered into other directions by a phase function
 * (phase.h). Sigma_t and the share of it that is scattered may vary from place to place (worker/render/volume). Optical
 * depths are exact but for rounding, so that densities of distances are known. Lengths are those of the rescaled world.
 * Immutable after creation; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MEDIUM_MEDIUM_H
#define WORKER_RENDER_MEDIUM_MEDIUM_H

#include "worker/render/medium/emission.h"
#include "worker/render/medium/phase.h"
#include "worker/render/volume/volume.h"

struct medium {
	struct volume first, second; /* sigma_a and sigma_s, or if by_albedo sigma_t and its scattered share */
	bool by_albedo;		     /* otherwise neither varies from place to place */
	bool absorbs, scatters;	     /* false: that coefficient counts as 0; not where `second` varies */
	double forward;		     /* 0.6's `g`: the share of sigma_s that counts as not scattered at all */
	double per_length;	     /* times the coefficients: 1 / length */
	struct phase phase;
	bool shines;
	struct emission emission;
};

extern const struct plugin_decl medium_decls[]; /* ends with a NULL type */

/* The coefficients of 0.6's measured material of that name. reduced: sigma_s is less by the mean cosine, for a phase
 * function that is the same in all directions. -EINVAL: there is none; n is to blame. */
int medium_measured(const struct scene_node *n, const char *name, bool reduced, double sigma_a[3], double sigma_s[3],
		    struct error *e);
int medium_create(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e);

/* Lets it shine by the emitter n. -EINVAL, -ENOTSUP: see emission.h. */
int medium_light(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e);

bool medium_is_coloured(const struct medium *m); /* its coefficients vary with wavelength */

/* Sigma_s at p of light that travels along d, a unit vector, or along -d, without what the phase function absorbs of
 * it. 1 / length */
spectrum medium_scattering(const struct medium *m, vec3 p, vec3 d, const struct wavelengths *w);
spectrum medium_extinction(const struct medium *m, vec3 p, vec3 d, const struct wavelengths *w); /* sigma_t */

/* A medium at some wavelengths, along a direction. */
struct medium_lanes {
	const struct grid *grid; /* NULL: sigma_t[0] everywhere */
	int channels;
	spectrum sigma_t[GRID_CHANNELS_MAX]; /* where that channel of the grid is 1 */
};

struct medium_lanes medium_at(const struct medium *m, vec3 d, const struct wavelengths *w);
/* The optical depth of a part of a ray along d or -d. */
spectrum medium_depth(const struct medium_lanes *m, const struct grid_ray *r);
/* The t at which that reaches `least` at one wavelength, with the depth up to there; INFINITY, with all of it: not
 * before t1. */
double medium_reach(const struct medium_lanes *m, const struct grid_ray *r, int lane, double least, spectrum *depth);

#endif
