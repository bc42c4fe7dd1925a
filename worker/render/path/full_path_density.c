/* SPDX-License-Identifier: Apache-2.0 */
/* The contribution of a whole path and the densities of all techniques that could have made it: the explicit products,
 * in logarithms. Proposals in half vector space cancel most of these factors and never compute them. */
#include "worker/render/path/full_path_density.h"

#include "worker/render/path/measure.h"
#include "worker/render/path/media.h"

double full_path_log_f(const struct path_context *c, struct full_path *x)
{
	unsigned k = x->edges;
	struct scaled_product p = PRODUCT_ONE;
	double log_geometry = 0;
	scaled_product_mul(&p, full_path_eval_f(c, x, 0));
	for (unsigned j = 1; j < k; j++) {
		scaled_product_mul(&p, full_path_eval_f(c, x, j));
		const struct path_vertex *v = &x->v[j];
		/* The measure is that of the direction towards the light, projected on the geometric normal. */
		if (!v->is_delta && v->kind != VERTEX_MEDIUM)
			log_geometry +=
				log(full_path_cosine_to_light(x, j) / fabs(vec3_dot(v->x.ng, x->edge[j - 1].w)));
	}
	full_path_attenuate(c->w, x, &p);
	for (unsigned e = 0; e < k; e++) {
		const struct full_path_edge *g = &x->edge[e];
		log_geometry += log(path_cosine(&x->v[e], g->w) * path_cosine(&x->v[e + 1], g->w) / g->distance2);
	}
	struct camera storage;
	log_geometry += log(
		camera_jac_film_from_solid(world_camera_at(c->w, &x->v[k].x, &storage), vec3_neg(x->edge[k - 1].w)));
	return scaled_product_log_intensity(c, x, &p) + log_geometry;
}

/* Sets the densities generated at the specular vertex v[j]: *to_light of v[j - 1] from the camera's side and *to_camera
 * of v[j + 1] from the light's side. */
static void specular_densities(const struct full_path *x, unsigned j, double *to_light, double *to_camera)
{
	const struct path_vertex *v = &x->v[j];
	vec3 o = x->edge[j].w, i = vec3_neg(x->edge[j - 1].w), wi;
	double probability = 0, light, camera;
	if (spectrum_is_zero(full_path_specular_weight(x, j, &wi, &probability)))
		probability = 0;
	double chance_from_light = probability;
	if (v->bsdf->is_nonreciprocal) {
		struct bsdf_point p = world_bsdf_point(&v->x, &x->wl, TRANSPORT_IMPORTANCE);
		chance_from_light = path_delta_probability(v->bsdf, &p, frame_to_local(&v->x.sh, i), v->mode);
	}
	path_delta_densities(&v->x, i, o, full_path_eta(x, j), &light, &camera);
	*to_light = path_ray_can_meet(i, &x->v[j - 1])
			    ? probability * light * path_cosine(&x->v[j - 1], i) / x->edge[j - 1].distance2
			    : 0;
	*to_camera = path_ray_can_meet(o, &x->v[j + 1])
			     ? chance_from_light * camera * path_cosine(&x->v[j + 1], o) / x->edge[j].distance2
			     : 0;
}

/* Multiplies the densities of both ends of each edge by the density of an event at that end, or the
 * probability that the edge has none: pdf of v[e] as generated from the camera's side, pdf_rev of v[e + 1] as
 * generated from the light's side. */
static void multiply_by_media(const struct path_context *c, struct path_vertex *v, unsigned edges)
{
	for (unsigned e = 0; e < edges; e++) {
		const struct path_edge *edge = &v[e].edge;
		v[e].pdf *= path_edge_pdf(c, edge, edge->medium, &v[e]);
		if (e + 1 < edges)
			v[e + 1].pdf_rev *= path_edge_pdf(c, edge, edge->previous_medium, &v[e + 1]);
	}
}

static void fill_densities(struct path_context *c, struct full_path *x)
{
	unsigned k = x->edges;
	struct path_vertex *v = x->v;
	c->wl = x->wl;
	v[k].pdf = v[k].pdf_rev = 1;
	v[k - 1].pdf = path_pdf(c, NULL, &v[k], &v[k - 1], TRANSPORT_RADIANCE);
	v[0].pdf_rev = path_pdf_emitter(c, &v[0]);
	if (k >= 2)
		v[1].pdf_rev = path_pdf(c, NULL, &v[0], &v[1], TRANSPORT_IMPORTANCE);
	for (unsigned j = 1; j < k; j++) {
		double to_light, to_camera;
		if (v[j].is_delta) {
			specular_densities(x, j, &to_light, &to_camera);
		} else {
			to_light = path_pdf(c, &v[j + 1], &v[j], &v[j - 1], TRANSPORT_RADIANCE);
			to_camera = j + 1 < k ? path_pdf(c, &v[j - 1], &v[j], &v[j + 1], TRANSPORT_IMPORTANCE) : 1;
		}
		v[j - 1].pdf = to_light;
		if (j + 1 < k)
			v[j + 1].pdf_rev = to_camera;
	}
	if (EFFECT_IS_ON(c->w, scattering))
		multiply_by_media(c, v, k);
	if (!path_can_be_hit(c, &v[0]))
		v[0].pdf = 0;
}

/* Returns the logarithm of the density with which technique 1 makes x by a refracted joint; -INFINITY if it does not.
 * from_camera[i]: log density of v[i .. k] from the camera's side. */
static double log_pdf_refracted(struct path_context *c, const struct full_path *x, const double *from_camera)
{
	const struct path_vertex *v[FULL_PATH_VERTICES_MAX];
	double pdf[PATH_REFRACTED_VERTICES_MAX], log_transfer;
	if (!path_allows_refraction(c) || !path_vertex_is_refracting(&x->v[1]))
		return -INFINITY;
	for (unsigned i = 0; i <= x->edges; i++)
		v[i] = &x->v[i];
	unsigned end = path_refracted_end(v, x->edges);
	if (!end || v[end]->is_delta || !path_is_made_by_refraction(c, v, end, &log_transfer))
		return -INFINITY;
	for (unsigned i = 1; i < end; i++)
		pdf[i - 1] = 1;
	return from_camera[end] + log(path_pdf_toward(c, v[0], v[end]->x.p)) +
	       log(path_refracted_ratio(v, end - 1, log_transfer, pdf));
}

void full_path_log_technique_pdfs(struct path_context *c, struct full_path *x, double *log_pdf)
{
	unsigned k = x->edges;
	const struct path_vertex *v = x->v;
	fill_densities(c, x);
	unsigned max_light = full_path_max_light_vertices(c, x);
	double from_camera[FULL_PATH_VERTICES_MAX]; /* log density of v[s .. k] from the camera's side */
	from_camera[k] = 0;
	for (unsigned s = k; s > 0; s--)
		from_camera[s - 1] = from_camera[s] + log(v[s - 1].pdf);
	log_pdf[0] = from_camera[0];
	double light = 0; /* log density of v[0 .. s - 1] from the light's side */
	for (unsigned s = 1; s <= k; s++) {
		light += log(v[s - 1].pdf_rev);
		log_pdf[s] = s == 1 ? log_pdf_refracted(c, x, from_camera) : -INFINITY;
		if (s > max_light || !full_path_can_join(c, x, s))
			continue;
		unsigned end = s + full_path_passed_count(c, x, s);
		log_pdf[s] = from_camera[end] + (s == 1 ? log(path_pdf_toward(c, &v[0], v[end].x.p)) : light);
		if (end > s)
			log_pdf[s] += log(path_passed_ratio_of_array(v, s, end - 1, false));
	}
}
