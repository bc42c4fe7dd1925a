/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Points spread over the surfaces that refract light exactly, ranked by the optical length of the path
 * through each point from a lamp (Fermat's principle). The best ones are initial guesses for refracted
 * connections (path/refracted.h).
 */
#ifndef WORKER_RENDER_WORLD_REFRACTING_H
#define WORKER_RENDER_WORLD_REFRACTING_H

#include "worker/render/math/vec3.h"

#include <stdbool.h>
#include <stdint.h>

struct world;

struct refracting_point {
	vec3 p, n;  /* n: unit normal, on the side of the smaller refractive index */
	double eta; /* refractive index behind the surface divided by that in front of it; above 1 */
};

/* Sets w->refracting_points and their count. Their density is proportional to area; moving shapes are taken halfway
 * through the exposure. Curves have none. Deterministic. Returns -ENOMEM if out of memory. */
int refracting_points_make(struct world *w);

/* The origin of light: a point, or, if it is infinitely far away, the unit direction towards it. */
struct refracting_light {
	vec3 position;
	bool is_infinite;
};

/* Finds the points through which light from `light` has the shortest optical path to z, the shortest first. Returns
 * their number: 0 unless z lies in the denser medium behind the point that is nearest to it. Pure. */
enum { REFRACTING_POINTS_RANKED = 2 };
uint32_t refracting_points_rank(const struct world *w, vec3 z, const struct refracting_light *light,
				const struct refracting_point *out[REFRACTING_POINTS_RANKED]);

#endif
