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
static const double faint_fraction = 0.1;

/* Whether this sample has a light sub-path. With a low-discrepancy sampler this is exactly one of
 * light_subpath_interval consecutive samples of a pixel. */
static bool has_light_subpath(const struct path_context *c, struct sampler *s)
{
	return c->light_subpath_interval <= 1 ||
	       s->block(s, SIDE_CAMERA, 0)[DIM_LIGHT_SUBPATH] * c->light_subpath_interval < 1;
}

/* Returns the part of l that the film gets. */
static spectrum film_part(struct path_context *c, unsigned j, unsigned t, const double film[2], spectrum l)
{
	return c->split && !spectrum_is_zero(l) ? c->split->film_part(c->split, c, j, t, film, l) : l;
}

/* Returns the contribution of technique j with t vertices of the camera's sub-path; zero if it is invalid. */
static inline spectrum connect_technique(struct path_context *c, unsigned j, unsigned t, struct path_classes *classes)
{
	double film[2];
	if (!path_may_connect(c, j, t))
		return spectrum_constant(0);
	spectrum l = path_connect(c, j, t, PATH_EDGES_MAX, film);
	if (!path_accept(c, l))
		return spectrum_constant(0);
	if (!c->skips_classes)
		path_classes_add(classes, c, j, t, l);
	return l;
}

/* Joins each vertex of the light sub-path to the lens. Instead of its first vertex, a point of an emitter is drawn for
 * the lens, with the same numbers. */
static void join_light_to_lens(struct path_context *c, struct sampler *s, unsigned light, struct path_classes *classes,
			       struct path_sample *out)
{
	const double *u = s->block(s, SIDE_LIGHT, 0);
	c->camera[0].next_event[0] = u[DIM_EMITTER_POINT];
	c->camera[0].next_event[1] = u[DIM_EMITTER_POINT + 1];
	c->camera[0].next_event[2] = u[DIM_EMITTER_CHOICE];
	for (unsigned j = c->joins_emitters_to_lens ? 1 : 2; j <= c->max_depth && (j == 1 || j <= light); j++) {
		double film[2];
		if (!path_may_connect(c, j, 1))
			continue;
		spectrum l = path_connect(c, j, 1, PATH_EDGES_MAX, film);
		if (path_accept(c, l) && j > 1)
			l = film_part(c, j, 1, film, l);
		if (!spectrum_is_zero(l) && path_sample_add_splat(c, out, film[0], film[1], l) && !c->skips_classes)
			path_classes_add(classes, c, j, 1, l);
	}
}

/* Returns the contribution below which connections are faint, relative to `found_by_camera`, the light that the camera
 * sub-path finds alone, which does not depend on which connections are made. 0, so that all are made, where it finds
 * none, and for the samples that seed chains (makes_faint_connections). */
static double faint_threshold(const struct path_context *c, spectrum found_by_camera)
{
	return c->max_survival > 0 && !c->makes_faint_connections ? faint_fraction * spectrum_mean(found_by_camera) : 0;
}

void path_trace_candidates(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	double film[2];
	struct path_classes classes;
	out->splat_count = 0;
	out->class_mask = 0;
	out->intensity = 0;
	c->is_unidirectional = false;
	unsigned camera = path_walk_camera(c, s, c->max_depth + 1, film);
	bool has_light = has_light_subpath(c, s);
	unsigned light = has_light ? path_walk_light(c, s, c->max_depth) : 0;
	spectrum sum = spectrum_constant(0), found_by_camera = spectrum_constant(0);
	if (!c->skips_classes)
		path_classes_begin(&classes, c, camera, light, out);
	if (EFFECT_IS_ON(c->w, medium_light))
		sum = found_by_camera =
			volume_emission(c, c->min_depth, c->max_depth, c->skips_classes ? NULL : &classes);
	for (unsigned t = 2; t <= camera; t++)
		for (unsigned j = 0; j <= 1; j++) {
			spectrum l = connect_technique(c, j, t, &classes);
			found_by_camera = spectrum_add(found_by_camera, l);
			sum = spectrum_add(sum, film_part(c, j, t, film, l));
		}
	c->faint_threshold = faint_threshold(c, found_by_camera);
	if (c->faint_threshold > 0)
		c->faint_position = s->block(s, SIDE_CAMERA, 0)[DIM_FAINT_CONNECTION];
	for (unsigned t = 2; t <= camera; t++)
		for (unsigned j = 2; j <= light; j++)
			sum = spectrum_add(sum, film_part(c, j, t, film, connect_technique(c, j, t, &classes)));
	c->faint_threshold = 0;
	if (!path_sample_add_splat(c, out, film[0], film[1], sum) && out->class_mask)
		path_classes_clear(out);
	if (has_light)
		join_light_to_lens(c, s, light, &classes, out);
}

void path_trace_bidirectional(struct path_context *c, struct sampler *s, struct path_sample *out)
{
	c->joins_emitters_to_lens = true;
	path_trace_candidates(c, s, out);
	c->joins_emitters_to_lens = false;
}

const struct integrator integrator_bdpt8 = {
	.properties = {.name = "bdpt8", .kind = PLAN_SAMPLES, .max_depth = PATH_EDGES_MAX},
	.stream = RNG_BDPT8,
	.evaluate = path_trace_bidirectional,
	.light_subpath_interval = 8,
};

const struct integrator integrator_bdpt = {
	.properties = {.name = "bdpt", .kind = PLAN_SAMPLES, .max_depth = PATH_EDGES_MAX},
	.stream = RNG_BDPT,
	.evaluate = path_trace_bidirectional,
};

const struct integrator integrator_erpt = {
	.properties = {.name = "erpt", .kind = PLAN_SAMPLES, .max_depth = PATH_EDGES_MAX},
	.stream = RNG_ERPT,
	.evaluate = path_trace_bidirectional,
	.redistributes = true,
};

const struct integrator integrator_erpt4 = {
	.properties = {.name = "erpt4", .kind = PLAN_SAMPLES, .max_depth = PATH_EDGES_MAX},
	.stream = RNG_ERPT4,
	.evaluate = path_trace_bidirectional,
	.light_subpath_interval = 4,
	.redistributes = true,
};
