/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The paths that a pair of sub-paths makes, as candidates with their contributions (see ensemble.h).
 *
 * ensemble_draw draws the two sub-paths and connects them by every technique (s, t), s vertices from the light and t
 * from the camera. The intensity of a candidate is that of its contribution, weighted by multiple importance sampling
 * (Veach 1997) and, where lengths are limited at random, divided by survival(s) survival(t), with survival(n) = min(1,
 * (5/n)^2). ensemble_choose takes candidate i with probability intensity_i / total. ensemble_draw_containing draws a
 * technique of the given path x with probability p_s(x) / sum_j p_j(x), splits x there and continues both parts at
 * random; x itself contributes f(x) / sum_j p_j(x). Nothing is reported as an error: paths without a contribution are
 * left out, and ensemble_choose returns false where no candidate is left.
 */
#include "worker/render/path/ensemble.h"

#include "worker/render/math/logsum.h"
#include "worker/render/path/full_path_density.h"
#include "worker/render/path/media.h"

/* A sub-path has at least this many vertices, and n > 5 or more with probability (5/n)^2: at most 10 on average
 * where nothing else ends it. With a fixed probability of continuing, the weights of long paths would grow as
 * fast as their light decays, or faster between mirrors and in fibres, where it hardly decays: rare samples
 * would hold most of the light. */
enum { GUARANTEED_VERTICES = 5 };

/* Draws a number of vertices from max(min, GUARANTEED_VERTICES) to `max`: n or more with probability
 * survival_probability(n) / survival_probability(min). */
static unsigned draw_vertex_count(double u, unsigned min, unsigned max)
{
	unsigned start = min > GUARANTEED_VERTICES ? min : GUARANTEED_VERTICES;
	if (max <= start)
		return start;
	return (unsigned)fmin(floor(start / sqrt(1 - u)), max);
}

struct ensemble_lengths ensemble_draw_lengths(const struct path_context *c, const double u[2], unsigned camera,
					      unsigned light)
{
	return (struct ensemble_lengths){draw_vertex_count(u[0], camera, c->max_depth + 1),
					 draw_vertex_count(u[1], light, c->max_depth), true};
}

struct ensemble_lengths ensemble_max_lengths(const struct path_context *c)
{
	return (struct ensemble_lengths){c->max_depth + 1, c->max_depth, false};
}

/* The probability that a sub-path may have n vertices or more. */
static double survival_probability(unsigned n)
{
	return n > GUARANTEED_VERTICES ? (double)(GUARANTEED_VERTICES * GUARANTEED_VERTICES) / ((double)n * n) : 1;
}

/* Returns the contribution of joining s vertices of the light's sub-path to t of the camera's. */
static double candidate_intensity(struct path_context *c, unsigned s, unsigned t)
{
	double film[2];
	struct path_sample sample; /* its large array of splats stays uninitialised */
	sample.splat_count = 0;
	sample.intensity = 0;
	spectrum l = path_connect(c, s, t, PATH_EDGES_MAX, film);
	if (!spectrum_is_zero(l))
		path_sample_add_splat(c, &sample, 0, 0, l);
	return sample.intensity;
}

/* Computes the candidates of two sub-paths with these numbers of vertices. randomized: lengths were limited at random.
 * known: NULL, or a candidate whose contribution is already known. */
static void gather_candidates(struct path_context *c, unsigned camera, unsigned light, bool randomized,
			      const struct candidate *known, struct ensemble *out)
{
	out->total = 0;
	out->count = 0;
	unsigned max_light = light > 1 ? light : 1, max_edges = camera + max_light - 1;
	for (unsigned n = path_joints_have_vertices(c) ? 2 : c->min_depth + 1;
	     n <= c->max_depth + 1 && n <= max_edges + 1; n++)
		for (unsigned s = n > camera ? n - camera : 0; s < n && s <= max_light; s++) {
			unsigned t = n - s;
			if ((t == 1 && s < 2) || !path_may_connect(c, s, t))
				continue;
			bool is_known = known && known->s == s && known->edges + 1 - known->passed_count == n;
			double i = is_known ? known->intensity : candidate_intensity(c, s, t);
			unsigned passed = is_known ? known->passed_count : c->passed_count;
			if (randomized)
				i /= survival_probability(t) * survival_probability(s);
			if (!(i > 0))
				continue;
			out->candidates[out->count++] = (struct candidate){i, s, passed, n - 1 + passed};
			out->total += i;
		}
}

