/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Primary sample space (Kelemen, Szirmay-Kalos, Antal, Csonka 2002): a chain's state is the random numbers of a path,
 * block by block. Numbers that the current path does not use are not kept: given the ones it uses they are uniform, so
 * drawing them afresh when a proposal asks for them is a Gibbs step that leaves the target as it is. Fixed size;
 * nothing allocates.
 */
#ifndef WORKER_RENDER_CHAIN_PSS_H
#define WORKER_RENDER_CHAIN_PSS_H

#include "worker/render/path/sampler.h"

#include <stddef.h>

enum {
	PSS_MAX_EDGES = 32,		      /* of a path that a state holds */
	PSS_MAX_VERTICES = PSS_MAX_EDGES + 1, /* of one side */
};

struct pss_point {
	unsigned used[SAMPLER_SIDES]; /* blocks */
	double u[SAMPLER_SIDES][PSS_MAX_VERTICES][SAMPLER_BLOCK];
};

/* Where a proposal's numbers come from: all fresh from (stream, index, step), or the base's moved by small steps. */
struct pss_sampler {
	struct sampler base;
	struct pss_point *point;      /* filled as the path asks */
	const struct pss_point *from; /* NULL: a large step */
	uint64_t seed, index, step;
	enum rng_stream stream;
};

void pss_sampler_init(struct pss_sampler *s, struct pss_point *point, const struct pss_point *from, uint64_t seed,
		      enum rng_stream stream, uint64_t index, uint64_t step);

/* The symmetric small step of one number, wrapping round; r in [0,1). */
double pss_small_step(double u, double r);

/* Choices of the chain itself at a step: large or small, accept or not. */
enum { PSS_CHOOSE_LARGE = 0, PSS_ACCEPT = 1 };
void pss_choices(uint64_t seed, uint64_t chain, uint64_t step, double out[SAMPLER_BLOCK]);

/* The point as bytes (little endian) and back. Size of the bytes, or 0 when they do not fit or do not parse. */
size_t pss_write(const struct pss_point *p, uint8_t *bytes, size_t room);
size_t pss_read(struct pss_point *p, const uint8_t *bytes, size_t size);

#endif
