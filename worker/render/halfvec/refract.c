/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The walk of manifold next event estimation (Hanika, Droske and Fascione 2015, sec. 4). The straight line from z to y
 * gives the surfaces and an initial guess, and halfvec_walk moves the guess to where all half vectors are 0. If that
 * fails and z lies in a denser medium, as under water beside a wall, a few other lines from z are tried: the one along
 * which light would arrive if the surface were a plane, and those to points of the surface (world/refracting.h).
 *
 * A guess fails if its line meets a surface that does not refract, or more than PATH_REFRACTED_VERTICES_MAX surfaces;
 * if the walk does not converge (walk.h); or if the path is at the edge of a caustic, where T is infinite. Paths that
 * are not found are left to the other techniques, as are paths between points that see each other, where the connection
 * is straight (path/connect.c).
 */
#include "worker/render/halfvec/refract.h"

#include "worker/render/halfvec/constraint_system.h"
#include "worker/render/halfvec/walk.h"
#include "worker/render/path/transparent.h"
#include "worker/render/path/visible.h"
#include "worker/render/world/refracting.h"

/* Outside e^-300 .. e^300, T would over- or underflow when multiplied by densities. */
#define LOG_TRANSFER_MAX 300

/* Whether a ray along d passes v from the medium with the larger refractive index to the other one. */
static bool leaves_denser_medium(const struct path_vertex *v, vec3 d)
{
	return (vec3_dot(d, v->x.ng) > 0) == (v->bsdf->eta > 1);
}

/* Sets *d to the direction from `from` to y and returns the distance. */
static double distance_to(const struct path_vertex *from, const struct path_vertex *y, vec3 *d)
{
	double distance2;
	*d = path_direction(from, y, &distance2);
	return y->kind == VERTEX_INFINITE ? INFINITY : sqrt(distance2);
}

/* Makes an initial guess of the vertices between z and y, ordered from z: surfaces on a line from z along d, at most
 * `max_distance` away, and behind the first of them on the straight line to y. from_denser: z is in the denser medium,
 * so the first surface must lead out of it. Returns false if the line meets nothing, or a surface that does not
 * refract. */
static bool guess_vertices(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y, vec3 d,
			   double max_distance, bool from_denser, struct path_refraction *out)
{
	const struct path_vertex *from = z;
	out->count = 0;
	while (out->count < PATH_REFRACTED_VERTICES_MAX) {
		struct path_vertex *v = &out->v[out->count];
		if (!path_extend(c, from, d, 0, max_distance, v) || v->kind != VERTEX_SURFACE ||
		    !bsdf_refracts_connections(v->bsdf) || (from_denser && from == z && !leaves_denser_medium(v, d)))
			return false;
		v->is_delta = true;
		v->mode = BSDF_TRANSMIT | BSDF_DELTA;
		out->count++;
		if (path_is_visible(c, v, y))
			return true;
		from = v;
		max_distance = distance_to(v, y, &d);
	}
	return false;
}

/* Moves the guess to where light is refracted. Returns false if the walk fails. */
static bool walk_to_refraction(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
			       struct path_refraction *out)
{
	struct full_path x;
	struct walk_scratch s;
	struct walk_target target[PATH_REFRACTED_VERTICES_MAX + 2];
	const struct walk_limits limits = walk_limits_of(&c->w->accuracy);
	const unsigned m = out->count, b = m + 1;
	x.edges = b;
	x.wl = c->wl;
	x.wavelength_u = 0;
	x.cached_f = x.cached_fh = (struct vertex_set){{0}};
	x.v[0] = *y;
	x.v[b] = *z;
	for (unsigned j = 1; j <= m; j++) {
		x.v[j] = out->v[m - j];
		target[j] = (struct walk_target){{0, 0}, WALK_SPECULAR_TOLERANCE};
	}
	if (halfvec_walk(c, &x, b, 0, target, false, &limits, WALK_STALE_ALL, &s) != WALK_OK ||
	    constraint_double.factor(s.k, b, 0, &s.system) != CONSTRAINT_OK)
		return false;
	for (unsigned j = 1; j <= m; j++)
		out->v[m - j] = x.v[j];
	out->log_transfer = s.system.log_transfer;
	return fabs(out->log_transfer) < LOG_TRANSFER_MAX;
}

/* Returns the direction from z in which light from y would arrive behind a plane through q, by Snell's law. */
static vec3 refracted_direction(const struct refracting_point *q, const struct path_vertex *y)
{
	vec3 incident = y->kind == VERTEX_INFINITE ? y->x.p : vec3_sub(y->x.p, q->p);
	double length = vec3_length(incident);
	incident = length > 0 ? vec3_scale(1 / length, incident) : q->n;
	double cosine = fmax(vec3_dot(incident, q->n), 0), e = 1 / q->eta;
	return vec3_normalize(
		vec3_madd(vec3_scale(e, incident), sqrt(1 - e * e * (1 - cosine * cosine)) - e * cosine, q->n));
}

static bool refract_along(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y, vec3 d,
			  struct path_refraction *out)
{
	return guess_vertices(c, z, y, d, INFINITY, true, out) && walk_to_refraction(c, z, y, out);
}

/* Tries other guesses where z is in a denser medium: light that was bent arrives from other directions than y's. */
static bool try_other_guesses(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
			      struct path_refraction *out)
{
	const struct refracting_light light = {y->x.p, y->kind == VERTEX_INFINITE};
	const struct refracting_point *points[REFRACTING_POINTS_RANKED];
	const uint32_t count = refracting_points_rank(c->w, z->x.p, &light, points);
	if (count > 0 && refract_along(c, z, y, refracted_direction(points[0], y), out))
		return true;
	for (uint32_t i = 0; i < count; i++)
		if (refract_along(c, z, y, vec3_normalize(vec3_sub(points[i]->p, z->x.p)), out))
			return true;
	return false;
}

/* Whether z sees y along a straight line, possibly through surfaces that let light straight through. Then a connection
 * is not refracted, and its paths must not be weighted as if it were. */
static bool is_straight_connection(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
				   vec3 d, double end)
{
	struct path_vertex first;
	if (path_is_visible(c, z, y))
		return true;
	return path_allows_see_through(c) && path_extend(c, z, d, 0, end, &first) && first.kind == VERTEX_SURFACE &&
	       bsdf_passes_connections(first.bsdf);
}

bool halfvec_refract(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
		     struct path_refraction *out)
{
	vec3 d;
	const double end = distance_to(z, y, &d);
	if (!(end > 0))
		return false;
	if (box_is_hit(&c->w->refracting_bounds, z->x.p, d, end) && guess_vertices(c, z, y, d, end, false, out) &&
	    walk_to_refraction(c, z, y, out))
		return true;
	return try_other_guesses(c, z, y, out) && !is_straight_connection(c, z, y, d, end);
}
