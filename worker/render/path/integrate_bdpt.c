/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bidirectional path tracing (Veach 1997, ch. 10): every way of joining a light with a camera sub-path, by the balance
 * heuristic. One light sub-path a camera sub-path; those that are joined to the pinhole land anywhere on the film.
 * In bdpt8 only one in eight camera sub-paths has a light sub-path, and what needs one counts eight times (the
 * multi-sample model of Veach 1997, sec. 9.2.1): nearly as cheap as `path` where that finds most of the light, without
 * its fireflies.
 */
#include "worker/render/path/integrate_bdpt.h"

#include "worker/render/path/classes.h"
#include "worker/render/path/connect.h"
#include "worker/render/path/integrator.h"

enum { RARELY = 8 };

/* Exactly one of so many consecutive samples of a pixel, where these are low-discrepancy. */
static bool has_light(const struct path_context *c, struct sampler *s)
{
	return c->light_every <= 1 || s->block(s, SIDE_CAMERA, 0)[DIM_HAS_LIGHT] * c->light_every < 1;
}

static void trace(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	double film[2];
	struct classes classes;
	out->count = 0;
	out->classes = 0;
	out->intensity = 0;
	c->one_way = false;
	unsigned camera = path_walk_camera(c, s, c->max_depth + 1, film);
	unsigned light = has_light(c, s) ? path_walk_light(c, s, c->max_depth) : 0;
	spectrum sum = spectrum_of(0);
	if (!c->unclassed)
		classes_begin(&classes, c, camera, light, out);
	for (unsigned t = 2; t <= camera; t++) {
		for (unsigned j = 0; j <= (light > 1 ? light : 1) && t + j - 1 <= c->max_depth; j++) {
			if (t + j - 1 < c->min_depth)
				continue;
			spectrum l = path_connect(c, j, t, PATH_MAX_EDGES, film);
			if (!path_accept(c, l))
				continue;
			sum = spectrum_add(sum, l);
			if (!c->unclassed)
				classes_add(&classes, j, t, l);
		}
	}
	if (!path_splat(c, out, film[0], film[1], sum) && out->classes)
		classes_clear(out);
	for (unsigned j = 2; j <= light && j <= c->max_depth; j++) {
		double at[2];
		if (j < c->min_depth)
			continue;
		spectrum l = path_connect(c, j, 1, PATH_MAX_EDGES, at);
		if (!spectrum_is_zero(l) && path_splat(c, out, at[0], at[1], l) && !c->unclassed)
			classes_add(&classes, j, 1, l);
	}
}

void path_trace_both_ways(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	c->light_every = 1;
	trace(c, s, out);
}

static void trace_rarely_both_ways(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	c->light_every = RARELY;
	trace(c, s, out);
}

const struct integrator integrator_bdpt8 = {
	.face = {.name = "bdpt8",
		 .summary = "bdpt with a light sub-path in one of eight samples",
		 .kind = PLAN_SAMPLES,
		 .max_depth = PATH_MAX_EDGES},
	.stream = RNG_BDPT8,
	.evaluate = trace_rarely_both_ways,
};

const struct integrator integrator_bdpt = {
	.face = {.name = "bdpt",
		 .summary = "bidirectional path tracing, all techniques, balance heuristic",
		 .kind = PLAN_SAMPLES,
		 .max_depth = PATH_MAX_EDGES},
	.stream = RNG_BDPT,
	.evaluate = path_trace_both_ways,
};
