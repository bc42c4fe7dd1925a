/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The emission of a medium, by `volumelight`: over a length ds the radiance grows by `radiance` ds, whatever the medium
 * absorbs and scatters there. It reaches as far as the medium does: if the extinction is on a grid, to the end of that
 * grid's box. A grid of three channels holds R, G and B, which become a spectrum as those of a texture do. Immutable
 * after creation; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MEDIUM_EMISSION_H
#define WORKER_RENDER_MEDIUM_EMISSION_H

#include "worker/render/volume/volume.h"

struct emission {
	struct volume radiance;
	double per_length; /* times the radiance, of the rescaled world */
};

/* Makes the emission of emitter n in a medium of that extinction. -ENOTSUP: a scene of 0.6, or a grid that repeats. */
int emission_create(struct emission *g, const struct scene_node *n, const struct volume *extinction,
		    const struct volume_build *build, struct error *e);

double emission_max(const struct emission *g); /* upper bound over places and wavelengths; radiance / length */
enum color_shape emission_shape(const struct emission *g);

/* The same everywhere: radiance / length. Only where the radiance has no grid. */
spectrum emission_even(const struct emission *g, const struct wavelengths *w);

/* Draws a place on a part of a ray for u in [0,1), where there is more light with higher density. *l: the radiance per
 * length there over the density per length. false: nothing shines on that part, or it has no end. */
bool emission_sample(const struct emission *g, const struct grid_ray *r, double u, const struct wavelengths *w,
		     double *t, spectrum *l);

#endif
