/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Homogeneous media that absorb light and do not scatter it: of light that travels a distance d, exp(-sigma_a d) is
 * left. The scene's reader refuses all others (worker/render/scene/absorbing.h). Immutable after creation; any thread.
 */
#ifndef WORKER_RENDER_MEDIUM_MEDIUM_H
#define WORKER_RENDER_MEDIUM_MEDIUM_H

#include "worker/render/texture/color.h"

struct medium {
	struct color sigma_a; /* times per_length: 1 / length */
	double per_length;
};

extern const struct plugin_decl medium_decls[]; /* ends with a NULL type */

/* unit: the scene's unit of length, in that of the distances. The coefficient's table is in the arena. */
int medium_create(struct medium *m, const struct scene_node *n, double unit, struct arena *arena, struct error *e);

/* The share that is left. distance may be INFINITY. */
spectrum medium_transmittance(const struct medium *m, double distance, const struct wavelengths *w);

#endif
