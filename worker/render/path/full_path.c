/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Whole paths as states of Markov chains.
 *
 * full_path_from_subpaths builds a path from two sub-paths. The scattering factors f and f_h of its vertices are
 * computed on first use and cached; products over the vertices keep their exponents apart, so that long chains of
 * narrow lobes neither over- nor underflow. A mutation copies the vertices that it changes (full_path_copy) and
 * invalidates the caches of what it touched (full_path_invalidate).
 *
 * A vertex whose sides, mode and materials contradict each other has f = 0. Functions that build or check a path return
 * false for one that does not exist or is black; nothing else fails.
 */
#include "worker/render/path/full_path.h"

#include "worker/render/path/measure.h"
#include "worker/render/path/media.h"
#include "worker/render/path/visible.h"

#include <string.h>

/* A product is rescaled so that its largest lane is near 1 when that leaves this range. */
#define PRODUCT_HIGH 0x1p256
#define PRODUCT_LOW 0x1p-256

/* Scales s by a power of two if it leaves the range, and returns the exponent taken out. The values of lobes reach down
 * to the smallest doubles, so both factors of a product have to be rescaled before they are multiplied. */
static int take_out_exponent(spectrum *s)
{
	double m = spectrum_max(*s);
	if ((m < PRODUCT_HIGH && m > PRODUCT_LOW) || !(m > 0) || !isfinite(m))
		return 0;
	int e;
	frexp(m, &e);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		s->v[i] = ldexp(s->v[i], -e);
	return e;
}

void scaled_product_mul(struct scaled_product *p, spectrum f)
{
	p->exponent += take_out_exponent(&f);
	p->v = spectrum_mul(p->v, f);
	p->exponent += take_out_exponent(&p->v);
}

/* Whether some vertex disperses light, so that the path only carries its hero wavelength. */
static bool full_path_is_dispersed(const struct full_path *x)
{
	for (unsigned j = 1; j < x->edges; j++)
		if (path_vertex_disperses(&x->v[j]))
			return true;
	return false;
}

static void to_xyz(const struct path_context *c, const struct full_path *x, spectrum l, double xyz[3])
{
	if (EFFECT_IS_ON(c->w, dispersion))
		l = path_collapse_to_hero(l, full_path_is_dispersed(x));
	if (!EFFECT_IS_ON(c->w, colour))
		for (int i = 0; i < 3; i++)
			xyz[i] = l.v[0] * c->w->grey_xyz[i];
	else
		spectrum_to_xyz(l, &x->wl, xyz);
}

double scaled_product_log_intensity(const struct path_context *c, const struct full_path *x,
				    const struct scaled_product *p)
{
	double xyz[3];
	to_xyz(c, x, p->v, xyz);
	return log(xyz[0] + xyz[1] + xyz[2]) + M_LN2 * p->exponent;
}

bool full_path_compute_edge(struct full_path *x, unsigned e)
{
	struct path_vertex *light = &x->v[e];
	x->edge[e].w = path_direction(light, &x->v[e + 1], &x->edge[e].distance2);
	light->to_prev = x->edge[e].w;
	return x->edge[e].distance2 > 0;
}

static const struct surface_point *surface_facing(const struct full_path *x, unsigned j, struct surface_point *turned)
{
	return path_point_facing_camera(&x->v[j], x->edge[j].w, turned);
}

bool full_path_is_turned(const struct full_path *x, unsigned j)
{
	struct surface_point turned;
	return x->v[j].kind == VERTEX_SURFACE && surface_facing(x, j, &turned) == &turned;
}

double full_path_cosine_to_light(const struct full_path *x, unsigned j)
{
	struct surface_point turned;
	if (x->v[j].kind == VERTEX_MEDIUM)
		return 1;
	return fabs(vec3_dot(surface_facing(x, j, &turned)->sh.n, x->edge[j - 1].w));
}

