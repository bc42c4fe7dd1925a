/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which emitter a point of the scene is joined to. Where there are several, the chance of each depends on the place: it
 * is higher for those whose light has been seen to arrive nearby. Light sub-paths choose theirs without regard to a
 * place. After Shirley, Wang and Zimmerman 1996 (Monte Carlo Techniques for Direct Lighting Calculations), who store
 * which luminaires matter in cells of space; here the cells follow the points at which camera paths scatter.
 */
#ifndef WORKER_RENDER_WORLD_EMITTER_CHOICE_H
#define WORKER_RENDER_WORLD_EMITTER_CHOICE_H

#include "worker/render/world/world.h"

/* More emitters than this are chosen by their power alone. */
enum { EMITTER_CHOICE_MOST = 4096 };

/* Learns the chances in a finished world, whose accel is there: sets w->emitter_choice, unless one emitter gives all
 * light, and w->emitter_pdf, which until then follows power. Deterministic. -ENOMEM: no memory. */
int emitter_choice_make(struct world *w);

/* What a point is joined to. */
struct emitter_pick {
	int32_t emitter;
	double u[2];   /* by which its point is drawn */
	double denser; /* the density of that point over the one with which the emitter alone draws it */
};

/* Chooses for a point at p by three numbers in [0,1). false: nothing gives light. Pure. */
bool emitter_choice_pick(const struct world *w, vec3 p, const double u[3], struct emitter_pick *out);
/* `denser` for a point y of em, which is the emitter at some time. */
double emitter_choice_denser(const struct world *w, vec3 p, int32_t emitter, const struct emitter *em,
			     const struct emitter_point *y);

#endif
