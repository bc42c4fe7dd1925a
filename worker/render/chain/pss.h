/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Primary sample space (Kelemen, Szirmay-Kalos, Antal, Csonka 2002): a chain's state consists of the random numbers of
 * a path, block by block. Numbers that the current path does not use are not kept: given the used numbers they are
 * uniform, so drawing them afresh when a proposal asks for them is a Gibbs step that leaves the target invariant. Fixed
 * size; nothing allocates.
 */
#ifndef WORKER_RENDER_CHAIN_PSS_H
#define WORKER_RENDER_CHAIN_PSS_H

#include "worker/render/path/sampler.h"

#include <stddef.h>

enum {
	PSS_EDGES_MAX = 32,		      /* most edges of a path in a state */
	PSS_VERTICES_MAX = PSS_EDGES_MAX + 1, /* most vertices of one side */
};

struct pss_point {
	unsigned block_count[SAMPLER_SIDES];
	double u[SAMPLER_SIDES][PSS_VERTICES_MAX][SAMPLER_BLOCK_SIZE];
};

/* The source of a proposal's numbers: all fresh from (stream, index, step), or the numbers of
 * `origin` moved by small steps. */
struct pss_sampler {
	struct sampler base;
	struct pss_point *point;	/* filled as the path asks for numbers */
	const struct pss_point *origin; /* NULL: a large step */
	uint64_t seed, index, step;
	enum rng_stream stream;
};

void pss_sampler_init(struct pss_sampler *s, struct pss_point *point, const struct pss_point *origin, uint64_t seed,
		      enum rng_stream stream, uint64_t index, uint64_t step);

/* Returns u after a symmetric small step with wrap-around; r in [0,1). */
double pss_small_step(double u, double r);

/* Draws the numbers for the chain's own choices at a step: large or small, accept or not. */
enum { PSS_CHOOSE_LARGE = 0, PSS_ACCEPT = 1 };
void pss_draw_choices(uint64_t seed, uint64_t chain, uint64_t step, double out[SAMPLER_BLOCK_SIZE]);

/* Convert the point to bytes (little endian) and back. Return the number of bytes, or 0 if they do not
 * fit or cannot be parsed. */
size_t pss_write(const struct pss_point *p, uint8_t *bytes, size_t capacity);
size_t pss_read(struct pss_point *p, const uint8_t *bytes, size_t size);

#endif
