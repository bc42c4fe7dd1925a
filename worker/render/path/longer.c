/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Path tracing of long paths only, in stretches of as many vertices as a sub-path can hold: the last vertices of one
 * stretch are the first of the next, which has its own random numbers. A technique with at most one light vertex looks
 * at the camera's last three vertices, so little else has to be carried over: whether a removed vertex dispersed the
 * light, and vertex 1, because roulette compares with its throughput. Roulette never ends a path that loses no light,
 * so that the energy in a bright mirror room is estimated by many paths of similar weight.
 */
#include "worker/render/path/longer.h"

#include "worker/render/path/connect.h"
#include "worker/render/path/volume_emission.h"

#include <string.h>

enum { FULL = PATH_MAX_EDGES + 1, CARRIED = 3, CARRIED_END = 2 + CARRIED };

/* Sums the paths that end at the camera sub-path's vertices first - 1 ... n - 1. `before` counts their edges that are
 * no longer in the sub-path. */
static spectrum gather_light(struct path_context *c, unsigned first, unsigned n, unsigned before, uint32_t least,
			     uint32_t most, double film[2])
{
	spectrum sum = spectrum_of(0);
	if (EFFECT_IS_ON(c->w, medium_light))
		sum = volume_emission(c, least > before + first - 1 ? least - before : first - 1, most - before, NULL);
	for (unsigned t = first; t <= n; t++)
		for (unsigned j = 0; j <= 1; j++) {
			unsigned edges = before + t + j - 1;
			if (edges < least || edges > most)
				continue;
			spectrum l = path_connect(c, j, t, 1, film);
			if (path_accept(c, l))
				sum = spectrum_add(sum, l);
		}
	return sum;
}

double longer_paths(struct path_context *c, uint64_t seed, uint64_t index, uint32_t longest,
		    struct path_sample *scratch)
{
	const double roulette = c->roulette;
	const bool one_way = c->one_way, opaque = c->opaque;
	uint32_t least = c->max_depth + 1 > c->min_depth ? c->max_depth + 1 : c->min_depth;
	unsigned first = 2, before = 0, most = longest + 1 < FULL ? longest + 1 : FULL;
	double film[2];
	struct sampler_random s;
	c->roulette = 1;
	c->one_way = true;
	c->opaque = true; /* a passed surface would make the path longer than was asked for */
	sampler_random_init(&s, seed, RNG_BEYOND, index, 0);
	unsigned n = path_walk_camera(c, &s.base, most, film);
	spectrum sum = gather_light(c, first, n, before, least, longest, film);
	for (uint64_t stretch = 1; n == FULL && c->camera[n - 1].kind != VERTEX_INFINITE && before + n - 1 < longest;
	     stretch++) {
		for (unsigned i = 1; i + CARRIED < n; i++)
			c->dispersed = c->dispersed || path_disperses(&c->camera[i]);
		memmove(&c->camera[CARRIED_END - CARRIED], &c->camera[n - CARRIED], CARRIED * sizeof *c->camera);
		before += n - CARRIED_END;
		sampler_random_init(&s, seed, RNG_BEYOND, index, stretch);
		n = path_walk_on(c, &s.base, SIDE_CAMERA, CARRIED_END, FULL);
		sum = spectrum_add(sum, gather_light(c, CARRIED_END + 1, n, before, least, longest, film));
	}
	c->dispersed = false;
	c->roulette = roulette;
	c->one_way = one_way;
	c->opaque = opaque;
	scratch->count = 0;
	scratch->classes = 0;
	scratch->intensity = 0;
	path_splat(c, scratch, film[0], film[1], sum);
	return scratch->intensity;
}
