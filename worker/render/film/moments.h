/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Where the chains of one lease spend their time: within-chain moments by tile, and the time spent in each path class
 * (struct batch in common/film/batch.h defines both). A state is added when it is splatted, with its accumulated
 * weight. One thread. Memory: 36 bytes per tile; allocates nothing after init.
 */
#ifndef WORKER_RENDER_FILM_MOMENTS_H
#define WORKER_RENDER_FILM_MOMENTS_H

#include "worker/render/path/path.h"

struct chain_moments {
	uint32_t x, y, width, height;	      /* the crop */
	uint32_t tiles_x, tile_count;	      /* 0 tiles: moments are not wanted, and nothing is stored */
	double *first_moment, *second_moment; /* by tile; `first_moment` is that of the current sequence */
	double *share;			      /* share of the current state in each tile; 0 between states */
	uint32_t *touched_tiles;	      /* the tiles where `share` is not 0 */
	double class_weight[PATH_CLASSES];
};

int chain_moments_init(struct chain_moments *m, const struct plan *p, struct error *e);
void chain_moments_fini(struct chain_moments *m);

/* Adds the weight of a state with these film points and colours, whose total intensity is I = X+Y+Z.
 * chain_moments_add_class adds to a class: the state's share of I in that class, times the weight. */
void chain_moments_add_state(struct chain_moments *m, const struct splat *splats, uint32_t count, double intensity,
			     double weight);
static inline void chain_moments_add_class(struct chain_moments *m, unsigned path_class, double weight)
{
	m->class_weight[path_class] += weight;
}

/* Ends a sequence: writes its first moments, rounded to float, and starts the next one. */
void chain_moments_end_sequence(struct chain_moments *m, float *first);
/* Ends the lease: writes the second moments and the classes. */
void chain_moments_end_lease(const struct chain_moments *m, float *second, double classes[PATH_CLASSES]);

#endif
