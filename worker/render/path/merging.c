/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A path made by merging is y_0 .. y_{s-1}, z, x_{s+1} .. x_k: a light sub-path hit a surface at y_s, within a radius r
 * of z, where the camera's sub-path met its first rough surface; z takes the place of y_s. Its contribution to the mean
 * of the camera's samples is
 *
 *     f / (p_light(y_0 .. y_s) p_camera(z .. x_k)) / (pi r^2 photons),
 *
 * where p_light(y_0 .. y_s) p_camera(z .. x_k) is the product of the densities of both sub-paths, which contains z
 * twice. The density p_j of technique j of bdpt (path.h), divided by that product, is q_j:
 *
 *     q_{s+1} = 1 / p_camera(z),  q_s = 1 / p_light(y_s),  q_{j+1} / q_j = p_light(x_j) / p_camera(x_j),
 *
 * or 0 where one of the vertices that it joins is specular. So a sample of bdpt that finds the path contributes the
 * product of both sub-paths' throughputs divided by the sum of all q, and one of `path` the product divided by q_0 +
 * q_1. The terms of the light's sub-path alone are summed when the photon is stored.
 *
 * Photons behind an edge or on another surface are recognised by their normals and their distance from z's plane.
 * Surfaces that bend within r and edges of shadows are blurred, but little is lost from a sum over all samples.
 *
 * Where media scatter, events are ordinary vertices of the light's sub-path, and the densities of the edges are those
 * of path/media.h; both sub-paths are assumed to agree about the media. Where media only absorb, the absorption of a
 * photon's light is not counted, because only the complete path says which media it was in.
 *
 * merging_trace_photons fails if out of memory. It traces fewer light sub-paths than asked if there is no room for more
 * photons; m->path_count counts those that were traced. A camera sub-path without a rough surface has no place to merge
 * (merging_walk_camera returns false).
 */
#include "worker/render/path/merging.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/path/connect.h"
#include "worker/render/path/measure.h"
#include "worker/render/path/media.h"

enum { PHOTONS_PER_PATH = 4 /* room for this many photons per path */, TICK_INTERVAL = 16 };

/* A photon's disk covers as much of the film as this many samples of the camera. */
static const double disk_samples = 16;
static const double min_normal_cosine = 0.9, max_plane_distance = 0.25;

/* A sampler with the wavelength and the time pinned. */
struct pinned_random {
	struct sampler_random random;
	double wavelength_u, time;
};

static const double *pinned_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct pinned_random *s = (struct pinned_random *)(void *)base;
	double *u = s->random.values[side];
	sampler_fill_block(s->random.seed, s->random.stream, s->random.index, s->random.step, side, vertex, u);
	if (side == SIDE_CAMERA && vertex == 0)
		u[DIM_WAVELENGTH] = s->wavelength_u;
	if (side == SIDE_LIGHT && vertex == 0)
		u[DIM_TIME] = s->time;
	return u;
}

static void pinned_random_init(struct pinned_random *s, const struct merging *m, uint64_t seed, uint64_t step,
			       uint64_t index)
{
	sampler_random_init(&s->random, seed, RNG_CHOICE, index, step);
	s->random.base.block = pinned_block;
	s->wavelength_u = m->wavelength_u;
	s->time = m->time;
}

static bool is_rough(const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && v->bsdf->has_smooth && !(v->bsdf->mean_alpha < PATH_CLASS_ALPHA);
}

static double intensity_of(struct path_context *c, spectrum l)
{
	struct path_sample sample; /* its large array of splats stays uninitialised */
	sample.splat_count = 0;
	sample.intensity = 0;
	path_sample_add_splat(c, &sample, 0, 0, l);
	return sample.intensity;
}

/* Returns the factor that media on a sub-path's edge contribute to the density of `before`, the vertex where
 * the edge begins, as generated from its end. */
