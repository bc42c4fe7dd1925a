/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Techniques: a path of k edges can be made from s vertices of a light sub-path and t = k + 1 - s of a camera sub-path.
 * x_0 lies on the emitter, x_k is the pinhole or a point of the aperture, the same for all techniques of one
 * evaluation. Densities multiply (Veach 1997, sec. 10.2); the balance heuristic compares them for one given path. s =
 * 0: the camera sub-path found the emitter; s = 1: the emitter's point was drawn as seen from x_1 (next event
 * estimation); t = 1: the light sub-path is connected to x_k; t = 0 cannot happen.
 */
#ifndef WORKER_RENDER_PATH_CONNECT_H
#define WORKER_RENDER_PATH_CONNECT_H

#include "worker/render/path/next_event.h"
#include "worker/render/path/path.h"
#include "worker/render/path/refracted.h"
#include "worker/render/path/transparent.h"

/* A path put together from sub-paths, light to camera. */
struct joined_path {
	unsigned edges, s;
	unsigned passed;     /* x_s .. x_s+passed-1 belong to neither sub-path: the joint passes them (transparent.h) */
	double log_transfer; /* where they refract instead, which needs s = 1: of refracted.h */
	const struct path_vertex *v[PATH_MAX_EDGES + 2];
	/* Where media scatter; otherwise unused and 0. Edge i joins x_i-1 and x_i. */
	const struct path_edge *joint; /* edge s, of which x_s is the vertex before */
	unsigned other_medium;	       /* the first edge about which a light sub-path does not agree; 0: none */
};

/* Emitters are joined to the lens where the density of their points, times the share of samples that do so, is so many
 * times that of the film's samples: where they cover less than a hundredth of it. */
#define PATH_LENS_DENSER 100.0

/* Density of technique j for this path over the density of the technique s that made it: 0 where j cannot make it.
 * Fills ratio[0..edges]; techniques with more than max_s light vertices are left out (0). */
void path_technique_ratios(struct path_context *c, const struct joined_path *p, unsigned max_s, double *ratio);
/* Weight of the balance heuristic over the share of the samples that tries the technique: 1 / sum of the ratios, those
 * of techniques that only samples with a light sub-path try divided by light_every. */
double path_balance_weight(struct path_context *c, const struct joined_path *p, unsigned max_s);

/* What other_medium is. Only where media scatter. */
unsigned path_other_medium(const struct path_context *c, const struct joined_path *p);

/* The contribution of a whole path, l before dispersion. If the path scatters at a dispersive BSDF, in whatever way,
 * its directions and densities are those of nm[0], and only that wavelength counts, four times: unbiased, because nm[0]
 * is uniform. This is a property of the path, so all techniques that make it agree. */
spectrum path_collapse(spectrum l, bool dispersive);

/* Whether connections can have vertices of their own. */
static inline bool path_joints_have_vertices(const struct path_context *c)
{
	return path_sees_through(c) || path_refracts(c);
}

/* Whether joining s vertices to t can make a path of a length that is asked for. Passed surfaces add edges, so
 * min_depth rules out nothing where a connection may look through some. */
static inline bool path_may_connect(const struct path_context *c, unsigned s, unsigned t)
{
	return s + t <= c->max_depth + 1 && (s + t > c->min_depth || (s > 0 && path_joints_have_vertices(c)));
}

/* Whether vertex i is one that a joint across it passes (transparent.h). The ends of the joint that made p are not:
 * they scatter there. */
static inline bool path_joint_passes(const struct joined_path *p, unsigned i)
{
	return i > 0 && i < p->edges && i + 1 != p->s && i != p->s + p->passed && path_is_passed(p->v[i]);
}

/* Contribution f / p of joining the first s vertices of c->light with the first t of c->camera, already weighted among
 * the techniques up to max_s. s <= 1 needs no light sub-path. film: where it lands when t = 1 (else unchanged). The
 * path has s + t - 1 + c->passed_count edges. If that is more than s + t - 1, it has been checked against min_depth and
 * max_depth; otherwise the caller has (path_may_connect). */
spectrum path_connect(struct path_context *c, unsigned s, unsigned t, unsigned max_s, double film[2]);

#endif
