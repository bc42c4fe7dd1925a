/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Refracted connections: which are tried, what they contribute, and which paths of other techniques they could have
 * made. path_context.refract performs the walk itself (halfvec/refract.c).
 *
 * path_trace_refracted asks for the refracted path between z and y and fills in its vertices as a camera sub-path would
 * have. It fails where the straight line meets nothing that refracts, where the walk does not converge, or where a lobe
 * at one of the vertices has weight zero.
 */
#include "worker/render/path/refracted.h"

#include "worker/render/path/media.h"
#include "worker/render/path/next_event.h"
#include "worker/render/path/path.h"

/* Connections are refracted where points on emitters are drawn at least this many times as densely as a sub-path that
 * goes straight on from z would find them. */
static const double min_density_ratio = 8;
/* Two walks end at the same path if corresponding vertices are closer than this times the length of the preceding
 * edge. */
static const double same_vertex_tolerance = 1e-5;

bool path_should_refract(const struct path_context *c, const struct path_vertex *before, const struct path_vertex *z,
			 const struct path_vertex *y, double pdf_toward, spectrum f)
{
	return !spectrum_is_zero(f) && pdf_toward >= min_density_ratio * path_pdf(c, before, z, y, TRANSPORT_RADIANCE);
}

double path_pdf_refracted(const struct path_context *c, const struct path_vertex *prev,
			  const struct path_vertex *vertex, const struct path_vertex *next, enum transport transport)
{
	double distance2, unused, to_light, to_camera;
	vec3 back = path_direction(vertex, prev, &unused), omega = path_direction(vertex, next, &distance2);
	if (!(distance2 > 0) || !path_can_be_hit(c, next) || !path_ray_can_meet(omega, next))
		return 0;
	struct bsdf_point p = world_bsdf_point(&vertex->x, &c->wl, transport);
	double probability =
		path_delta_probability(vertex->bsdf, &p, frame_to_local(&vertex->x.sh, back), vertex->mode);
	bool from_camera = transport == TRANSPORT_RADIANCE;
	vec3 camera = from_camera ? back : omega, light = from_camera ? omega : back;
	path_delta_densities(&vertex->x, light, camera, path_eta(vertex, &c->wl, camera), &to_light, &to_camera);
	double lobe = probability * (from_camera ? to_light : to_camera);
	return next->kind == VERTEX_INFINITE ? lobe : lobe * path_jac_solid_from_vertex(next, omega, distance2);
}

double path_refracted_ratio(const struct path_vertex *const *v, unsigned count, double log_transfer, const double *pdf)
{
	double ratio = exp(-log_transfer), distance2;
	for (unsigned i = 1; i <= count; i++) {
		vec3 w = path_direction(v[i], v[i - 1], &distance2);
		ratio *= path_geometry_term(v[i], v[i - 1], w, distance2) / pdf[i - 1];
	}
	return ratio;
}

/* Whether the walk's vertices are v[count] .. v[1]. */
static bool is_same_path(const struct path_refraction *r, const struct path_vertex *const *v, unsigned count)
{
	if (r->count != count)
		return false;
	for (unsigned i = 0; i < count; i++) {
		const struct path_vertex *vertex = v[count - i];
		vec3 offset = vec3_sub(r->v[i].x.p, vertex->x.p), edge = vec3_sub(vertex->x.p, v[count - i + 1]->x.p);
		if (vec3_dot(offset, offset) > same_vertex_tolerance * same_vertex_tolerance * vec3_dot(edge, edge))
			return false;
	}
	return true;
}

static bool points_are_equal(vec3 a, vec3 b)
{
	return a.x == b.x && a.y == b.y && a.z == b.z;
}

