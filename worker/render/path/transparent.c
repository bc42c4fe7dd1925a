/* SPDX-License-Identifier: Apache-2.0 */
/*
 * path_trace_passed follows the ray from z to y from one surface to the next, as long as each has a straight lobe, and
 * ends when nothing lies between the last surface and y. An opaque surface blocks the view. So do more than
 * PATH_PASSED_VERTICES_MAX surfaces, which bounds the work; paths through more surfaces are left to sub-paths that pass
 * them one by one. At the very edge of a surface, rounding (geom/accel.h) may let a ray pass although the test of the
 * two ends reports it as blocked; the ray then reaches the surface on which y lies, which blocks it.
 */
#include "worker/render/path/transparent.h"

#include "worker/render/path/media.h"
#include "worker/render/path/path.h"
#include "worker/render/path/visible.h"

/* A hit this close to the end of a ray, relative to its length, is the end itself: far more than
 * the rounding of doubles. */
static const double end_tolerance = 0x1p-24;

/* Returns the share of light that goes straight through v, which a ray along d met. If there is any, v becomes a vertex
 * that the path leaves straight on. */
static spectrum pass_straight(const struct path_context *c, struct path_vertex *v, vec3 d)
{
	if (!bsdf_passes_connections(v->bsdf) || !path_ray_can_meet(d, v))
		return spectrum_constant(0);
	v->is_delta = true;
	v->mode = BSDF_TRANSMIT | BSDF_DELTA | BSDF_STRAIGHT;
	return path_delta_weight(c, v);
}

/* Whether v, as reached from `from` along d, has a density that is neither 0 nor infinite. */
static bool has_finite_pdf(const struct path_vertex *from, const struct path_vertex *v, vec3 d)
{
	double distance2;
	path_direction(from, v, &distance2);
	return distance2 > 0 && fabs(vec3_dot(v->x.ng, d)) > 0;
}

/* Whether v, met by a ray to y, lies before y and is not y itself. */
static bool is_before(const struct path_vertex *v, const struct path_vertex *y, double ray_length2)
{
	double distance2;
	if (y->kind == VERTEX_INFINITE)
		return true;
	path_direction(v, y, &distance2);
	return distance2 > end_tolerance * end_tolerance * ray_length2;
}

bool path_trace_passed(struct path_context *c, const struct path_vertex *before, const struct path_vertex *z,
		       const struct path_vertex *y, spectrum *transmittance)
{
	double ray_length2;
	const vec3 d = path_direction(z, y, &ray_length2);
	const struct path_vertex *from = z;
	double begin = path_ray_t_min(c->w, z, d);
	if (!box_is_hit(&c->w->see_through_bounds, z->x.p, d,
			y->kind == VERTEX_INFINITE ? INFINITY : sqrt(ray_length2)))
		return false;
	*transmittance = spectrum_constant(1);
	for (unsigned n = 0; n < PATH_PASSED_VERTICES_MAX; n++) {
		struct path_vertex *v = &c->passed[n];
		double end = y->kind == VERTEX_INFINITE ? INFINITY : vec3_length(vec3_sub(y->x.p, from->x.p));
		if (!path_extend(c, from, d, begin, end, v) || v->kind != VERTEX_SURFACE ||
		    !has_finite_pdf(from, v, d) || !is_before(v, y, ray_length2))
			return false;
		*transmittance = spectrum_mul(*transmittance, pass_straight(c, v, d));
		if (spectrum_is_zero(*transmittance))
			return false;
		v->pdf = n == 0 ? path_pdf(c, before, z, v, TRANSPORT_RADIANCE)
				: path_pdf_passed(c, from, v, TRANSPORT_RADIANCE);
		*transmittance = path_absorb_weight(c, from, d, *transmittance, v);
		c->passed_count = n + 1;
		if (path_is_visible(c, v, y))
			return true;
		from = v;
		begin = 0;
	}
	return false;
}

double path_pdf_passed(const struct path_context *c, const struct path_vertex *vertex, const struct path_vertex *next,
		       enum transport transport)
{
	double distance2;
	vec3 omega = path_direction(vertex, next, &distance2);
	if (!(distance2 > 0) || !path_can_be_hit(c, next) || !path_ray_can_meet(omega, next))
		return 0;
	struct bsdf_point p = world_bsdf_point(&vertex->x, &c->wl, transport);
	double probability =
		path_delta_probability(vertex->bsdf, &p, frame_to_local(&vertex->x.sh, vec3_neg(omega)), vertex->mode);
	/* Straight on, both results of path_delta_densities are the cosine. */
	double lobe = probability * fabs(vec3_dot(vertex->x.ng, omega));
	return next->kind == VERTEX_INFINITE ? lobe : lobe * path_jac_solid_from_vertex(next, omega, distance2);
}

double path_passed_ratio(const struct path_vertex *const *v, unsigned first, unsigned last, const double *pdf)
{
	double joint_length2, edge_length2;
	path_direction(v[last + 1], v[first - 1], &joint_length2);
	double ratio = joint_length2;
	for (unsigned i = first; i <= last; i++) {
		vec3 w = path_direction(v[i], v[i - 1], &edge_length2);
		double cosine = vec3_dot(v[i]->x.ng, w);
		ratio *= cosine * cosine / (edge_length2 * pdf[i - first]);
	}
	path_direction(v[last + 1], v[last], &edge_length2);
	return ratio / edge_length2;
}

double path_passed_ratio_of_array(const struct path_vertex *v, unsigned first, unsigned last, bool over_pdf)
{
	const struct path_vertex *vertices[PATH_PASSED_VERTICES_MAX + 2];
	double pdf[PATH_PASSED_VERTICES_MAX];
	unsigned n = last - first + 1;
	for (unsigned i = 0; i < n + 2; i++)
		vertices[i] = &v[first - 1 + i];
	for (unsigned i = 0; i < n; i++)
		pdf[i] = over_pdf ? v[first + i].pdf : 1;
	return path_passed_ratio(vertices, 1, n, pdf);
}
