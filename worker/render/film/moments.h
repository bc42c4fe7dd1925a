/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Where the chains of one lease spend their time: within-chain moments by tile, and the time of each path class (struct
 * batch in common/film/batch.h defines both). A state is added when it is splatted, with the weight that it has
 * gathered. One thread. Memory: 36 bytes per tile; allocates nothing after init.
 */
#ifndef WORKER_RENDER_FILM_MOMENTS_H
#define WORKER_RENDER_FILM_MOMENTS_H

#include "worker/render/path/path.h"

struct chain_moments {
	uint32_t x, y, width, height; /* the crop */
	uint32_t tiles_x, tiles;      /* 0 tiles: not wanted, nothing is stored */
	double *first, *second;	      /* by tile; first: of the current sequence */
	double *share;		      /* by tile, of the current state; 0 between states */
	uint32_t *touched;	      /* tiles with a share */
	double classes[PATH_CLASSES];
};

int chain_moments_init(struct chain_moments *m, const struct plan *p, struct error *e);
void chain_moments_fini(struct chain_moments *m);

/* Adds the weight of a state with these film points and colours, of intensity I = X+Y+Z in total.
 * chain_moments_class adds its classes: the state's share of I in each. */
void chain_moments_state(struct chain_moments *m, const struct splat *splats, uint32_t count, double intensity,
			 double weight);
static inline void chain_moments_class(struct chain_moments *m, unsigned path_class, double weight)
{
	m->classes[path_class] += weight;
}

/* The sequence has ended: its first moments, rounded to float; the next one starts. */
void chain_moments_end_sequence(struct chain_moments *m, float *first);
/* The lease has ended. */
void chain_moments_end(const struct chain_moments *m, float *second, double classes[PATH_CLASSES]);

#endif
