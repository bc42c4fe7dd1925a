/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chooses the emitter to which a point of the scene is joined. If there are several, their probabilities depend on
 * the point: they are higher for emitters whose light was seen to arrive nearby. Light sub-paths choose their
 * emitters independently of any point. After Shirley, Wang and Zimmerman 1996 (Monte Carlo Techniques for Direct
 * Lighting Calculations), who store which luminaires matter in cells of space; here the cells follow the points at
 * which camera paths scatter.
 */
#ifndef WORKER_RENDER_WORLD_EMITTER_CHOICE_H
#define WORKER_RENDER_WORLD_EMITTER_CHOICE_H

#include "worker/render/world/world.h"

/* If there are more emitters than this, they are chosen by their power alone. */
enum { EMITTER_CHOICE_EMITTERS_MAX = 4096 };

/* Estimates the probabilities in a finished world with its accel: sets w->emitter_choice, unless one emitter gives all
 * the light, and w->emitter_pdf, which until then follows power. Deterministic. Returns -ENOMEM if out of memory. */
int emitter_choice_make(struct world *w);

/* The choice made for a point. */
struct emitter_pick {
	int32_t emitter;
	double u[2]; /* the numbers from which a point on the emitter is drawn */
	/* The density of that point divided by the density with which the emitter alone draws it. */
	double density_ratio;
};

/* Chooses an emitter for a point at p from three numbers in [0,1). Returns false if nothing emits. Pure. */
bool emitter_choice_pick(const struct world *w, vec3 p, const double u[3], struct emitter_pick *out);
/* Returns emitter_pick.density_ratio for a point y of em, which is the emitter at some time. */
double emitter_choice_density_ratio(const struct world *w, vec3 p, int32_t emitter, const struct emitter *em,
				    const struct emitter_point *y);

#endif