void ensemble_draw(struct path_context *c, struct sampler *s, const struct ensemble_lengths *n, struct ensemble *out)
{
	double film[2];
	c->is_unidirectional = false;
	unsigned camera = path_walk_camera(c, s, n->max_camera, film), light = path_walk_light(c, s, n->max_light);
	gather_candidates(c, camera, light, n->is_randomized, NULL, out);
}

bool ensemble_choose(struct path_context *c, const struct ensemble *e, double u, struct full_path *x)
{
	if (e->count == 0)
		return false;
	double remaining = u * e->total;
	unsigned i = 0;
	while (i + 1 < e->count && remaining >= e->candidates[i].intensity)
		remaining -= e->candidates[i++].intensity;
	return full_path_from_subpaths(c, e->candidates[i].s, e->candidates[i].passed_count, e->candidates[i].edges, x);
}

/* Returns the throughput at the end of edge e: beta, the throughput at its start, times the scattering f at v[start],
 * times the geometry term, divided by the density pdf. */
static spectrum extend_throughput(const struct path_context *c, const struct full_path *x, spectrum beta, spectrum f,
				  unsigned start, unsigned e, double pdf)
{
	const struct path_vertex *v = &x->v[start];
	const struct full_path_edge *g = &x->edge[e];
	double geometry = path_cosine(&x->v[e], g->w) * path_cosine(&x->v[e + 1], g->w) / g->distance2;
	if (start > 0 && !v->is_delta && v->kind != VERTEX_MEDIUM)
		geometry *= full_path_cosine_to_light(x, start) / fabs(vec3_dot(v->x.ng, x->edge[start - 1].w));
	spectrum throughput = spectrum_scale(geometry / pdf, spectrum_mul(beta, f));
	return EFFECT_IS_ON(c->w, scattering) ? spectrum_mul(throughput, g->transmittance) : throughput;
}

static void set_next_event_numbers(struct sampler *s, enum sampler_side side, unsigned vertex, struct path_vertex *v)
{
	const double *u = s->block(s, side, vertex);
	for (int i = 0; i < 3; i++)
		v->next_event[i] = u[DIM_NEXT_EVENT + i];
}

/* Makes x_k .. x_{k-t+1} the camera's sub-path; t >= 2. The wavelengths are those of x. */
static void set_camera_subpath(struct path_context *c, struct sampler *s, struct full_path *x, unsigned t)
{
	unsigned k = x->edges;
	struct path_vertex *v = c->camera;
	for (unsigned i = 0; i < t; i++) {
		v[i] = x->v[k - i];
		set_next_event_numbers(s, SIDE_CAMERA, i, &v[i]);
		if (v[i].kind == VERTEX_EMITTER)
			v[i].kind = VERTEX_SURFACE;
	}
	v[0].beta = spectrum_constant(1);
	v[0].edge.medium = c->w->camera_medium;
	v[1].beta = spectrum_constant(c->window.width * c->window.height);
	if (EFFECT_IS_ON(c->w, scattering))
		v[1].beta = spectrum_scale(v[1].beta.v[0] / path_edge_pdf(c, &v[1].edge, v[1].edge.medium, &v[1]),
					   x->edge[k - 1].transmittance);
	else if (EFFECT_IS_ON(c->w, absorption))
		path_absorb(c, &v[0], vec3_neg(x->edge[k - 1].w), &v[1]);
	for (unsigned i = 2; i < t; i++) {
		v[i].beta = extend_throughput(c, x, v[i - 1].beta, full_path_eval_f(c, x, k - i + 1), k - i + 1, k - i,
					      v[i].pdf);
		if (EFFECT_IS_ON(c->w, absorption) && !EFFECT_IS_ON(c->w, scattering))
			path_absorb(c, &v[i - 1], vec3_neg(x->edge[k - i].w), &v[i]);
	}
	v[t - 1].is_delta = false;
}

/* Turns the edge of x_i, which refers to x_{i+1} in a whole path, into the one that comes from x_{i-1}. */
static void reverse_edge(const struct full_path *x, unsigned i, struct path_vertex *v)
{
	v->to_prev = vec3_neg(x->edge[i - 1].w);
	v->edge = x->v[i - 1].edge;
	v->edge.medium = x->v[i - 1].edge.previous_medium;
	v->edge.previous_medium = x->v[i - 1].edge.medium;
}

