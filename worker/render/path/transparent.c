/* SPDX-License-Identifier: Apache-2.0 */
/*
 * path_see_through follows the ray from z to y from one surface to the next, as long as each has a straight lobe, and
 * ends when nothing lies between the last surface and y. An opaque surface blocks the view. So do more than
 * PATH_PASSED_MOST surfaces, which bounds the work; paths through more surfaces are left to sub-paths that pass them
 * one by one. At the very edge of a surface, rounding (geom/accel.h) may let a ray pass although the test of the two
 * ends reports it as blocked; the ray then reaches the surface on which y lies, which blocks it.
 */
#include "worker/render/path/transparent.h"

#include "worker/render/path/media.h"
#include "worker/render/path/path.h"
#include "worker/render/path/visible.h"

/* A hit this close to the end of a ray, relative to its length, is the end itself: far more than
 * the rounding of doubles. */
static const double same_point = 0x1p-24;

/* Returns the share of light that goes straight through v, which a ray along d met. If there is any, v becomes a vertex
 * that the path leaves straight on. */
static spectrum pass_straight(const struct path_context *c, struct path_vertex *v, vec3 d)
{
	if (!bsdf_is_passed(v->bsdf) || !path_meets(d, v))
		return spectrum_of(0);
	v->delta = true;
	v->mode = BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT;
	return path_delta_share(c, v);
}

/* Whether v, as reached from `from` along d, has a density that is neither 0 nor infinite. */
static bool are_apart(const struct path_vertex *from, const struct path_vertex *v, vec3 d)
{
	double distance2;
	path_direction(from, v, &distance2);
	return distance2 > 0 && fabs(vec3_dot(v->x.ng, d)) > 0;
}

/* Whether v, met by a ray to y, lies before y and is not y itself. whole: squared length of the ray. */
static bool is_before(const struct path_vertex *v, const struct path_vertex *y, double whole)
{
	double distance2;
	if (y->kind == VERTEX_INFINITE)
		return true;
	path_direction(v, y, &distance2);
	return distance2 > same_point * same_point * whole;
}

bool path_see_through(struct path_context *c, const struct path_vertex *before, const struct path_vertex *z,
		      const struct path_vertex *y, spectrum *left)
{
	double whole;
	const vec3 d = path_direction(z, y, &whole);
	const struct path_vertex *from = z;
	double begin = path_ray_begin(c->w, z, d);
	if (!box_is_met(&c->w->passed, z->x.p, d, y->kind == VERTEX_INFINITE ? INFINITY : sqrt(whole)))
		return false;
	*left = spectrum_of(1);
	for (unsigned n = 0; n < PATH_PASSED_MOST; n++) {
		struct path_vertex *v = &c->passed[n];
		double end = y->kind == VERTEX_INFINITE ? INFINITY : vec3_length(vec3_sub(y->x.p, from->x.p));
		if (!path_extend(c, from, d, begin, end, v) || v->kind != VERTEX_SURFACE || !are_apart(from, v, d) ||
		    !is_before(v, y, whole))
			return false;
		*left = spectrum_mul(*left, pass_straight(c, v, d));
		if (spectrum_is_zero(*left))
			return false;
		v->pdf = n == 0 ? path_pdf(c, before, z, v, TRANSPORT_RADIANCE)
				: path_pdf_passed(c, from, v, TRANSPORT_RADIANCE);
		*left = path_absorb_share(c, from, d, *left, v);
		c->passed_count = n + 1;
		if (path_visible(c, v, y))
			return true;
		from = v;
		begin = 0;
	}
	return false;
}

double path_pdf_passed(const struct path_context *c, const struct path_vertex *at, const struct path_vertex *next,
		       enum transport transport)
{
	double distance2;
	vec3 omega = path_direction(at, next, &distance2);
	if (!(distance2 > 0) || !path_can_be_hit(c, next) || !path_meets(omega, next))
		return 0;
	struct bsdf_point p = world_bsdf_point(&at->x, &c->wl, transport);
	double chance = path_delta_chance(at->bsdf, &p, frame_to_local(&at->x.sh, vec3_neg(omega)), at->mode);
	/* Straight on, both results of path_delta_per_solid are the cosine. */
	double lobe = chance * fabs(vec3_dot(at->x.ng, omega));
	return next->kind == VERTEX_INFINITE ? lobe : lobe * path_jac_solid_from_vertex(next, omega, distance2);
}

double path_passed_ratio(const struct path_vertex *const *v, unsigned first, unsigned last, const double *pdf)
{
	double whole, part;
	path_direction(v[last + 1], v[first - 1], &whole);
	double ratio = whole;
	for (unsigned i = first; i <= last; i++) {
		vec3 w = path_direction(v[i], v[i - 1], &part);
		double cosine = vec3_dot(v[i]->x.ng, w);
		ratio *= cosine * cosine / (part * pdf[i - first]);
	}
	path_direction(v[last + 1], v[last], &part);
	return ratio / part;
}

double path_passed_ratio_in(const struct path_vertex *v, unsigned first, unsigned last, bool over_pdf)
{
	const struct path_vertex *around[PATH_PASSED_MOST + 2];
	double pdf[PATH_PASSED_MOST];
	unsigned n = last - first + 1;
	for (unsigned i = 0; i < n + 2; i++)
		around[i] = &v[first - 1 + i];
	for (unsigned i = 0; i < n; i++)
		pdf[i] = over_pdf ? v[first + i].pdf : 1;
	return path_passed_ratio(around, 1, n, pdf);
}