unsigned full_path_mode(const struct full_path *x, unsigned j)
{
	struct surface_point turned;
	if (x->v[j].kind == VERTEX_MEDIUM)
		return BSDF_REFLECT;
	const struct surface_point *s = surface_facing(x, j, &turned);
	vec3 o = x->edge[j].w, i = vec3_neg(x->edge[j - 1].w);
	if (x->v[j].is_delta && (x->v[j].mode & BSDF_STRAIGHT)) /* whatever the shading normal is */
		return vec3_dot(s->ng, o) * vec3_dot(s->ng, i) < 0 ? BSDF_TRANSMIT : 0;
	double no = vec3_dot(s->sh.n, o), ni = vec3_dot(s->sh.n, i);
	if (!(no * vec3_dot(s->ng, o) > 0 && ni * vec3_dot(s->ng, i) > 0))
		return 0;
	return no * ni > 0 ? BSDF_REFLECT : BSDF_TRANSMIT;
}

double full_path_eta(const struct full_path *x, unsigned j)
{
	return path_eta(&x->v[j], &x->wl, x->edge[j].w);
}

spectrum full_path_specular_weight(const struct full_path *x, unsigned j, vec3 *wi, double *probability)
{
	const struct path_vertex *v = &x->v[j];
	struct bsdf_point p = world_bsdf_point(&v->x, &x->wl, TRANSPORT_RADIANCE);
	return bsdf_eval_delta(v->bsdf, &p, frame_to_local(&v->x.sh, x->edge[j].w), v->mode, wi, probability);
}

static spectrum eval_scattering(const struct path_context *c, const struct full_path *x, unsigned j, bool halfvec)
{
	const struct path_vertex *v = &x->v[j];
	if (v->kind == VERTEX_MEDIUM)
		return path_scatter_in_medium(c->w, &x->wl, v, x->edge[j].w, vec3_neg(x->edge[j - 1].w));
	if (!full_path_mode(x, j))
		return spectrum_constant(0);
	vec3 wi;
	if (v->is_delta) {
		double probability;
		return full_path_specular_weight(x, j, &wi, &probability);
	}
	struct surface_point turned;
	const struct surface_point *s = surface_facing(x, j, &turned);
	if (halfvec && s == &turned)
		return spectrum_constant(0);
	struct bsdf_point p = world_bsdf_point(s, &x->wl, TRANSPORT_RADIANCE);
	vec3 wo = frame_to_local(&s->sh, x->edge[j].w);
	wi = frame_to_local(&s->sh, vec3_neg(x->edge[j - 1].w));
	return halfvec ? bsdf_eval_halfvec(v->bsdf, &p, wo, wi) : v->bsdf->ops->eval(v->bsdf, &p, wo, wi);
}

spectrum full_path_eval_f(const struct path_context *c, struct full_path *x, unsigned j)
{
	if (!vertex_set_has(&x->cached_f, j)) {
		x->f[j] = j > 0 ? eval_scattering(c, x, j, false)
				: path_emitted_radiance(c, &x->v[0], x->edge[0].w, &x->wl);
		vertex_set_add(&x->cached_f, j);
	}
	return x->f[j];
}

spectrum full_path_eval_fh(const struct path_context *c, struct full_path *x, unsigned j)
{
	if (!vertex_set_has(&x->cached_fh, j)) {
		x->fh[j] = eval_scattering(c, x, j, true);
		vertex_set_add(&x->cached_fh, j);
	}
	return x->fh[j];
}

double full_path_specular_error(const struct full_path *x, unsigned j)
{
	vec3 wi;
	double probability;
	if (spectrum_is_zero(full_path_specular_weight(x, j, &wi, &probability)))
		return INFINITY;
	return vec3_length(vec3_sub(wi, frame_to_local(&x->v[j].x.sh, vec3_neg(x->edge[j - 1].w))));
}

/* Returns the mask of the vertices first..last that lie in word i of a set. */
static uint64_t range_mask(unsigned i, unsigned first, unsigned last)
{
	unsigned begin = 64 * i, end = begin + 63;
	if (last < begin || first > end)
		return 0;
	return (~(uint64_t)0 >> (last < end ? end - last : 0)) & (~(uint64_t)0 << (first > begin ? first - begin : 0));
}

