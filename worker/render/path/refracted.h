/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Connections to emitters through surfaces that refract light exactly: lamps behind glass, the sun under water (Hanika,
 * Droske and Fascione 2015, Manifold Next Event Estimation). A point y of an emitter is drawn as seen from z, as for
 * any connection. If only surfaces with a refracting specular lobe lie between them, a walk moves the points where the
 * straight line crosses those surfaces until each refracts light to the next (halfvec/refract.h). These points become
 * vertices of the path, with the same specular lobes as if a sub-path had met them, so a path has the same number of
 * edges whichever technique makes it, and techniques can be weighted against each other.
 *
 * Let x_0 = y, x_{m+1} = z, with x_1 .. x_m refracting. Technique 1 (path/connect.h) draws x_0 with density p and none
 * of x_1 .. x_m. Techniques are compared in the measure of path.h, which has an area and a delta distribution for each
 * of these vertices. In that measure the density is p J,
 *
 *     J = prod_{i = 1..m} G(x_i, x_{i-1}) / T,     T = |det d x_m / d x_0|,
 *
 * where T is taken with z and all half vectors held fixed: the delta distributions, as functions of x_1 .. x_m, have a
 * block tridiagonal Jacobian M = d c / d x whose blocks a_i = d c_i / d x_{i-1} have determinants G(x_i, x_{i-1}), and
 * T = prod |a_i| / |det M| does not depend on which functions vanish on the paths that refract (halfvec/constraint.h).
 * Where light goes straight on, this is J of transparent.h. So the contribution divided by the density is that of a
 * connection whose geometry term is G(z, x_m) T.
 *
 * The walk finds one of the paths between z and y; which one depends on z, y and the wavelength alone. To weight a path
 * that another technique made, the walk is repeated: technique 1 can make the path if the walk ends at it.
 */
#ifndef WORKER_RENDER_PATH_REFRACTED_H
#define WORKER_RENDER_PATH_REFRACTED_H

#include "worker/render/path/vertex.h"

/* Whether this evaluation refracts connections to emitters. */
static inline bool path_allows_refraction(const struct path_context *c)
{
	return c->refract && EFFECT_IS_ON(c->w, refracted_shadows) && !c->joints_are_opaque;
}

/* Whether v could be a vertex of a refracted connection: an exactly specular lobe refracts its path there. */
static inline bool path_vertex_is_refracting(const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && v->is_delta && (v->mode & BSDF_TRANSMIT) && !(v->mode & BSDF_STRAIGHT) &&
	       bsdf_refracts_connections(v->bsdf);
}

/* Whether a refracted connection from z to y is tried. y is drawn with density `pdf_toward`; the connection is tried if
 * that is much larger than the density with which sub-paths from z would find y. f: scattering at z from the straight
 * direction; before: the vertex before z on the camera's sub-path. */
bool path_should_refract(const struct path_context *c, const struct path_vertex *before, const struct path_vertex *z,
			 const struct path_vertex *y, double pdf_toward, spectrum f);

/* Joins z, a vertex of the camera's sub-path, to y by a refracted path. Fills in c->passed and c->log_transfer, the
 * logarithm of T. Sets *transmittance to the product of the weights of the lobes and of the transmittance of absorbing
 * media between z and the last surface; the caller adds the edge from that surface to y. before: the vertex before z.
 * Returns false if there is no such path. Counts rays. */
bool path_trace_refracted(struct path_context *c, const struct path_vertex *before, const struct path_vertex *z,
			  const struct path_vertex *y, spectrum *transmittance);

/* Returns the index `end` of the vertex to which technique 1 would join x_0 by refraction: x_1 .. x_{end-1}
 * refract, x_end does not. 0: there is none. v: the vertices from the emitter to the camera, k edges. Technique 1
 * scatters at x_end by a smooth lobe; a path that is specular there is a different path even if its vertices are
 * the same. The caller must check this, because a vertex at which a joint ends may be marked as specular for the
 * way its sub-path continued. */
unsigned path_refracted_end(const struct path_vertex *const *v, unsigned k);

/* Whether technique 1 makes the path that scatters smoothly at x_end, that is, whether its walk
 * ends at x_1 .. x_{end-1}. */
bool path_is_made_by_refraction(struct path_context *c, const struct path_vertex *const *v, unsigned end,
				double *log_transfer);

/* Returns the density of technique 1's refracted joint divided by that of drawing x_1 .. x_{end-1} as their sub-path
 * did; 0 if technique 1 does not make the path. */
double path_refracted_over_drawn_ratio(struct path_context *c, const struct path_vertex *const *v, unsigned end);

/* Like path_pdf(), but from a refracting vertex: returns the density of `next` for a sub-path that comes from prev. */
double path_pdf_refracted(const struct path_context *c, const struct path_vertex *prev,
			  const struct path_vertex *vertex, const struct path_vertex *next, enum transport transport);

/* Returns J for x_1 .. x_count divided by the product of their densities pdf[0 .. count - 1]. */
double path_refracted_ratio(const struct path_vertex *const *v, unsigned count, double log_transfer, const double *pdf);

#endif
