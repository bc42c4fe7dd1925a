/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Low-discrepancy samples: Owen-scrambled Sobol' points (Owen 1995; scrambled by hashing as in Burley 2020). There is
 * one sequence for each (seed, stream, index, replicate); `sample` selects a point of it. Any prefix of 2^m points is
 * stratified in all elementary intervals of each half of a block: one point in each interval of the first two numbers,
 * 2 in each of the first three, 8 in each of all four (a (t,m,s)-net with t = 0, 1, 3 in s = 2, 3, 4 dimensions). The
 * same holds for the points k 2^m .. (k+1) 2^m - 1.
 *
 * A half of a block uses the first four Sobol' dimensions, with a scramble and a shuffle of the samples' order of its
 * own (padding): halves are independent of each other, and a path of any length needs no more dimensions. Replicates,
 * indices, streams and seeds are independent, too: a sequence's 256-bit key comes from the counter-based generator, and
 * the seeds of a half are hashes of the key and the half's index. Each number alone is uniform in [0,1), a multiple of
 * 2^-48; means have the same expectation as those of independent samples.
 *
 * Fixed size, one thread, nothing allocates. Samples are numbered from 0; after 2^32 of them a new scramble begins.
 */
#ifndef WORKER_RENDER_PATH_SOBOL_H
#define WORKER_RENDER_PATH_SOBOL_H

#include "worker/render/path/sampler.h"

struct sampler_sobol {
	struct sampler base;
	uint64_t sample, key[4];
	uint32_t reversed_sample; /* bits of `sample` in reversed order */
	double values[SAMPLER_SIDES][SAMPLER_BLOCK_SIZE];
};

/* index: for example the pixel; replicate: for example the group of samples. */
void sampler_sobol_init(struct sampler_sobol *s, uint64_t seed, enum rng_stream stream, uint64_t index,
			uint64_t replicate, uint64_t sample);

/* Computes the numbers of one block into s->values[side] and returns them. For samplers that are built on this one. */
double *sampler_sobol_fill(struct sampler_sobol *s, enum sampler_side side, unsigned vertex);

#endif