/* Makes x_0 .. x_{s-1} the light's sub-path; s >= 2. */
static void set_light_subpath(struct path_context *c, struct sampler *sampler, struct full_path *x, unsigned s)
{
	struct path_vertex *v = c->light;
	for (unsigned i = 0; i < s; i++) {
		v[i] = x->v[i];
		v[i].pdf = x->v[i].pdf_rev;
		v[i].pdf_rev = x->v[i].pdf;
		if (i > 0)
			reverse_edge(x, i, &v[i]);
		set_next_event_numbers(sampler, SIDE_LIGHT, i, &v[i]);
	}
	v[0].beta = spectrum_constant(1 / v[0].pdf);
	for (unsigned i = 1; i < s; i++)
		v[i].beta =
			extend_throughput(c, x, v[i - 1].beta, full_path_eval_f(c, x, i - 1), i - 1, i - 1, v[i].pdf);
	v[s - 1].is_delta = false;
}

/* A sampler whose first blocks are those of path x: the camera's has x's wavelength and point of the aperture, the
 * light's has x's time. All other numbers come from `inner`. */
struct pinned_sampler {
	struct sampler base;
	struct sampler *inner;
	double block[SAMPLER_BLOCK_SIZE], wavelength_u, aperture[2], time;
};

static const double *pinned_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct pinned_sampler *p = (struct pinned_sampler *)(void *)base;
	const double *u = p->inner->block(p->inner, side, vertex);
	if (vertex != 0)
		return u;
	for (int i = 0; i < SAMPLER_BLOCK_SIZE; i++)
		p->block[i] = u[i];
	if (side == SIDE_LIGHT) {
		p->block[DIM_TIME] = p->time;
		return p->block;
	}
	p->block[DIM_WAVELENGTH] = p->wavelength_u;
	p->block[DIM_APERTURE_U] = p->aperture[0];
	p->block[DIM_APERTURE_V] = p->aperture[1];
	return p->block;
}

static unsigned walk_pinned_camera(struct path_context *c, struct sampler *s, const struct full_path *x,
				   unsigned max_vertices)
{
	struct pinned_sampler pinned = {
		.base = {pinned_block}, .inner = s, .wavelength_u = x->wavelength_u, .time = full_path_time(x)};
	double film[2];
	struct camera storage;
	camera_point_inverse(world_camera_at(c->w, &x->v[x->edges].x, &storage), x->v[x->edges].x.p, pinned.aperture);
	return path_walk_camera(c, &pinned.base, max_vertices, film);
}

/* Turns an emitter's point into a vertex on the surface, as if a sub-path had hit it. Returns false if it cannot. */
static bool place_on_surface(const struct path_context *c, struct path_vertex *v)
{
	if (v->kind == VERTEX_INFINITE)
		return false;
	if (!v->bsdf) {
		if (!surface_nearest(&c->w->shapes[v->x.prim.shape], v->x.prim, v->x.p, &v->x))
			return false;
		v->bsdf = &c->w->bsdfs[c->w->shape_bindings[v->x.prim.shape].bsdf];
	}
	return true;
}

static unsigned choose_technique(const double *log_pdf, unsigned k, double log_sum, double u)
{
	unsigned s = k;
	for (unsigned j = 0; j <= k; j++) {
		double p = exp(log_pdf[j] - log_sum);
		if (!(p > 0))
			continue;
		s = j;
		if (u < p)
			break;
		u -= p;
	}
	return s;
}

void ensemble_draw_containing(struct path_context *c, struct sampler *sampler, struct full_path *x, const double u[3],
			      struct ensemble *out)
{
	unsigned k = x->edges;
	double log_pdf[FULL_PATH_VERTICES_MAX];
	full_path_log_technique_pdfs(c, x, log_pdf);
	double log_sum = log_sum_exp(log_pdf, k + 1);
	unsigned s = choose_technique(log_pdf, k, log_sum, u[0]),
		 passed = s > 0 ? full_path_joint_vertex_count(c, x, s) : 0, t = k + 1 - s - passed;
	const struct candidate known = {exp(full_path_log_f(c, x) - log_sum), s, passed, k};
	struct ensemble_lengths n = ensemble_draw_lengths(c, u + 1, t, s);
	c->is_unidirectional = false;
	c->wl = x->wl;
	c->time = full_path_time(x);
	unsigned camera = t, light = s;
	if (t >= 2) {
		set_camera_subpath(c, sampler, x, t);
		if (s > 0 || place_on_surface(c, &c->camera[t - 1]))
			camera = path_continue_walk(c, sampler, SIDE_CAMERA, t, n.max_camera);
	} else {
		camera = walk_pinned_camera(c, sampler, x, n.max_camera);
		c->wl = x->wl;
	}
	if (s >= 2) {
		set_light_subpath(c, sampler, x, s);
		light = path_continue_walk(c, sampler, SIDE_LIGHT, s, n.max_light);
	} else {
		light = path_walk_light(c, sampler, n.max_light);
	}
	gather_candidates(c, camera, light, true, &known, out);
}
