/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/starts.h"

#include "worker/render/halfvec/refract.h"

#include <assert.h>
#include <stdlib.h>

void starts_context(struct path_context *c, const struct world *w, unsigned min_depth, unsigned max_depth,
		    uint64_t *counters)
{
	assert(max_depth <= STARTS_MAX_EDGES);
	*c = (struct path_context){.w = w,
				   .window = {0, 0, 32, 32},
				   .min_depth = min_depth,
				   .max_depth = max_depth,
				   .counters = counters,
				   .refract = halfvec_refract};
}

static void walk_both(struct starts *s, uint64_t index, unsigned *camera, unsigned *light)
{
	struct sampler_random r;
	double film[2];
	struct path_context *c = s->c;
	sampler_random_init(&r, s->seed, RNG_BOOTSTRAP, index, 0);
	c->one_way = false;
	*camera = path_walk_camera(c, &r.base, c->max_depth + 1, film);
	*light = path_walk_light(c, &r.base, c->max_depth);
}

static double contribution(struct path_context *c, unsigned s, unsigned edges, unsigned camera, unsigned light)
{
	unsigned t = edges + 1 - s;
	if (t > camera || s > (light > 1 ? light : 1) || (t == 1 && s < 2))
		return 0;
	double film[2];
	struct path_sample one = {.count = 0, .intensity = 0};
	spectrum l = path_connect(c, s, t, PATH_MAX_EDGES, film);
	if (!spectrum_is_zero(l))
		path_splat(c, &one, 0, 0, l);
	return one.intensity;
}

static void add(struct starts *s, uint64_t index, unsigned technique, unsigned joined, double intensity)
{
	unsigned passed = s->c->passed_count, edges = joined + passed;
	size_t n = s->of[edges].count++;
	if (n == s->of[edges].room) {
		s->of[edges].room = 2 * n + 64;
		s->of[edges].at = realloc(s->of[edges].at, s->of[edges].room * sizeof *s->of[edges].at);
		assert(s->of[edges].at);
	}
	s->of[edges].at[n] = (struct start){index, technique, passed, intensity + (n ? s->of[edges].at[n - 1].sum : 0)};
}

void starts_init(struct starts *s, struct path_context *c, uint64_t seed, uint64_t group, uint64_t pairs)
{
	*s = (struct starts){.c = c, .seed = seed, .pairs = pairs};
	for (uint64_t i = group * pairs; i < (group + 1) * pairs; i++) {
		unsigned camera, light;
		walk_both(s, i, &camera, &light);
		for (unsigned edges = c->min_depth; edges <= c->max_depth; edges++)
			for (unsigned j = 0; j <= edges; j++) {
				double f = contribution(c, j, edges, camera, light);
				if (f > 0)
					add(s, i, j, edges, f);
			}
	}
}

void starts_fini(struct starts *s)
{
	for (unsigned i = 0; i <= STARTS_MAX_EDGES; i++)
		free(s->of[i].at);
}

double starts_weight(const struct starts *s, unsigned edges)
{
	size_t n = s->of[edges].count;
	return n ? s->of[edges].at[n - 1].sum / (double)s->pairs : 0;
}

bool starts_path(struct starts *s, unsigned edges, double u, struct full_path *x)
{
	size_t n = s->of[edges].count, low = 0;
	if (n == 0)
		return false;
	double at = u * s->of[edges].at[n - 1].sum;
	for (size_t high = n - 1; low < high;) {
		size_t middle = (low + high) / 2;
		if (s->of[edges].at[middle].sum > at)
			high = middle;
		else
			low = middle + 1;
	}
	unsigned camera, light;
	const struct start *chosen = &s->of[edges].at[low];
	walk_both(s, chosen->index, &camera, &light);
	return full_path_from_subpaths(s->c, chosen->s, chosen->passed, edges, x);
}
