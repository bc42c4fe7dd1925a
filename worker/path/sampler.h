/*
 * Where a path's random choices come from. Each vertex of each sub-path owns a block of eight numbers in [0,1), so that a
 * choice keeps its number when an earlier vertex changes (Kelemen et al. 2002 mutate exactly these numbers).
 * Asking twice for the same block gives the same numbers. A pointer stays valid until the next call for the same side.
 */
#ifndef WORKER_PATH_SAMPLER_H
#define WORKER_PATH_SAMPLER_H

#include "worker/math/rng.h"

enum sampler_side { SIDE_CAMERA, SIDE_LIGHT, SAMPLER_SIDES };
enum { SAMPLER_BLOCK = 8 };

/* What the numbers of a block are for. Block 0 of the camera: film x, y, wavelength, point of the aperture. Block 0 of the
 * light: point, direction and choice of the emitter. All others: a vertex. */
enum { DIM_FILM_X = 0, DIM_FILM_Y = 1, DIM_WAVELENGTH = 2, DIM_APERTURE_U = 3, DIM_APERTURE_V = 4 };
enum { DIM_EMITTER_POINT = 0, DIM_EMITTER_DIRECTION = 2, DIM_EMITTER_CHOICE = 4 };
enum { DIM_BSDF = 0, DIM_NEXT_EVENT = 3, DIM_ROULETTE = 6 };

struct sampler {
	const double *(*block)(struct sampler *s, enum sampler_side side, unsigned vertex);
};

struct sampler_random {
	struct sampler base;
	uint64_t seed, index, step;
	enum rng_stream stream;
	double value[SAMPLER_SIDES][SAMPLER_BLOCK];
};

void sampler_random_init(struct sampler_random *s, uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step);

/* The eight numbers of one block from the counter-based generator. */
void sampler_fill(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, enum sampler_side side,
		  unsigned vertex, double out[SAMPLER_BLOCK]);

#endif
