/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/starts.h"

#include "worker/render/halfvec/refract.h"

#include <assert.h>
#include <stdlib.h>

void starts_init_context(struct path_context *c, const struct world *w, unsigned min_depth, unsigned max_depth,
			 uint64_t *counters)
{
	assert(max_depth <= STARTS_EDGES_MAX);
	*c = (struct path_context){.w = w,
				   .window = {0, 0, 32, 32},
				   .min_depth = min_depth,
				   .max_depth = max_depth,
				   .counters = counters,
				   .refract = halfvec_refract};
}

static void walk_subpaths(struct starts *s, uint64_t index, unsigned *camera, unsigned *light)
{
	struct sampler_random r;
	double film[2];
	struct path_context *c = s->c;
	sampler_random_init(&r, s->seed, RNG_BOOTSTRAP, index, 0);
	c->is_unidirectional = false;
	*camera = path_walk_camera(c, &r.base, c->max_depth + 1, film);
	*light = path_walk_light(c, &r.base, c->max_depth);
}

static double technique_contribution(struct path_context *c, unsigned s, unsigned edges, unsigned camera,
				     unsigned light)
{
	unsigned t = edges + 1 - s;
	if (t > camera || s > (light > 1 ? light : 1) || (t == 1 && s < 2))
		return 0;
	double film[2];
	struct path_sample sample = {.splat_count = 0, .intensity = 0};
	spectrum l = path_connect(c, s, t, PATH_EDGES_MAX, film);
	if (!spectrum_is_zero(l))
		path_sample_add_splat(c, &sample, 0, 0, l);
	return sample.intensity;
}

static void add_start(struct starts *s, uint64_t index, unsigned technique, unsigned joined_edges, double intensity)
{
	unsigned passed = s->c->passed_count, edges = joined_edges + passed;
	size_t n = s->by_edges[edges].count++;
	if (n == s->by_edges[edges].capacity) {
		s->by_edges[edges].capacity = 2 * n + 64;
		s->by_edges[edges].items = realloc(s->by_edges[edges].items,
						   s->by_edges[edges].capacity * sizeof *s->by_edges[edges].items);
		assert(s->by_edges[edges].items);
	}
	s->by_edges[edges].items[n] = (struct start){index, technique, passed,
						     intensity + (n ? s->by_edges[edges].items[n - 1].cumulative : 0)};
}

void starts_init(struct starts *s, struct path_context *c, uint64_t seed, uint64_t group, uint64_t pairs)
{
	*s = (struct starts){.c = c, .seed = seed, .pairs = pairs};
	for (uint64_t i = group * pairs; i < (group + 1) * pairs; i++) {
		unsigned camera, light;
		walk_subpaths(s, i, &camera, &light);
		for (unsigned edges = c->min_depth; edges <= c->max_depth; edges++)
			for (unsigned j = 0; j <= edges; j++) {
				double f = technique_contribution(c, j, edges, camera, light);
				if (f > 0)
					add_start(s, i, j, edges, f);
			}
	}
}

void starts_fini(struct starts *s)
{
	for (unsigned i = 0; i <= STARTS_EDGES_MAX; i++)
		free(s->by_edges[i].items);
}

double starts_contribution(const struct starts *s, unsigned edges)
{
	size_t n = s->by_edges[edges].count;
	return n ? s->by_edges[edges].items[n - 1].cumulative / (double)s->pairs : 0;
}

bool starts_make_path(struct starts *s, unsigned edges, double u, struct full_path *x)
{
	size_t n = s->by_edges[edges].count, low = 0;
	if (n == 0)
		return false;
	double target = u * s->by_edges[edges].items[n - 1].cumulative;
	for (size_t high = n - 1; low < high;) {
		size_t middle = (low + high) / 2;
		if (s->by_edges[edges].items[middle].cumulative > target)
			high = middle;
		else
			low = middle + 1;
	}
	unsigned camera, light;
	const struct start *chosen = &s->by_edges[edges].items[low];
	walk_subpaths(s, chosen->index, &camera, &light);
	return full_path_from_subpaths(s->c, chosen->technique, chosen->passed_count, edges, x);
}
