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
 * merging_photons fails if out of memory. It traces fewer light sub-paths than asked if there is no room for more
 * photons; m->paths counts those that were traced. A camera sub-path without a rough surface has no place to merge
 * (merging_walk returns false).
 */
#include "worker/render/path/merging.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/path/connect.h"
#include "worker/render/path/measure.h"
#include "worker/render/path/media.h"

enum { PHOTONS = 4 /* room for this many photons per path */, TICKS = 16 };

/* A photon's disk covers as much of the film as this many samples of the camera. */
static const double samples_wide = 16;
static const double same_normal = 0.9, same_plane = 0.25;

/* A sampler with the wavelength and the time pinned. */
struct pinned_numbers {
	struct sampler_random random;
	double wavelength, time;
};

static const double *block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct pinned_numbers *s = (struct pinned_numbers *)(void *)base;
	double *u = s->random.value[side];
	sampler_fill(s->random.seed, s->random.stream, s->random.index, s->random.step, side, vertex, u);
	if (side == SIDE_CAMERA && vertex == 0)
		u[DIM_WAVELENGTH] = s->wavelength;
	if (side == SIDE_LIGHT && vertex == 0)
		u[DIM_TIME] = s->time;
	return u;
}

static void sampler_init(struct pinned_numbers *s, const struct merging *m, uint64_t seed, uint64_t step,
			 uint64_t index)
{
	sampler_random_init(&s->random, seed, RNG_CHOICE, index, step);
	s->random.base.block = block;
	s->wavelength = m->wavelength;
	s->time = m->time;
}

static bool is_rough(const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && v->bsdf->has_smooth && !(v->bsdf->alpha_mean < PATH_CLASS_ALPHA);
}

static double intensity_of(struct path_context *c, spectrum l)
{
	struct path_sample one; /* its large array of splats stays uninitialised */
	one.count = 0;
	one.intensity = 0;
	path_splat(c, &one, 0, 0, l);
	return one.intensity;
}

/* Returns the factor that media on a sub-path's edge contribute to the density of `before`, the vertex where the edge
 * begins, as generated from its end. */
static double edge_rev(const struct path_context *c, const struct path_edge *e, const struct path_vertex *before)
{
	return EFFECT_IS_ON(c->w, scattering) ? path_edge_pdf(c, e, e->before, before) : 1;
}

/* ---- photons */

static bool is_passed(const struct path_context *c, const struct path_vertex *v)
{
	return path_sees_through(c) && path_is_passed(v);
}

/* Returns the density of a joint that passes v[first .. end - 1] divided by that of drawing them; 1 if there are
 * none. */
static double over_drawn(const struct path_vertex *v, unsigned first, unsigned end)
{
	return first == end ? 1 : path_passed_ratio_in(v, first, end - 1, true);
}

/* For the photon y[s]: returns the density of technique 1, refracted at y[1] .. y[*end - 1], divided by that of drawing
 * these vertices as the light's sub-path did; 0 if there is no such technique. The direction to the camera is not known
 * yet, so the normal of the side that was hit stands for it. */
static double refracted_over_drawn(struct path_context *c, unsigned s, unsigned *end)
{
	const struct path_vertex *v[PATH_MAX_EDGES + 2], *y = c->light;
	struct path_vertex above = y[s];
	if (!path_refracts(c) || !path_is_refracted(&y[1]))
		return 0;
	for (unsigned i = 0; i <= s; i++)
		v[i] = &y[i];
	v[s + 1] = &above;
	above.x.p = vec3_madd(y[s].x.p, vec3_dot(y[s].x.ng, y[s].to_prev) > 0 ? 1 : -1, y[s].x.ng);
	*end = path_refracted_end(v, s + 1);
	return *end && (*end == s || !y[*end].delta) ? path_refracted_over_drawn(c, v, *end) : 0;
}

