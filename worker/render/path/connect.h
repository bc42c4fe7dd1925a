/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Techniques: a path of k edges can be made from s vertices of a light sub-path and t = k + 1 - s vertices of a camera
 * sub-path. x_0 lies on the emitter; x_k is the pinhole or a point of the aperture, the same for all techniques of one
 * evaluation. The density of a technique is the product of the densities of its vertices (Veach 1997, sec. 10.2); the
 * balance heuristic compares the densities of all techniques for one given path. s = 0: the camera sub-path found the
 * emitter; s = 1: the emitter's point was drawn as seen from x_1 (next event estimation); t = 1: the light sub-path is
 * connected to x_k; t = 0 cannot happen.
 */
#ifndef WORKER_RENDER_PATH_CONNECT_H
#define WORKER_RENDER_PATH_CONNECT_H

#include "worker/render/path/next_event.h"
#include "worker/render/path/path.h"
#include "worker/render/path/refracted.h"
#include "worker/render/path/transparent.h"

/* A path assembled from two sub-paths, ordered from the light to the camera. */
struct joined_path {
	unsigned edges, light_count;
	/* x_s .. x_{s+passed-1} belong to neither sub-path: the joint passes them (transparent.h) or is refracted at
	 * them (refracted.h), which needs s = 1. */
	unsigned passed_count;
	double log_transfer; /* log T of refracted.h, if the joint is refracted */
	const struct path_vertex *v[PATH_EDGES_MAX + 2];
	/* Set where media scatter; otherwise unused and 0. Edge i joins x_{i-1} and x_i. */
	const struct path_edge *joint_vertices; /* edge s; its `before` is the medium at x_s */
	/* The first edge whose media a light sub-path would see differently; 0: none. */
	unsigned mismatched_edge;
};

/* Emitters are only joined to the lens where the density of their points, times the fraction of samples
 * that do so, is at least this many times the density of the film samples, that is, where they cover less
 * than a hundredth of the film. */
#define PATH_LENS_DENSITY_RATIO 100.0

/* Fills ratio[0..edges] with the density of technique j for this path divided by the density of the technique s that
 * made it; 0 where j cannot make the path or has more than max_s light vertices. */
void path_technique_ratios(struct path_context *c, const struct joined_path *p, unsigned max_s, double *ratio);
/* Returns the weight of the balance heuristic divided by the fraction of samples that try the technique: 1 / sum of the
 * ratios, where the ratios of techniques that need a light sub-path are divided by light_subpath_interval. */
double path_balance_weight(struct path_context *c, const struct joined_path *p, unsigned max_s);

/* Computes joined_path.mismatched_edge. Only where media scatter. */
unsigned path_find_mismatched_edge(const struct path_context *c, const struct joined_path *p);

/* Returns the contribution of a whole path whose contribution before dispersion is l. If the path scatters at a
 * dispersive BSDF, in whatever way, its directions and densities are those of nm[0], so only that wavelength
 * counts, four times. This is unbiased because nm[0] is uniform. Dispersion is a property of the path, so all
 * techniques that make it agree. */
spectrum path_collapse_to_hero(spectrum l, bool dispersive);

/* Whether connections can pass surfaces or be refracted, and so have vertices of their own. */
static inline bool path_joints_have_vertices(const struct path_context *c)
{
	return path_allows_see_through(c) || path_allows_refraction(c);
}

/* Whether joining s light vertices to t camera vertices can make a path of an admissible length. Passed surfaces add
 * edges, so min_depth excludes nothing where a connection may look through surfaces. */
static inline bool path_may_connect(const struct path_context *c, unsigned s, unsigned t)
{
	return s + t <= c->max_depth + 1 && (s + t > c->min_depth || (s > 0 && path_joints_have_vertices(c)));
}

/* Whether a joint across vertex i passes it (transparent.h). The ends of the joint that made p are never passed,
 * because the path scatters there. */
static inline bool path_joint_passes(const struct joined_path *p, unsigned i)
{
	return i > 0 && i < p->edges && i + 1 != p->light_count && i != p->light_count + p->passed_count &&
	       path_vertex_is_see_through(p->v[i]);
}

/* Returns the contribution f / p of joining the first s vertices of c->light to the first t of c->camera, weighted
 * among the techniques with up to max_s light vertices. s <= 1 needs no light sub-path. For t = 1, `film` is set to the
 * point where the contribution lands; otherwise it is unchanged. The path has s + t - 1 + c->passed_count edges. If any
 * vertices were passed, the length has been checked against min_depth and max_depth; otherwise the caller must have
 * checked it (path_may_connect). */
spectrum path_connect(struct path_context *c, unsigned s, unsigned t, unsigned max_s, double film[2]);

#endif
