/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The source of a path's random numbers. Each vertex of each sub-path owns a block of eight numbers in [0,1), so
 * that a choice keeps its number when an earlier vertex changes (Kelemen et al. 2002 mutate exactly these
 * numbers). Asking twice for the same block gives the same numbers. A returned pointer stays valid until the
 * next call for the same side.
 */
#ifndef WORKER_RENDER_PATH_SAMPLER_H
#define WORKER_RENDER_PATH_SAMPLER_H

#include "worker/render/math/rng.h"

enum sampler_side { SIDE_CAMERA, SIDE_LIGHT, SAMPLER_SIDES };
enum { SAMPLER_BLOCK_SIZE = 8 };

/* The uses of the numbers in a block. Block 0 of the camera: film x and y, wavelength, distance to the first event in a
 * medium, point of the aperture, whether there is a light sub-path (path_context.light_subpath_interval), and which
 * faint connections are made (path_context.faint_threshold). Block 0 of the light: point, direction and choice of the
 * emitter, and the time of both sub-paths. All other blocks: one vertex, including the distance to the next vertex
 * where media scatter. Block e - 1 of the light also holds the position on edge e of the camera's sub-path at which the
 * emission of media is evaluated. Numbers that are used together lie in the same half of the block: low-discrepancy
 * samplers (sobol.h) stratify the four numbers of a half jointly. */
enum { DIM_FILM_X = 0, DIM_FILM_Y = 1, DIM_WAVELENGTH = 2, DIM_CAMERA_DISTANCE = 3 };
enum { DIM_APERTURE_U = 4, DIM_APERTURE_V = 5, DIM_LIGHT_SUBPATH = 6, DIM_FAINT_CONNECTION = 7 };
enum { DIM_EMITTER_POINT = 0, DIM_EMITTER_DIRECTION = 2, DIM_EMITTER_CHOICE = 4, DIM_TIME = 5, DIM_EMISSION = 6 };
enum { DIM_BSDF = 0, DIM_ROULETTE = 3, DIM_NEXT_EVENT = 4, DIM_DISTANCE = 7 };

struct sampler {
	const double *(*block)(struct sampler *s, enum sampler_side side, unsigned vertex);
};

struct sampler_random {
	struct sampler base;
	uint64_t seed, index, step;
	enum rng_stream stream;
	double values[SAMPLER_SIDES][SAMPLER_BLOCK_SIZE];
};

void sampler_random_init(struct sampler_random *s, uint64_t seed, enum rng_stream stream, uint64_t index,
			 uint64_t step);

/* Returns the index of a block's first half among all halves of a sample; the second half has the next index. */
static inline uint64_t sampler_half_index(enum sampler_side side, unsigned vertex)
{
	return ((uint64_t)vertex * SAMPLER_SIDES + (uint64_t)side) * 2;
}

/* Fills `out` with the eight numbers of one block, from the counter-based generator. */
void sampler_fill_block(uint64_t seed, enum rng_stream stream, uint64_t index, uint64_t step, enum sampler_side side,
			unsigned vertex, double out[SAMPLER_BLOCK_SIZE]);

#endif
