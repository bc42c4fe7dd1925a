/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Edges through media that scatter are walked from one face of `null` on the ray to the next: walk_length adds up
 * optical depths, walk_through enters the medium behind the face. path_extend_in_media ends where the depth at one
 * wavelength reaches the one that was drawn, or at anything else than such a face; path_see_in_media at the other
 * vertex.
 *
 * Faces whose shapes state no medium are passed like all others. After FACES_MOST of them, as between faces that
 * coincide, a ray counts as lost, and two vertices do not see each other.
 */
#include "worker/render/path/media.h"

#include "worker/render/path/visible.h"

enum { FACES_MOST = 1024 };

/* The medium on the side of `away` of a shape that states one, or any; false: it states none. */
static bool side_of(const struct world *w, const struct surface_point *x, vec3 away, uint32_t *medium)
{
	return world_medium_of_side(&w->parts[x->prim.shape], vec3_dot(x->ng, away) > 0, medium);
}

uint32_t path_medium_after(const struct world *w, const struct path_vertex *v, uint32_t medium, vec3 away)
{
	if (v->kind == VERTEX_SURFACE)
		side_of(w, &v->x, away, &medium);
	return medium;
}

uint32_t path_medium_of_emitter(const struct world *w, const struct path_vertex *v, vec3 away)
{
	uint32_t medium = v->kind == VERTEX_INFINITE ? 0 : w->emitter_medium[v->emitter];
	if (v->x.prim.shape < w->shape_count)
		side_of(w, &v->x, away, &medium);
	return medium;
}

/* What is before a camera's near plane is not there. */
static double near_plane(const struct world *w, const struct path_vertex *from, vec3 d)
{
	double t_min = 0, t_max;
	if (from->kind == VERTEX_CAMERA)
		camera_clip(&w->camera, d, &t_min, &t_max);
	return t_min;
}

spectrum path_transmittance(const struct world *w, const struct wavelengths *wl, uint32_t medium,
			    const struct path_vertex *a, const struct path_vertex *b)
{
	double distance2, distance = INFINITY;
	if (!medium)
		return spectrum_of(1);
	if (a->kind != VERTEX_INFINITE && b->kind != VERTEX_INFINITE) {
		const struct path_vertex *from = b->kind == VERTEX_CAMERA ? b : a, *to = from == a ? b : a;
		vec3 d = path_direction(from, to, &distance2);
		distance = fmax(sqrt(distance2) - near_plane(w, from, d), 0);
	}
	return medium_transmittance(path_medium(w, medium), distance, wl);
}

void path_absorb(const struct path_context *c, const struct path_vertex *at, vec3 wi, struct path_vertex *to)
{
	to->edge.medium = path_medium_after(c->w, at, at->edge.medium, wi);
	to->beta = spectrum_mul(to->beta, path_transmittance(c->w, &c->wl, to->edge.medium, at, to));
}

/* A ray on its way. */
struct walk {
	struct path_edge *edge; /* medium: where the ray is; free: unused until the end */
	spectrum all, events;	/* optical depths so far: of all media, of those that scatter */
	spectrum sigma_t;	/* of the medium where the ray is; 0: there is none */
	bool scatters;		/* that medium does */
};

static void walk_enter(const struct path_context *c, struct walk *k, uint32_t medium)
{
	k->edge->medium = medium;
	k->scatters = medium && path_medium(c->w, medium)->scatters;
	k->sigma_t = medium ? medium_extinction(path_medium(c->w, medium), &c->wl) : spectrum_of(0);
}

static struct walk walk_begin(const struct path_context *c, const struct path_vertex *at, vec3 d,
			      struct path_edge *edge)
{
	bool emitter = at->kind == VERTEX_EMITTER || at->kind == VERTEX_INFINITE;
	uint32_t medium =
		emitter ? path_medium_of_emitter(c->w, at, d) : path_medium_after(c->w, at, at->edge.medium, d);
	struct walk k = {.edge = edge, .all = spectrum_of(0), .events = spectrum_of(0)};
	*edge = (struct path_edge){.before = medium, .fits = true};
	walk_enter(c, &k, medium);
	return k;
}

static void walk_length(struct walk *k, double length)
{
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double depth = k->sigma_t.v[i] > 0 ? k->sigma_t.v[i] * length : 0; /* not 0 times infinity */
		k->all.v[i] += depth;
		k->events.v[i] += k->scatters ? depth : 0;
	}
}