/* Fills in the sums of struct photon. The techniques by whose densities they are divided need not exist. */
static void sum_fewer(struct path_context *c, unsigned s, struct photon *out)
{
	const struct path_vertex *y = c->light;
	unsigned refracted_end = 0;
	double ratio = 1, ratio_end = 1, ratio_refracted = 1, refracted = refracted_over_drawn(c, s, &refracted_end);
	for (unsigned j = s - 1, end = s; j > 0; j--) { /* technique j joins y[j - 1] to y[end] */
		if (!is_passed(c, &y[j])) {
			ratio_end = ratio;
			end = j;
		}
		if (j == refracted_end)
			ratio_refracted = ratio;
		bool near = end == s;
		if (j == 1 && refracted > 0) {
			double q = ratio_refracted * path_pdf_toward(c, &y[0], y[refracted_end].x.p) / y[0].pdf *
				   refracted;
			*(refracted_end == s ? &out->fewer_through : &out->fewer) += q;
			*(refracted_end == s ? &out->path_through : &out->path) += q;
		} else if (!(j > 1 && y[j - 1].delta) && (near || !y[end].delta) && end - j <= PATH_PASSED_MOST) {
			double toward = j == 1 ? path_pdf_toward(c, &y[0], y[end].x.p) / y[0].pdf : 1,
			       q = (near ? 1 : ratio_end) * toward * over_drawn(y, j, end);
			*(near ? &out->fewer_through : &out->fewer) += q;
			*(near ? &out->path_through : &out->path) += j == 1 ? q : 0;
		}
		ratio *= y[j - 1].pdf_rev / y[j - 1].pdf;
	}
	if (path_can_be_hit(c, &y[0])) {
		out->fewer += ratio;
		out->path += ratio;
	}
}

struct photon photon_of(struct path_context *c, unsigned s)
{
	const struct path_vertex *at = &c->light[s], *prev = at - 1;
	struct photon p = {.p = at->x.p, .ng = at->x.ng, .beta = at->beta, .pdf = at->pdf, .s = s};
	p.edge_rev = edge_rev(c, &at->edge, prev);
	p.prev.kind = prev->kind;
	p.prev.emitter = prev->emitter;
	p.prev.p = prev->x.p;
	p.prev.ng = prev->x.ng;
	p.prev.pdf = prev->pdf;
	p.prev.delta = prev->delta;
	sum_fewer(c, s, &p);
	return p;
}

static void store(struct merging *m, struct path_context *c, unsigned s)
{
	m->photons[m->count] = photon_of(c, s);
	m->tree.nodes[m->count] = (struct point_tree_node){c->light[s].x.p, (uint32_t)m->count};
	m->count++;
}