static double edge_pdf_rev(const struct path_context *c, const struct path_edge *e, const struct path_vertex *before)
{
	return EFFECT_IS_ON(c->w, scattering) ? path_edge_pdf(c, e, e->previous_medium, before) : 1;
}

/* ---- photons */

static bool is_see_through(const struct path_context *c, const struct path_vertex *v)
{
	return path_allows_see_through(c) && path_vertex_is_see_through(v);
}

/* Returns the density of a joint that passes v[first .. end - 1] divided by that of drawing them; 1 if there are
 * none. */
static double joint_over_drawn_ratio(const struct path_vertex *v, unsigned first, unsigned end)
{
	return first == end ? 1 : path_passed_ratio_of_array(v, first, end - 1, true);
}

/* For the photon y[s]: returns the density of technique 1, refracted at y[1] .. y[*end - 1], divided by that of drawing
 * these vertices as the light's sub-path did; 0 if there is no such technique. The direction to the camera is not known
 * yet, so the normal of the side that was hit stands for it. */
static double refracted_over_drawn_ratio(struct path_context *c, unsigned s, unsigned *end)
{
	const struct path_vertex *v[PATH_EDGES_MAX + 2], *y = c->light;
	struct path_vertex stand_in = y[s];
	if (!path_allows_refraction(c) || !path_vertex_is_refracting(&y[1]))
		return 0;
	for (unsigned i = 0; i <= s; i++)
		v[i] = &y[i];
	v[s + 1] = &stand_in;
	stand_in.x.p = vec3_madd(y[s].x.p, vec3_dot(y[s].x.ng, y[s].to_prev) > 0 ? 1 : -1, y[s].x.ng);
	*end = path_refracted_end(v, s + 1);
	return *end && (*end == s || !y[*end].is_delta) ? path_refracted_over_drawn_ratio(c, v, *end) : 0;
}

/* Fills in the sums of struct photon. The techniques by whose densities they are divided need not exist. */
static void sum_fewer_light_vertices(struct path_context *c, unsigned s, struct photon *out)
{
	const struct path_vertex *y = c->light;
	unsigned refracted_end = 0;
	double ratio = 1, ratio_end = 1, ratio_refracted = 1,
	       refracted = refracted_over_drawn_ratio(c, s, &refracted_end);
	for (unsigned j = s - 1, end = s; j > 0; j--) { /* technique j joins y[j - 1] to y[end] */
		if (!is_see_through(c, &y[j])) {
			ratio_end = ratio;
			end = j;
		}
		if (j == refracted_end)
			ratio_refracted = ratio;
		bool joins_photon = end == s;
		if (j == 1 && refracted > 0) {
			double q = ratio_refracted * path_pdf_toward(c, &y[0], y[refracted_end].x.p) / y[0].pdf *
				   refracted;
			*(refracted_end == s ? &out->fewer_passing_sum : &out->fewer_sum) += q;
			*(refracted_end == s ? &out->path_passing_sum : &out->path_sum) += q;
		} else if (!(j > 1 && y[j - 1].is_delta) && (joins_photon || !y[end].is_delta) &&
			   end - j <= PATH_PASSED_VERTICES_MAX) {
			double toward = j == 1 ? path_pdf_toward(c, &y[0], y[end].x.p) / y[0].pdf : 1,
			       q = (joins_photon ? 1 : ratio_end) * toward * joint_over_drawn_ratio(y, j, end);
			*(joins_photon ? &out->fewer_passing_sum : &out->fewer_sum) += q;
			*(joins_photon ? &out->path_passing_sum : &out->path_sum) += j == 1 ? q : 0;
		}
		ratio *= y[j - 1].pdf_rev / y[j - 1].pdf;
	}
	if (path_can_be_hit(c, &y[0])) {
		out->fewer_sum += ratio;
		out->path_sum += ratio;
	}
}

