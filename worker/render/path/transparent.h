/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Connections through surfaces that let light straight through: thin glass, the holes of a `mask`, filters. Where such
 * surfaces are all that lies between two vertices, these are joined nonetheless, and what is passed becomes vertices of
 * the path, left by specular lobes like any that a sub-path meets. So a path has the same edges, whichever technique
 * makes it.
 *
 * Let x_a, ..., x_b be collinear, all between x_a and x_b passed. A technique that joins x_a to x_b draws nothing in
 * between, so its density is that of its ends alone. In the measure of path.h, which has an area and a delta
 * distribution for each vertex that is passed, it is that times
 *
 *     J = |x_a - x_b|^2 prod over the passed |ng . w|^2 / prod over the edges |x_i - x_i+1|^2,
 *
 * distances to infinity being 1: the quotient of their geometry terms, by which all techniques are compared.
 *
 * Not where media scatter: there the edges themselves pass the faces of `null` (media.h). Not through hair: one that is
 * curled would be passed many times.
 */
#ifndef WORKER_RENDER_PATH_TRANSPARENT_H
#define WORKER_RENDER_PATH_TRANSPARENT_H

#include "worker/render/path/vertex.h"

/* Whether connections look through surfaces. */
static inline bool path_sees_through(const struct path_context *c)
{
	return EFFECT_IS_ON(c->w, transparent_shadows) && !c->opaque;
}

/* Whether a vertex is one that a connection could have passed, by how its path leaves it. */
static inline bool path_is_passed(const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && v->delta && (v->mode & BSDF_STRAIGHT) && !v->bsdf->culls;
}

/* Whether z, a vertex of the camera's sub-path (before: the one before it; NULL for the lens) and y see each other
 * through at least one surface. Fills in c->passed; *left: the share of light that these let through, and what media
 * that only absorb leave of it between z and the last of them. Counts rays. */
bool path_see_through(struct path_context *c, const struct path_vertex *before, const struct path_vertex *z,
		      const struct path_vertex *y, spectrum *left);

/* Density of `next` as generated from `at`, which is passed: like path_pdf. */
double path_pdf_passed(const struct path_context *c, const struct path_vertex *at, const struct path_vertex *next,
		       enum transport transport);

/* J over the product of pdf[first..last], densities of the passed vertices v[first..last]. */
double path_passed_ratio(const struct path_vertex *const *v, unsigned first, unsigned last, const double *pdf);
/* The same for vertices that lie in a row. pdf: NULL for J alone. */
double path_passed_ratio_in(const struct path_vertex *v, unsigned first, unsigned last, const double *pdf);

#endif