int merging_photons(struct merging *m, struct path_context *c, uint64_t seed, uint64_t step, uint64_t paths)
{
	double u[4];
	*m = (struct merging){.room = PHOTONS * paths + c->max_depth};
	m->photons = mem_alloc(m->room, sizeof *m->photons);
	m->tree.nodes = mem_alloc(m->room, sizeof *m->tree.nodes);
	if (!m->photons || !m->tree.nodes)
		return -ENOMEM;
	rng_uniform4(seed, RNG_CHOICE, paths, step, 0, u);
	m->wavelength = u[0];
	m->time = u[1];
	c->one_way = false;
	for (; m->paths < paths && m->count + c->max_depth <= m->room; m->paths++) {
		struct pinned_numbers s;
		double film[2];
		if (m->paths % TICKS == 0)
			liveness_tick();
		sampler_init(&s, m, seed, step, m->paths);
		path_walk_camera(c, &s.random.base, 1, film); /* sets the wavelengths and the time of c */
		unsigned n = path_walk_light(c, &s.random.base, c->max_depth);
		for (unsigned i = 2; i < n; i++)
			if (is_rough(&c->light[i]))
				store(m, c, i);
	}
	m->tree.count = m->count;
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

bool merging_walk(const struct merging *m, struct path_context *c, uint64_t seed, uint64_t step, uint64_t index,
		  struct merging_place *out)
{
	struct pinned_numbers s;
	double distance = 0, unused;
	if (index % TICKS == 0)
		liveness_tick();
	c->one_way = false;
	sampler_init(&s, m, seed, step, index);
	unsigned n = path_walk_camera(c, &s.random.base, c->max_depth + 1, out->film);
	for (out->t = 1;; out->t++) {
		const struct path_vertex *v = &c->camera[out->t];
		if (out->t >= n || v->kind != VERTEX_SURFACE)
			return false;
		distance += vec3_length(vec3_sub(v->x.p, v[-1].x.p));
		if (is_rough(v))
			break;
	}
	struct camera room;
	vec3 d = path_direction(&c->camera[0], &c->camera[1], &unused);
	double solid = samples_wide * c->window.width * c->window.height /
		       (camera_jac_film_from_solid(world_camera(c->w, &c->camera[0].x, &room), d) * (double)m->paths);
	out->radius = distance * sqrt(solid / M_PI);
	return true;
}

/* Returns the sum of q over the techniques with more than s light vertices. y: the photon's predecessor. */
static double sum_more(const struct path_context *c, const struct path_vertex *y, unsigned t)
{
	const struct path_vertex *v = c->camera, *z = &v[t];
	double q = 1 / z->pdf, sum = 0;
	for (unsigned i = t; i > 0; i--) { /* joins v[i], made from the light, to v[i - 1], made from the camera */
		const struct path_vertex *next = &v[i - 1];
		unsigned end = i - 1;
		while (end > 0 && is_passed(c, &v[end]))
			end--;
		if (!(i < t && v[i].delta) && !(end > 0 && v[end].delta) && i - 1 - end <= PATH_PASSED_MOST)
			sum += q * over_drawn(v, end + 1, i);
		q *= (i == t ? path_pdf(c, y, z, next, TRANSPORT_IMPORTANCE) * edge_rev(c, &z->edge, next)
			     : next->pdf_rev) /
		     next->pdf;
	}
	return sum;
}

bool merged_of(struct path_context *c, const struct photon *p, unsigned t, struct merged *out)
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
	out->brings = intensity_of(c, l);
	/* q_{s-1}, whether or not such a technique exists */
	double q = path_pdf(c, z - 1, z, &y, TRANSPORT_RADIANCE) * p->edge_rev / (p->pdf * p->prev.pdf),
	       joined = (p->prev.delta ? 0 : 1) + p->fewer_through;
	out->bdpt = out->brings / (q * p->fewer + joined / p->pdf + sum_more(c, &y, t));
	out->path = out->brings / (q * p->path + p->path_through / p->pdf);
	return out->brings > 0;
}

struct gathering {
	const struct merging *m;
	struct path_context *c;
	const struct merging_place *place;
	void (*take)(void *user, const struct merged *found);
	void *user;
};

static void merge(void *user, uint32_t id)
{
	const struct gathering *g = user;
	const struct photon *p = &g->m->photons[id];
	const struct surface_point *z = &g->c->camera[g->place->t].x;
	double r = g->place->radius;
	struct merged found;
	if (vec3_dot(p->ng, z->ng) < same_normal || fabs(vec3_dot(vec3_sub(p->p, z->p), z->ng)) > same_plane * r ||
	    !merged_of(g->c, p, g->place->t, &found))
		return;
	found.brings /= M_PI * r * r * (double)g->m->paths;
	g->take(g->user, &found);
}

void merging_each(const struct merging *m, struct path_context *c, const struct merging_place *place,
		  void (*take)(void *user, const struct merged *found), void *user)
{
	struct gathering g = {m, c, place, take, user};
	point_tree_within(&m->tree, c->camera[place->t].x.p, place->radius, merge, &g);
}

static void add_brought(void *user, const struct merged *m)
{
	*(double *)user += m->brings;
}

double merging_scale(const struct merging *m, struct path_context *c, const struct merging_place *place,
		     const struct brightness *map, double *photons)
{
	double scale = brightness_scale(map, place->film[0], place->film[1]);
	*photons = 0;
	merging_each(m, c, place, add_brought, photons);
	return scale / fmax(1, scale * *photons);
}