struct photon photon_from_vertex(struct path_context *c, unsigned s)
{
	const struct path_vertex *vertex = &c->light[s], *prev = vertex - 1;
	struct photon p = {.p = vertex->x.p, .ng = vertex->x.ng, .beta = vertex->beta, .pdf = vertex->pdf, .s = s};
	p.edge_pdf_rev = edge_pdf_rev(c, &vertex->edge, prev);
	p.prev.kind = prev->kind;
	p.prev.emitter = prev->emitter;
	p.prev.p = prev->x.p;
	p.prev.ng = prev->x.ng;
	p.prev.pdf = prev->pdf;
	p.prev.is_delta = prev->is_delta;
	sum_fewer_light_vertices(c, s, &p);
	return p;
}

static void store_photon(struct merging *m, struct path_context *c, unsigned s)
{
	m->photons[m->photon_count] = photon_from_vertex(c, s);
	m->tree.nodes[m->photon_count] = (struct point_tree_node){c->light[s].x.p, (uint32_t)m->photon_count};
	m->photon_count++;
}

int merging_trace_photons(struct merging *m, struct path_context *c, uint64_t seed, uint64_t step, uint64_t paths)
{
	double u[4];
	*m = (struct merging){.photon_capacity = PHOTONS_PER_PATH * paths + c->max_depth};
	m->photons = mem_alloc(m->photon_capacity, sizeof *m->photons);
	m->tree.nodes = mem_alloc(m->photon_capacity, sizeof *m->tree.nodes);
	if (!m->photons || !m->tree.nodes)
		return -ENOMEM;
	rng_uniform4(seed, RNG_CHOICE, paths, step, 0, u);
	m->wavelength_u = u[0];
	m->time = u[1];
	c->is_unidirectional = false;
	for (; m->path_count < paths && m->photon_count + c->max_depth <= m->photon_capacity; m->path_count++) {
		struct pinned_random s;
		double film[2];
		if (m->path_count % TICK_INTERVAL == 0)
			liveness_tick();
		pinned_random_init(&s, m, seed, step, m->path_count);
		path_walk_camera(c, &s.random.base, 1, film); /* sets the wavelengths and the time of c */
		unsigned n = path_walk_light(c, &s.random.base, c->max_depth);
		for (unsigned i = 2; i < n; i++)
			if (is_rough(&c->light[i]))
				store_photon(m, c, i);
	}
	m->tree.count = m->photon_count;
	point_tree_build(&m->tree);
	return 0;
}

void merging_fini(struct merging *m)
{
	mem_free(m->photons);
	mem_free(m->tree.nodes);
	*m = (struct merging){0};
}

/* ---- merging */

bool merging_walk_camera(const struct merging *m, struct path_context *c, uint64_t seed, uint64_t step, uint64_t index,
			 struct merging_point *out)
{
	struct pinned_random s;
	double distance = 0, unused;
	if (index % TICK_INTERVAL == 0)
		liveness_tick();
	c->is_unidirectional = false;
	pinned_random_init(&s, m, seed, step, index);
	unsigned n = path_walk_camera(c, &s.random.base, c->max_depth + 1, out->film);
	for (out->vertex = 1;; out->vertex++) {
		const struct path_vertex *v = &c->camera[out->vertex];
		if (out->vertex >= n || v->kind != VERTEX_SURFACE)
			return false;
		distance += vec3_length(vec3_sub(v->x.p, v[-1].x.p));
		if (is_rough(v))
			break;
	}
	struct camera storage;
	vec3 d = path_direction(&c->camera[0], &c->camera[1], &unused);
	double solid = disk_samples * c->window.width * c->window.height /
		       (camera_jac_film_from_solid(world_camera_at(c->w, &c->camera[0].x, &storage), d) *
			(double)m->path_count);
	out->radius = distance * sqrt(solid / M_PI);
	return true;
}