/* Copies the entries first..last from `from` to `to`. */
static void copy_range(struct vertex_set *to, const struct vertex_set *from, unsigned first, unsigned last)
{
	for (unsigned i = first / 64; i <= last / 64; i++) {
		uint64_t range = range_mask(i, first, last);
		to->word[i] = (to->word[i] & ~range) | (from->word[i] & range);
	}
}

static const struct vertex_set empty_vertex_set = {{0}};

void full_path_invalidate(struct full_path *x, unsigned first, unsigned last)
{
	unsigned begin = first > 0 ? first - 1 : 0, end = last < FULL_PATH_EDGES_MAX ? last + 1 : last;
	copy_range(&x->cached_f, &empty_vertex_set, begin, end);
	copy_range(&x->cached_fh, &empty_vertex_set, begin, end);
}

void full_path_set_wavelength(const struct path_context *c, struct full_path *x, double u)
{
	x->wavelength_u = u;
	x->cached_f = x->cached_fh = empty_vertex_set;
	x->wl = world_sample_wavelengths(c->w, u);
}

void full_path_copy(struct full_path *to, const struct full_path *from, unsigned first, unsigned last)
{
	unsigned n = last - first + 1, edge = first > 0 ? first - 1 : 0,
		 edge_end = last < from->edges ? last + 1 : from->edges;
	if (to->wavelength_u != from->wavelength_u)
		to->cached_f = to->cached_fh = empty_vertex_set;
	to->edges = from->edges;
	to->wl = from->wl;
	to->wavelength_u = from->wavelength_u;
	to->film[0] = from->film[0];
	to->film[1] = from->film[1];
	memcpy(&to->v[first], &from->v[first], n * sizeof to->v[0]);
	if (edge < first) {
		to->v[edge].to_prev = from->v[edge].to_prev;
		to->v[edge].edge = from->v[edge].edge;
	}
	memcpy(&to->edge[edge], &from->edge[edge], (edge_end - edge) * sizeof to->edge[0]);
	/* Copies the caches of the neighbours, too: they scatter along the edges that were copied. */
	unsigned last_cached = last < from->edges ? last + 1 : last;
	n = last_cached - edge + 1;
	memcpy(&to->f[edge], &from->f[edge], n * sizeof to->f[0]);
	memcpy(&to->fh[edge], &from->fh[edge], n * sizeof to->fh[0]);
	copy_range(&to->cached_f, &from->cached_f, edge, last_cached);
	copy_range(&to->cached_fh, &from->cached_fh, edge, last_cached);
}

bool full_path_edge_is_visible(struct path_context *c, struct full_path *x, unsigned e)
{
	struct path_vertex *v = &x->v[e];
	if (!EFFECT_IS_ON(c->w, scattering))
		return path_is_visible(c, v + 1, v);
	c->wl = x->wl;
	if (!path_is_visible_in_media(c, v + 1, v, &v->edge, &x->edge[e].transmittance))
		return false;
	uint32_t medium = v->edge.medium;
	return v->kind != VERTEX_MEDIUM || (medium && path_medium(c->w, medium)->is_scattering);
}

bool full_path_edges_are_visible(struct path_context *c, struct full_path *x)
{
	x->v[x->edges].edge.medium = c->w->camera_medium;
	for (unsigned e = x->edges; e-- > 0;)
		if (!full_path_edge_is_visible(c, x, e))
			return false;
	return true;
}

bool full_path_project(const struct path_context *c, struct full_path *x)
{
	const struct full_path_edge *e = &x->edge[x->edges - 1];
	struct camera storage;
	const struct camera *camera = world_camera_at(c->w, &x->v[x->edges].x, &storage);
	vec3 d = vec3_neg(e->w);
	double distance = sqrt(e->distance2);
	if (x->v[x->edges - 1].kind == VERTEX_INFINITE) {
		/* An emitter at infinity is seen between the clipping planes. */
		double t_min, t_max;
		camera_clip_range(camera, d, &t_min, &t_max);
		distance = 0.5 * (t_min + t_max);
	}
	if (!camera_project(camera, x->v[x->edges].x.p, d, distance, &x->film[0], &x->film[1]))
		return false;
	return film_window_contains(&c->window, x->film);
}

