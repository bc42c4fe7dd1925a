/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Path tracing of long paths only, in stretches of as many vertices as a sub-path can hold: the last vertices of one
 * stretch are the first of the next, which has its own random numbers. A technique with at most one light vertex looks
 * at the camera's last three vertices, so little else has to be carried over: whether a removed vertex dispersed the
 * light, and vertex 1, because roulette compares with its throughput. Roulette never ends a path that loses no light,
 * so that the energy in a bright mirror room is estimated by many paths of similar weight.
 */
#include "worker/render/path/overlong.h"

#include "worker/render/path/connect.h"
#include "worker/render/path/volume_emission.h"

#include <string.h>

enum { STRETCH_VERTICES = PATH_EDGES_MAX + 1, CARRIED_VERTICES = 3, CARRIED_END = 2 + CARRIED_VERTICES };

/* Sums the paths that end at the camera sub-path's vertices first - 1 ... n - 1. `removed_edges` counts their edges
 * that are no longer in the sub-path. */
static spectrum gather_light(struct path_context *c, unsigned first, unsigned n, unsigned removed_edges,
			     uint32_t min_edges, uint32_t max_edges, double film[2])
{
	spectrum sum = spectrum_constant(0);
	if (EFFECT_IS_ON(c->w, medium_light))
		sum = volume_emission(c, min_edges > removed_edges + first - 1 ? min_edges - removed_edges : first - 1,
				      max_edges - removed_edges, NULL);
	for (unsigned t = first; t <= n; t++)
		for (unsigned j = 0; j <= 1; j++) {
			unsigned edges = removed_edges + t + j - 1;
			if (edges < min_edges || edges > max_edges)
				continue;
			spectrum l = path_connect(c, j, t, 1, film);
			if (path_accept(c, l))
				sum = spectrum_add(sum, l);
		}
	return sum;
}

double overlong_paths_sample_energy(struct path_context *c, uint64_t seed, uint64_t index, uint32_t max_edges,
				    struct path_sample *scratch)
{
	const double roulette = c->max_survival;
	const bool one_way = c->is_unidirectional, opaque = c->joints_are_opaque;
	uint32_t min_edges = c->max_depth + 1 > c->min_depth ? c->max_depth + 1 : c->min_depth;
	unsigned first = 2, removed_edges = 0,
		 max_vertices = max_edges + 1 < STRETCH_VERTICES ? max_edges + 1 : STRETCH_VERTICES;
	double film[2];
	struct sampler_random s;
	c->max_survival = 1;
	c->is_unidirectional = true;
	c->joints_are_opaque = true; /* a passed surface would make the path longer than was asked for */
	sampler_random_init(&s, seed, RNG_OVERLONG_PATH, index, 0);
	unsigned n = path_walk_camera(c, &s.base, max_vertices, film);
	spectrum sum = gather_light(c, first, n, removed_edges, min_edges, max_edges, film);
	for (uint64_t stretch = 1;
	     n == STRETCH_VERTICES && c->camera[n - 1].kind != VERTEX_INFINITE && removed_edges + n - 1 < max_edges;
	     stretch++) {
		for (unsigned i = 1; i + CARRIED_VERTICES < n; i++)
			c->is_dispersed = c->is_dispersed || path_vertex_disperses(&c->camera[i]);
		memmove(&c->camera[CARRIED_END - CARRIED_VERTICES], &c->camera[n - CARRIED_VERTICES],
			CARRIED_VERTICES * sizeof *c->camera);
		removed_edges += n - CARRIED_END;
		sampler_random_init(&s, seed, RNG_OVERLONG_PATH, index, stretch);
		n = path_continue_walk(c, &s.base, SIDE_CAMERA, CARRIED_END, STRETCH_VERTICES);
		sum = spectrum_add(sum, gather_light(c, CARRIED_END + 1, n, removed_edges, min_edges, max_edges, film));
	}
	c->is_dispersed = false;
	c->max_survival = roulette;
	c->is_unidirectional = one_way;
	c->joints_are_opaque = opaque;
	scratch->splat_count = 0;
	scratch->class_mask = 0;
	scratch->intensity = 0;
	path_sample_add_splat(c, scratch, film[0], film[1], sum);
	return scratch->intensity;
}