/* Returns the sum of q over the techniques with more than s light vertices. y: the photon's predecessor. */
static double sum_more_light_vertices(const struct path_context *c, const struct path_vertex *y, unsigned t)
{
	const struct path_vertex *v = c->camera, *z = &v[t];
	double q = 1 / z->pdf, sum = 0;
	for (unsigned i = t; i > 0; i--) { /* joins v[i], made from the light, to v[i - 1], made from the camera */
		const struct path_vertex *next = &v[i - 1];
		unsigned end = i - 1;
		while (end > 0 && is_see_through(c, &v[end]))
			end--;
		if (!(i < t && v[i].is_delta) && !(end > 0 && v[end].is_delta) &&
		    i - 1 - end <= PATH_PASSED_VERTICES_MAX)
			sum += q * joint_over_drawn_ratio(v, end + 1, i);
		q *= (i == t ? path_pdf(c, y, z, next, TRANSPORT_IMPORTANCE) * edge_pdf_rev(c, &z->edge, next)
			     : next->pdf_rev) /
		     next->pdf;
	}
	return sum;
}

bool merging_merge_photon(struct path_context *c, const struct photon *p, unsigned t, struct merged_path *out)
{
	const struct path_vertex *z = &c->camera[t];
	struct path_vertex y = {.kind = p->prev.kind, .emitter = p->prev.emitter};
	double distance2;
	y.x.p = p->prev.p;
	y.x.ng = p->prev.ng;
	vec3 to_light = path_direction(z, &y, &distance2);
	if (!(distance2 > 0) || t + p->s > c->max_depth)
		return false;
	spectrum l = spectrum_mul(spectrum_mul(z->beta, p->beta), path_scatter(c, z, z->to_prev, to_light));
	out->contribution = intensity_of(c, l);
	/* q_{s-1}, whether or not such a technique exists */
	double q = path_pdf(c, z - 1, z, &y, TRANSPORT_RADIANCE) * p->edge_pdf_rev / (p->pdf * p->prev.pdf),
	       joined = (p->prev.is_delta ? 0 : 1) + p->fewer_passing_sum;
	out->bdpt_contribution =
		out->contribution / (q * p->fewer_sum + joined / p->pdf + sum_more_light_vertices(c, &y, t));
	out->path_contribution = out->contribution / (q * p->path_sum + p->path_passing_sum / p->pdf);
	return out->contribution > 0;
}

struct gathering {
	const struct merging *m;
	struct path_context *c;
	const struct merging_point *point;
	void (*visit)(void *user, const struct merged_path *found);
	void *user;
};

static void merge_near_photon(void *user, uint32_t id)
{
	const struct gathering *g = user;
	const struct photon *p = &g->m->photons[id];
	const struct surface_point *z = &g->c->camera[g->point->vertex].x;
	double r = g->point->radius;
	struct merged_path merged;
	if (vec3_dot(p->ng, z->ng) < min_normal_cosine ||
	    fabs(vec3_dot(vec3_sub(p->p, z->p), z->ng)) > max_plane_distance * r ||
	    !merging_merge_photon(g->c, p, g->point->vertex, &merged))
		return;
	merged.contribution /= M_PI * r * r * (double)g->m->path_count;
	g->visit(g->user, &merged);
}

void merging_visit_paths(const struct merging *m, struct path_context *c, const struct merging_point *point,
			 void (*visit)(void *user, const struct merged_path *found), void *user)
{
	struct gathering g = {m, c, point, visit, user};
	point_tree_visit_within(&m->tree, c->camera[point->vertex].x.p, point->radius, merge_near_photon, &g);
}

static void add_contribution(void *user, const struct merged_path *m)
{
	*(double *)user += m->contribution;
}

double merging_inverse_brightness(const struct merging *m, struct path_context *c, const struct merging_point *point,
				  const struct brightness *map, double *photons)
{
	double scale = brightness_inverse_at(map, point->film[0], point->film[1]);
	*photons = 0;
	merging_visit_paths(m, c, point, add_contribution, photons);
	return scale / fmax(1, scale * *photons);
}