/* Copies a sub-path's vertex to vertex i of the path. Keeps `mode` and `is_delta` only if `keeps_mode`: the path leaves
 * the vertex in the way its sub-path did. */
static void copy_vertex(struct full_path *x, unsigned i, const struct path_vertex *from, bool keeps_mode)
{
	x->v[i] = *from;
	if (!keeps_mode) {
		x->v[i].is_delta = false;
		x->v[i].mode = 0;
	}
}

/* Copies the emitter's point, drawn or hit, to the path's first vertex. */
static void copy_emitter(struct full_path *x, const struct path_vertex *from)
{
	copy_vertex(x, 0, from, false);
	if (x->v[0].kind == VERTEX_SURFACE)
		x->v[0].kind = VERTEX_EMITTER;
}

unsigned full_path_max_light_vertices(const struct path_context *c, const struct full_path *x)
{
	if (!EFFECT_IS_ON(c->w, scattering))
		return x->edges;
	struct joined_path p = {.edges = x->edges};
	for (unsigned i = 0; i <= x->edges; i++)
		p.v[i] = &x->v[i];
	unsigned mismatched_edge = path_find_mismatched_edge(c, &p);
	return mismatched_edge ? mismatched_edge : x->edges;
}

unsigned full_path_passed_count(const struct path_context *c, const struct full_path *x, unsigned s)
{
	unsigned end = s;
	while (path_allows_see_through(c) && end < x->edges && path_vertex_is_see_through(&x->v[end]))
		end++;
	return end - s;
}

unsigned full_path_joint_vertex_count(const struct path_context *c, const struct full_path *x, unsigned s)
{
	unsigned passed = full_path_passed_count(c, x, s), refracted = 0;
	while (s == 1 && passed == 0 && path_vertex_is_refracting(&x->v[1 + refracted]))
		refracted++;
	return passed + refracted;
}

bool full_path_can_join(const struct path_context *c, const struct full_path *x, unsigned s)
{
	unsigned passed = full_path_passed_count(c, x, s), end = s + passed;
	if (s == 1 && end == x->edges) /* only samples join emitters to the lens */
		return false;
	return passed <= PATH_PASSED_VERTICES_MAX && !(s > 1 && x->v[s - 1].is_delta) &&
	       !(end < x->edges && x->v[end].is_delta);
}

bool full_path_can_be_made(const struct path_context *c, const struct full_path *x)
{
	if (path_can_be_hit(c, &x->v[0]))
		return true;
	for (unsigned s = full_path_max_light_vertices(c, x); s > 0; s--)
		if (full_path_can_join(c, x, s) && !(s == 1 && c->w->emitters[x->v[0].emitter].is_beam))
			return true;
	return false;
}

bool full_path_finish(struct path_context *c, struct full_path *x)
{
	x->cached_f = x->cached_fh = empty_vertex_set;
	for (unsigned e = 0; e < x->edges; e++)
		if (!full_path_compute_edge(x, e))
			return false;
	for (unsigned j = 1; j < x->edges; j++) {
		unsigned mode = full_path_mode(x, j);
		if (!x->v[j].is_delta)
			x->v[j].mode = mode;
		if (!mode || mode != (x->v[j].mode & (BSDF_REFLECT | BSDF_TRANSMIT)))
			return false;
	}
	if (!full_path_project(c, x))
		return false;
	if (EFFECT_IS_ON(c->w, scattering) && !(full_path_edges_are_visible(c, x) && full_path_can_be_made(c, x)))
		return false;
	for (unsigned j = 0; j < x->edges; j++)
		if (spectrum_is_zero(full_path_eval_f(c, x, j)))
			return false;
	return true;
}

