/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Connections through surfaces that let light straight through: thin glass, the holes of a `mask`, filters. Two
 * vertices are joined even if such surfaces lie between them. The points where the connection crosses these
 * surfaces are its passed vertices. They become vertices of the path, with the same specular lobes as if a
 * sub-path had met them, so a path has the same number of edges whichever technique makes it, and techniques can
 * be weighted against each other.
 *
 * Let x_a, ..., x_b be collinear, with all vertices between x_a and x_b passed. A technique that joins x_a to x_b draws
 * none of the passed vertices, so its density p is that of the ends alone. Techniques are compared in the measure of
 * path.h, which has an area and a delta distribution for each passed vertex. In that measure the density is p J, where
 * J is the quotient of the geometry terms:
 *
 *     J = |x_a - x_b|^2 prod over the passed |ng . w|^2 / prod over the edges |x_i - x_{i+1}|^2.
 *
 * Distances to infinity count as 1.
 *
 * Two kinds of surfaces are never passed. Where media scatter, connections end at all surfaces except `null`, whose
 * faces the edges themselves cross (media.h). Hair always blocks connections, because one connection could cross a
 * curled fibre many times.
 */
#ifndef WORKER_RENDER_PATH_TRANSPARENT_H
#define WORKER_RENDER_PATH_TRANSPARENT_H

#include "worker/render/path/vertex.h"

/* Whether connections look through surfaces in this evaluation. */
static inline bool path_allows_see_through(const struct path_context *c)
{
	return EFFECT_IS_ON(c->w, transparent_shadows) && !c->joints_are_opaque;
}

/* Whether a connection could have passed v: the path continues straight through it. */
static inline bool path_vertex_is_see_through(const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && v->is_delta && (v->mode & BSDF_STRAIGHT) &&
	       bsdf_passes_connections(v->bsdf);
}

/* Whether z, a vertex of the camera's sub-path, and y see each other through at least one and at most
 * PATH_PASSED_VERTICES_MAX surfaces. before: the vertex before z; NULL if z is on the lens. Fills in c->passed. Sets
 * *transmittance to the share of light that the surfaces let through, times the transmittance of absorbing media
 * between z and the last surface; the caller adds the edge from that surface to y. Counts rays. */
bool path_trace_passed(struct path_context *c, const struct path_vertex *before, const struct path_vertex *z,
		       const struct path_vertex *y, spectrum *transmittance);

/* Like path_pdf(), but from a passed vertex: returns the density of `next` for a sub-path that
 * goes straight through `vertex`. */
double path_pdf_passed(const struct path_context *c, const struct path_vertex *vertex, const struct path_vertex *next,
		       enum transport transport);

/* Returns J for the passed vertices v[first..last] divided by the product of their densities pdf[0..last - first]. */
double path_passed_ratio(const struct path_vertex *const *v, unsigned first, unsigned last, const double *pdf);
/* Like path_passed_ratio(), but for an array of vertices, with their pdf as densities; J alone if not over_pdf. */
double path_passed_ratio_of_array(const struct path_vertex *v, unsigned first, unsigned last, bool over_pdf);

#endif