/* Through a face of `null` at x, along d. */
static void walk_through(const struct path_context *c, struct walk *k, const struct surface_point *x, vec3 d)
{
	uint32_t near, far;
	if (!side_of(c->w, x, vec3_neg(d), &near) || !side_of(c->w, x, d, &far))
		return;
	k->edge->fits = k->edge->fits && near == k->edge->medium;
	walk_enter(c, k, far);
}

static spectrum walk_end(struct walk *k)
{
	spectrum left;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		k->edge->free.v[i] = exp(-k->events.v[i]);
		left.v[i] = exp(-k->all.v[i]);
	}
	return left;
}

static bool is_face(const struct world *w, const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && w->parts[v->x.prim.shape].passable;
}

/* The distance of the next event along the ray, which has so much optical depth to go at one wavelength. */
static double next_event(const struct walk *k, int lane, double depth)
{
	double sigma = k->scatters ? k->sigma_t.v[lane] : 0;
	return sigma > 0 ? fmax(depth - k->events.v[lane], 0) / sigma : INFINITY;
}

static void stop_in_medium(struct path_vertex *to, vec3 from, double distance, vec3 d)
{
	to->kind = VERTEX_MEDIUM;
	to->emitter = -1;
	to->bsdf = NULL;
	to->x = (struct surface_point){.p = vec3_madd(from, distance, d), .prim = PRIM_NONE};
}

bool path_extend_in_media(struct path_context *c, const struct path_vertex *at, vec3 d, double t_min, double t_max,
			  double u, struct path_vertex *to, spectrum *left)
{
	double place = u * SPECTRUM_LANES, lane = floor(place), depth = -log1p(lane - place);
	struct path_edge edge;
	struct walk k = walk_begin(c, at, d, &edge);
	struct path_vertex from = *at;
	for (int i = 0; i < FACES_MOST; i++) {
		bool met = path_extend(c, &from, d, t_min, t_max, to);
		double end = met && to->kind == VERTEX_SURFACE ? vec3_length(vec3_sub(to->x.p, from.x.p)) : INFINITY;
		double event = t_min + next_event(&k, (int)lane, depth);
		if (event < fmin(end, t_max)) {
			stop_in_medium(to, from.x.p, event, d);
			walk_length(&k, event - t_min);
			met = vec3_is_finite(to->x.p);
		} else {
			walk_length(&k, end - t_min);
		}
		if (!met || !is_face(c->w, to)) {
			*left = walk_end(&k);
			to->edge = edge;
			return met;
		}
		walk_through(c, &k, &to->x, d);
		from = *to;
		t_max -= end;
		t_min = 0;
	}
	return false;
}

bool path_see_in_media(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
		       struct path_edge *edge, spectrum *left)
{
	double distance2;
	vec3 d = path_direction(z, y, &distance2);
	struct walk k = walk_begin(c, z, d, edge);
	struct path_vertex from = *z, face;
	double begin = near_plane(c->w, z, d);
	for (int i = 0; i < FACES_MOST; i++) {
		double end = y->kind == VERTEX_INFINITE ? INFINITY : vec3_length(vec3_sub(y->x.p, from.x.p));
		bool met = c->w->has_passable && path_extend(c, &from, d, begin, end, &face);
		if (!met || !is_face(c->w, &face)) {
			walk_length(&k, fmax(end - begin, 0));
			*left = walk_end(&k);
			return path_visible(c, &from, y);
		}
		walk_length(&k, vec3_length(vec3_sub(face.x.p, from.x.p)) - begin);
		walk_through(c, &k, &face.x, d);
		from = face;
		begin = 0;
	}
	return false;
}

double path_edge_pdf(const struct path_context *c, const struct path_edge *edge, uint32_t medium,
		     const struct path_vertex *to)
{
	if (to->kind != VERTEX_MEDIUM)
		return spectrum_mean(edge->free);
	return spectrum_mean(spectrum_mul(medium_extinction(path_medium(c->w, medium), &c->wl), edge->free));
}

void path_travel(const struct path_context *c, struct path_vertex *to, spectrum left)
{
	double pdf = path_edge_pdf(c, &to->edge, to->edge.medium, to);
	to->pdf *= pdf;
	to->beta = pdf > 0 ? spectrum_scale(1 / pdf, spectrum_mul(to->beta, left)) : spectrum_of(0);
}

spectrum path_scatter_in_medium(const struct path_context *c, const struct path_vertex *v, vec3 wo, vec3 wi)
{
	const struct medium *m = path_medium(c->w, v->edge.medium);
	return spectrum_scale(phase_eval(&m->phase, wo, wi), medium_scattering(m, &c->wl));
}
