/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Participating media. Light that travels through a medium keeps exp(-d) of its radiance, where the optical depth d is
 * the integral of the extinction sigma_t = sigma_a + sigma_s over the length. sigma_a is absorbed; sigma_s is scattered
 * into other directions by a phase function (phase.h). sigma_t and its scattered share may vary in space
 * (worker/render/volume). Optical depths are exact but for rounding, so that densities of distances are known. Lengths
 * are those of the rescaled world. Immutable after creation; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MEDIUM_MEDIUM_H
#define WORKER_RENDER_MEDIUM_MEDIUM_H

#include "worker/render/medium/emission.h"
#include "worker/render/medium/phase.h"
#include "worker/render/volume/volume.h"

struct medium {
	struct volume first, second;	  /* sigma_a and sigma_s; if uses_albedo, sigma_t and albedo */
	bool uses_albedo;		  /* if not, neither volume varies in space */
	bool is_absorbing, is_scattering; /* false: sigma_a or sigma_s is 0; if `second` varies, both are equal */
	double forward_share; /* `g` of 0.6: the share of sigma_s that is neglected, as light that goes straight on */
	double per_length;    /* factor of the coefficients; 1 / length */
	struct phase phase;
	bool is_emissive;
	struct emission emission;
};

extern const struct plugin_decl medium_decls[]; /* ends with a NULL type */

/* Looks up the coefficients of the measured material `name` (measured_media.h) with the scale of Mitsuba 0.6. reduced:
 * multiply sigma_s by one minus the mean cosine, for an isotropic phase function. -EINVAL if there is no such material;
 * the error names n. */
int medium_look_up_measured(const struct scene_node *n, const char *name, bool reduced, double sigma_a[3],
			    double sigma_s[3], struct error *e);
/* Creates the medium of node n. Returns 0 or a negative error code. */
int medium_create(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e);

/* Gives m the emission of the emitter n. Returns 0 or a negative error code: see emission_create(). */
int medium_set_emission(struct medium *m, const struct scene_node *n, const struct volume_build *build,
			struct error *e);

bool medium_is_colored(const struct medium *m); /* whether its coefficients vary with wavelength */

/* Returns sigma_s (1 / length) at p for light that travels along the unit vector d or -d, without the share that the
 * phase function absorbs. */
spectrum medium_scattering(const struct medium *m, vec3 p, vec3 d, const struct wavelengths *w);
spectrum medium_extinction(const struct medium *m, vec3 p, vec3 d, const struct wavelengths *w); /* likewise sigma_t */

/* The extinction of a medium at some wavelengths, along a direction. */
struct medium_lanes {
	const struct grid *grid; /* NULL: sigma_t[0] everywhere */
	int channels;
	spectrum sigma_t[GRID_CHANNELS_MAX]; /* extinction where channel k of the grid is 1, and the others are 0 */
};

struct medium_lanes medium_lanes_along(const struct medium *m, vec3 d, const struct wavelengths *w);
/* Returns the optical depth of a segment of a ray along d or -d. */
spectrum medium_optical_depth(const struct medium_lanes *m, const struct grid_ray *r);
/* Returns the t at which the optical depth at one wavelength, `lane`, reaches `target`, and the depth up to t at all
 * wavelengths. If it does not reach `target` before t1, returns INFINITY and the depth of the whole segment. */
double medium_invert_depth(const struct medium_lanes *m, const struct grid_ray *r, int lane, double target,
			   spectrum *depth);

#endif
