/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bidirectional path tracing (Veach 1997, ch. 10): light and camera sub-paths are joined by every technique, weighted
 * by the balance heuristic. There is one light sub-path per camera sub-path; its joints to the pinhole land anywhere on
 * the film. In bdpt8 only one in eight camera sub-paths has a light sub-path, and the techniques that need one count
 * eight times (the multi-sample model of Veach 1997, sec. 9.2.1). This is nearly as cheap as `path` where that finds
 * most of the light, without its fireflies.
 */
#include "worker/render/path/integrate_bdpt.h"

#include "worker/render/path/classes.h"
#include "worker/render/path/connect.h"
#include "worker/render/path/volume_emission.h"
#include "worker/render/path/integrator.h"

/* Connections that contribute less than this fraction of the light that the camera's sub-path finds alone are faint. In
 * closed rooms 0.1 saves a quarter of the time and adds 1 % to the relMSE, 0.3 hardly saves more and adds 5 %;
 * elsewhere neither changes anything (tests/bench/choices.md, "Faint connections"). */
static const double faint_share = 0.1;

/* Whether this sample has a light sub-path. With a low-discrepancy sampler this is exactly one of light_every
 * consecutive samples of a pixel. */
static bool has_light(const struct path_context *c, struct sampler *s)
{
	return c->light_every <= 1 || s->block(s, SIDE_CAMERA, 0)[DIM_HAS_LIGHT] * c->light_every < 1;
}

/* Returns the part of l that the film gets. */
static spectrum share_for_film(struct path_context *c, unsigned j, unsigned t, const double film[2], spectrum l)
{
	return c->split && !spectrum_is_zero(l) ? c->split->keep(c->split, c, j, t, film, l) : l;
}

/* Returns the contribution of technique j with t vertices of the camera's sub-path; zero if it is invalid. */
static inline spectrum join(struct path_context *c, unsigned j, unsigned t, struct classes *classes)
{
	double film[2];
	if (!path_may_connect(c, j, t))
		return spectrum_of(0);
	spectrum l = path_connect(c, j, t, PATH_MAX_EDGES, film);
	if (!path_accept(c, l))
		return spectrum_of(0);
	if (!c->unclassed)
		classes_add(classes, c, j, t, l);
	return l;
}

/* Joins each vertex of the light sub-path to the lens. Instead of its first vertex, a point of an emitter is drawn for
 * the lens, with the same numbers. */
static void join_light_to_lens(struct path_context *c, struct sampler *s, unsigned light, struct classes *classes,
			       struct path_sample *out)
{
	const double *u = s->block(s, SIDE_LIGHT, 0);
	c->camera[0].next_event[0] = u[DIM_EMITTER_POINT];
	c->camera[0].next_event[1] = u[DIM_EMITTER_POINT + 1];
	c->camera[0].next_event[2] = u[DIM_EMITTER_CHOICE];
	for (unsigned j = c->joins_lens ? 1 : 2; j <= c->max_depth && (j == 1 || j <= light); j++) {
		double at[2];
		if (!path_may_connect(c, j, 1))
			continue;
		spectrum l = path_connect(c, j, 1, PATH_MAX_EDGES, at);
		if (path_accept(c, l) && j > 1)
			l = share_for_film(c, j, 1, at, l);
		if (!spectrum_is_zero(l) && path_splat(c, out, at[0], at[1], l) && !c->unclassed)
			classes_add(classes, c, j, 1, l);
	}
}

/* Returns the contribution below which connections are faint, relative to `found`, the light that the camera sub-path
 * finds alone, which does not depend on which connections are made. 0, so that all are made, where it finds none, and
 * for the samples that seed chains (makes_all). */
static double faint_beside(const struct path_context *c, spectrum found)
{
	return c->roulette > 0 && !c->makes_all ? faint_share * spectrum_mean(found) : 0;
}

void path_trace_candidates(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	double film[2];
	struct classes classes;
	out->count = 0;
	out->classes = 0;
	out->intensity = 0;
	c->one_way = false;
	unsigned camera = path_walk_camera(c, s, c->max_depth + 1, film);
	bool lit = has_light(c, s);
	unsigned light = lit ? path_walk_light(c, s, c->max_depth) : 0;
	spectrum sum = spectrum_of(0), found = spectrum_of(0);
	if (!c->unclassed)
		classes_begin(&classes, c, camera, light, out);
	if (EFFECT_IS_ON(c->w, medium_light))
		sum = found = volume_emission(c, c->min_depth, c->max_depth, c->unclassed ? NULL : &classes);
	for (unsigned t = 2; t <= camera; t++)
		for (unsigned j = 0; j <= 1; j++) {
			spectrum l = join(c, j, t, &classes);
			found = spectrum_add(found, l);
			sum = spectrum_add(sum, share_for_film(c, j, t, film, l));
		}
	c->faint = faint_beside(c, found);
	if (c->faint > 0)
		c->faint_place = s->block(s, SIDE_CAMERA, 0)[DIM_FAINT];
	for (unsigned t = 2; t <= camera; t++)
		for (unsigned j = 2; j <= light; j++)
			sum = spectrum_add(sum, share_for_film(c, j, t, film, join(c, j, t, &classes)));
	c->faint = 0;
	if (!path_splat(c, out, film[0], film[1], sum) && out->classes)
		classes_clear(out);
	if (lit)
		join_light_to_lens(c, s, light, &classes, out);
}

void path_trace_both_ways(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	c->joins_lens = true;
	path_trace_candidates(c, s, out);
	c->joins_lens = false;
}

const struct integrator integrator_bdpt8 = {
	.face = {.name = "bdpt8", .kind = PLAN_SAMPLES, .max_depth = PATH_MAX_EDGES},
	.stream = RNG_BDPT8,
	.evaluate = path_trace_both_ways,
	.light_every = 8,
};

const struct integrator integrator_bdpt = {
	.face = {.name = "bdpt", .kind = PLAN_SAMPLES, .max_depth = PATH_MAX_EDGES},
	.stream = RNG_BDPT,
	.evaluate = path_trace_both_ways,
};

const struct integrator integrator_erpt = {
	.face = {.name = "erpt", .kind = PLAN_SAMPLES, .max_depth = PATH_MAX_EDGES},
	.stream = RNG_ERPT,
	.evaluate = path_trace_both_ways,
	.redistributes = true,
};

const struct integrator integrator_erpt4 = {
	.face = {.name = "erpt4", .kind = PLAN_SAMPLES, .max_depth = PATH_MAX_EDGES},
	.stream = RNG_ERPT4,
	.evaluate = path_trace_both_ways,
	.light_every = 4,
	.redistributes = true,
};
