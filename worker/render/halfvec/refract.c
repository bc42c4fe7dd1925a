/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Manifold next event estimation's walk (Hanika, Droske and Fascione 2015, sec. 4): the straight line from z to y gives
 * the surfaces and a first guess, halfvec_walk moves the guess to where all half vectors are 0.
 *
 * It fails where the line meets a surface that does not refract, or more than PATH_REFRACTED_MOST of them, where the
 * walk does not arrive (walk.h), and where the path is a caustic's edge, at which T is infinite. Paths that it does not
 * find are left to the other techniques.
 */
#include "worker/render/halfvec/refract.h"

#include "worker/render/halfvec/walk.h"
#include "worker/render/path/visible.h"

/* Beyond e^300 to either side T would over- or underflow once multiplied by densities. */
#define LOG_TRANSFER_MOST 300

/* What lies between z and y, the nearest to z first. false: something that does not refract, or nothing. */
static bool cross(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
		  struct path_refraction *out)
{
	double distance2;
	const vec3 d = path_direction(z, y, &distance2);
	const struct path_vertex *from = z;
	out->count = 0;
	while (out->count < PATH_REFRACTED_MOST) {
		struct path_vertex *v = &out->v[out->count];
		double end = y->kind == VERTEX_INFINITE ? INFINITY : vec3_length(vec3_sub(y->x.p, from->x.p));
		if (!path_extend(c, from, d, 0, end, v) || v->kind != VERTEX_SURFACE || !bsdf_refracts(v->bsdf))
			return false;
		v->delta = true;
		v->mode = BSDF_TRANSMIT | BSDF_DELTA;
		out->count++;
		if (path_visible(c, v, y))
			return true;
		from = v;
	}
	return false;
}

bool halfvec_refract(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
		     struct path_refraction *out)
{
	struct full_path x;
	struct walk_scratch s;
	struct walk_target target[PATH_REFRACTED_MOST + 2];
	const struct walk_limits limits = walk_limits_of(&c->w->accuracy);
	if (!cross(c, z, y, out))
		return false;
	const unsigned m = out->count, b = m + 1;
	x.edges = b;
	x.wl = c->wl;
	x.wavelength = 0;
	x.known_f = x.known_fh = (struct vertex_set){{0}};
	x.v[0] = *y;
	x.v[b] = *z;
	for (unsigned j = 1; j <= m; j++) {
		x.v[j] = out->v[m - j];
		target[j] = (struct walk_target){{0, 0}, WALK_SPECULAR_TOLERANCE};
	}
	if (halfvec_walk(c, &x, b, 0, target, false, &limits, WALK_STALE, &s) != WALK_OK ||
	    constraint_double.factor(s.k, b, 0, &s.system) != CONSTRAINT_OK)
		return false;
	for (unsigned j = 1; j <= m; j++)
		out->v[m - j] = x.v[j];
	out->log_transfer = s.system.log_transfer;
	return fabs(out->log_transfer) < LOG_TRANSFER_MOST;
}
