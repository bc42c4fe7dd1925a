/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Points spread over the surfaces that refract light exactly, and which of them light would pass soonest on its way
 * from a lamp (Fermat's principle). They are first guesses for refracted connections (path/refracted.h).
 */
#ifndef WORKER_RENDER_WORLD_REFRACTING_H
#define WORKER_RENDER_WORLD_REFRACTING_H

#include "worker/render/math/vec3.h"

#include <stdbool.h>
#include <stdint.h>

struct world;

struct refracting_point {
	vec3 p, n;  /* n: unit, towards the thinner medium */
	double eta; /* the index behind it over the one in front of it, above 1 */
};

/* Sets w->refracting_point and its count: in proportion to areas, where shapes are half-way through the exposure.
 * Curves have none. Deterministic. -ENOMEM: no memory. */
int refracting_points_make(struct world *w);

/* Where light comes from: a point, or, if it is infinitely far away, a unit direction towards it. */
struct refracting_end {
	vec3 at;
	bool infinite;
};

/* The points by which light from `from` would arrive at z soonest, the soonest first. Returns how many there are: none
 * unless z lies in the denser medium behind the point that is nearest to it. Pure. */
enum { REFRACTING_RANKED = 2 };
uint32_t refracting_points_rank(const struct world *w, vec3 z, const struct refracting_end *from,
				const struct refracting_point *out[REFRACTING_RANKED]);

#endif