/* Whether nothing lies between the vertices of the joint. */
static bool joint_is_visible(struct path_context *c, struct full_path *x, unsigned s, unsigned passed)
{
	for (unsigned e = s - 1; e < s + passed; e++)
		if (!full_path_edge_is_visible(c, x, e))
			return false;
	return true;
}

/* Traces the joint between y and z, the camera's last vertex, and copies its vertices to x. Returns false if it has not
 * exactly `passed` vertices. */
static bool trace_joint(struct path_context *c, const struct path_vertex *z, bool from_lens,
			const struct path_vertex *y, unsigned s, unsigned passed, struct full_path *x)
{
	spectrum transmittance;
	const struct path_vertex *before = from_lens ? NULL : z - 1;
	bool is_open = (path_allows_see_through(c) && path_trace_passed(c, before, z, y, &transmittance)) ||
		       (s == 1 && !from_lens && path_allows_refraction(c) &&
			path_trace_refracted(c, before, z, y, &transmittance));
	if (!is_open || c->passed_count != passed)
		return false;
	for (unsigned i = 0; i < passed; i++)
		copy_vertex(x, s + i, &c->passed[passed - 1 - i], true);
	return true;
}

bool full_path_from_subpaths(struct path_context *c, unsigned s, unsigned passed, unsigned edges, struct full_path *x)
{
	unsigned t = edges + 1 - s - passed;
	assert(edges <= FULL_PATH_EDGES_MAX && t >= 1);
	const struct path_vertex *z = &c->camera[t - 1];
	struct path_vertex drawn;
	double pdf;
	x->edges = edges;
	x->wl = c->wl;
	x->wavelength_u = EFFECT_IS_ON(c->w, colour) ? c->wl.u : 0;
	if (s > 0 && t > 1 && (z->kind == VERTEX_INFINITE || !path_scatters_smoothly(z)))
		return false;
	if (s == 0) {
		if (z->emitter < 0)
			return false;
		copy_emitter(x, z);
	} else if (s == 1) {
		if (!path_sample_next_event(c, z, &drawn, &pdf))
			return false;
		copy_emitter(x, &drawn);
	} else {
		if (!path_scatters_smoothly(&c->light[s - 1]))
			return false;
		copy_emitter(x, &c->light[0]);
		for (unsigned i = 1; i < s; i++)
			copy_vertex(x, i, &c->light[i], i + 1 < s);
	}
	if (passed && !trace_joint(c, z, t == 1, s == 1 ? &drawn : &c->light[s - 1], s, passed, x))
		return false;
	for (unsigned i = s > 0 ? s + passed : 1; i <= edges; i++)
		copy_vertex(x, i, &c->camera[edges - i], s == 0 || i > s + passed);
	return full_path_finish(c, x) &&
	       (s == 0 || EFFECT_IS_ON(c->w, scattering) || joint_is_visible(c, x, s, passed));
}

void full_path_attenuate_by_media(const struct world *w, const struct full_path *x, struct scaled_product *p)
{
	if (EFFECT_IS_ON(w, scattering)) {
		for (unsigned e = 0; e < x->edges; e++)
			scaled_product_mul(p, x->edge[e].transmittance);
		return;
	}
	uint32_t medium = w->camera_medium;
	for (unsigned e = x->edges; e > 0; e--) {
		medium = path_medium_after(w, &x->v[e], medium, vec3_neg(x->edge[e - 1].w));
		if (medium)
			scaled_product_mul(p, path_transmittance(w, &x->wl, medium, &x->v[e], &x->v[e - 1]));
	}
}

void full_path_colour(const struct path_context *c, struct full_path *x, double xyz[3])
{
	struct scaled_product p = PRODUCT_ONE;
	for (unsigned j = 0; j < x->edges; j++)
		scaled_product_mul(&p, vertex_set_has(&x->cached_fh, j) ? x->fh[j] : full_path_eval_f(c, x, j));
	full_path_attenuate(c->w, x, &p);
	to_xyz(c, x, p.v, xyz);
	double sum = xyz[0] + xyz[1] + xyz[2];
	for (int i = 0; i < 3; i++)
		xyz[i] /= sum;
}
