/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The emission of a medium (`volumelight`): over a length ds the radiance grows by `radiance` ds, independently of what
 * the medium absorbs and scatters there. The emission has the extent of the medium: if the extinction is on a grid, the
 * box of that grid. A grid of three channels holds R, G and B, which become a spectrum as those of a texture do.
 * Immutable after creation; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MEDIUM_EMISSION_H
#define WORKER_RENDER_MEDIUM_EMISSION_H

#include "worker/render/volume/volume.h"

struct emission {
	struct volume radiance;
	double per_length; /* factor of the radiance, per length of the rescaled world */
};

/* Creates the emission of emitter n in a medium with the given extinction. Returns 0 or a negative error code: -ENOTSUP
 * in a scene of 0.6, or if the grid of the radiance repeats. */
int emission_create(struct emission *g, const struct scene_node *n, const struct volume *extinction,
		    const struct volume_build *build, struct error *e);

double emission_max(const struct emission *g); /* upper bound over positions and wavelengths; radiance / length */
enum color_kind emission_color_kind(const struct emission *g);

/* Returns the emission (radiance / length) of a radiance without a grid, which is the same everywhere. */
spectrum emission_constant(const struct emission *g, const struct wavelengths *w);

/* Samples a position *t on a segment of a ray for u in [0,1), in proportion to the emission. *l: the radiance per
 * length there over the density per length. Returns false if the segment emits nothing or is infinite. */
bool emission_sample(const struct emission *g, const struct grid_ray *r, double u, const struct wavelengths *w,
		     double *t, spectrum *l);

#endif