/* Returns the refracted path between z and y, from the cache if it is the one computed last; NULL if there is none. */
static const struct path_refraction *look_up_refraction(struct path_context *c, const struct path_vertex *z,
							const struct path_vertex *y)
{
	struct path_refraction_cache *k = &c->refraction_cache;
	if (!k->is_filled || !points_are_equal(k->z, z->x.p) || !points_are_equal(k->y, y->x.p) ||
	    k->time != z->x.prim.time || k->nm != c->wl.nm[0]) {
		k->is_filled = true;
		k->z = z->x.p;
		k->y = y->x.p;
		k->time = z->x.prim.time;
		k->nm = c->wl.nm[0];
		k->has_refraction = c->refract(c, z, y, &k->refraction);
	}
	return k->has_refraction ? &k->refraction : NULL;
}

unsigned path_refracted_end(const struct path_vertex *const *v, unsigned k)
{
	unsigned end = 1;
	while (end < k && path_vertex_is_refracting(v[end]))
		end++;
	return end > 1 && end - 1 <= PATH_REFRACTED_VERTICES_MAX && end < k && v[end]->kind == VERTEX_SURFACE ? end : 0;
}

bool path_is_made_by_refraction(struct path_context *c, const struct path_vertex *const *v, unsigned end,
				double *log_transfer)
{
	const struct path_vertex *z = v[end];
	double unused;
	vec3 to_camera = path_direction(z, v[end + 1], &unused), straight = path_direction(z, v[0], &unused);
	if (!path_scatters_smoothly(z) || !path_should_refract(c, v[end + 1], z, v[0], path_pdf_toward(c, v[0], z->x.p),
							       path_scatter(c, z, to_camera, straight)))
		return false;
	const struct path_refraction *r = look_up_refraction(c, z, v[0]);
	if (!r || !is_same_path(r, v, end - 1))
		return false;
	*log_transfer = r->log_transfer;
	return true;
}

double path_refracted_over_drawn_ratio(struct path_context *c, const struct path_vertex *const *v, unsigned end)
{
	double pdf[PATH_REFRACTED_VERTICES_MAX], log_transfer;
	if (!path_is_made_by_refraction(c, v, end, &log_transfer))
		return 0;
	for (unsigned i = 1; i < end; i++)
		pdf[i - 1] = v[i]->pdf;
	return path_refracted_ratio(v, end - 1, log_transfer, pdf);
}

/* Returns the weight of the specular lobe at v, which continues to `next`; zero if there is no such lobe or the shading
 * normal disagrees about a side. */
static spectrum specular_lobe_weight(const struct path_context *c, const struct path_vertex *v,
				     const struct path_vertex *next)
{
	double unused;
	bool agree = path_sides_agree(&v->x, v->to_prev) && path_sides_agree(&v->x, path_direction(v, next, &unused));
	return agree ? path_delta_weight(c, v) : spectrum_constant(0);
}

bool path_trace_refracted(struct path_context *c, const struct path_vertex *before, const struct path_vertex *z,
			  const struct path_vertex *y, spectrum *transmittance)
{
	struct path_refraction r;
	double unused;
	if (!c->refract(c, z, y, &r))
		return false;
	*transmittance = spectrum_constant(1);
	for (unsigned i = 0; i < r.count; i++) {
		struct path_vertex *v = &c->passed[i];
		const struct path_vertex *prev = i > 0 ? v - 1 : z;
		*v = r.v[i];
		*transmittance =
			spectrum_mul(*transmittance, specular_lobe_weight(c, v, i + 1 < r.count ? &r.v[i + 1] : y));
		if (spectrum_is_zero(*transmittance))
			return false;
		v->pdf = i == 0 ? path_pdf(c, before, z, v, TRANSPORT_RADIANCE)
				: path_pdf_refracted(c, i > 1 ? v - 2 : z, prev, v, TRANSPORT_RADIANCE);
		*transmittance = path_absorb_weight(c, prev, path_direction(prev, v, &unused), *transmittance, v);
	}
	c->passed_count = r.count;
	c->log_transfer = r.log_transfer;
	return true;
}
