/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Edges through scattering media are walked from one face of `null` on the ray to the next: walk_on accumulates
 * optical depths, walk_through enters the medium behind the face. path_extend_in_media ends where the depth at
 * one wavelength reaches the depth that was drawn, or at the first hit that is not such a face; path_see_in_media
 * ends at the other vertex.
 *
 * Faces whose shapes state no medium are passed like all others. After PATH_FACES_MOST faces, as can happen between
 * faces that coincide, a ray counts as a miss and two vertices do not see each other.
 */
#include "worker/render/path/media.h"

#include "worker/render/path/visible.h"

/* Sets *medium to the medium on the side of `away` if the shape at x states media. Returns false if it states none. */
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

spectrum path_transmittance(const struct world *w, const struct wavelengths *wl, uint32_t medium,
			    const struct path_vertex *a, const struct path_vertex *b)
{
	if (!medium)
		return spectrum_of(1);
	bool backwards = b->kind == VERTEX_CAMERA || a->kind == VERTEX_INFINITE;
	const struct path_vertex *from = backwards ? b : a, *to = backwards ? a : b;
	double distance2;
	vec3 d = path_direction(from, to, &distance2);
	bool endless = to->kind == VERTEX_INFINITE;
	const struct medium_lanes m = medium_at(path_medium(w, medium), d, wl);
	const struct grid_ray r = {from->x.p, d, path_ray_begin(w, from, d), endless ? INFINITY : sqrt(distance2)};
	return spectrum_attenuation(medium_depth(&m, &r));
}

void path_absorb(const struct path_context *c, const struct path_vertex *at, vec3 wi, struct path_vertex *to)
{
	to->edge.medium = path_medium_after(c->w, at, at->edge.medium, wi);
	to->beta = spectrum_mul(to->beta, path_transmittance(c->w, &c->wl, to->edge.medium, at, to));
}

spectrum path_absorb_share(const struct path_context *c, const struct path_vertex *at, vec3 wi, spectrum share,
			   struct path_vertex *to)
{
	if (!EFFECT_IS_ON(c->w, absorption))
		return share;
	to->beta = share;
	path_absorb(c, at, wi, to);
	return to->beta;
}

/* The state of a ray on its way through media. */
struct walk {
	/* `medium` is the medium where the ray is; `free` is set at the end. */
	struct path_edge *edge;
	vec3 d; /* direction of the ray */
	/* Optical depths so far: of all media, and of those that scatter. */
	spectrum all, events;
	struct medium_lanes lanes; /* coefficients of the medium where the ray is, if any */
	bool scatters;		   /* the medium where the ray is scatters */
	/* The medium where the ray is, if it emits and emission is wanted; otherwise NULL. */
	const struct medium *shines;
	struct path_emission *emission; /* NULL: emission is not wanted */
	const struct wavelengths *wl;
};

static void walk_enter(const struct path_context *c, struct walk *k, uint32_t medium)
{
	k->edge->medium = medium;
	k->scatters = medium && path_medium(c->w, medium)->scatters;
	k->shines = NULL;
	if (!medium)
		return;
	const struct medium *m = path_medium(c->w, medium);
	k->lanes = medium_at(m, k->d, &c->wl);
	k->shines = k->emission && m->shines ? m : NULL;
}

static struct walk walk_begin(const struct path_context *c, const struct path_vertex *at, vec3 d,
			      struct path_edge *edge, struct path_emission *emission)
{
	bool emitter = at->kind == VERTEX_EMITTER || at->kind == VERTEX_INFINITE;
	uint32_t medium =
		emitter ? path_medium_of_emitter(c->w, at, d) : path_medium_after(c->w, at, at->edge.medium, d);
	struct walk k = {.edge = edge,
			 .d = d,
			 .all = spectrum_of(0),
			 .events = spectrum_of(0),
			 .emission = emission,
			 .wl = &c->wl};
	*edge = (struct path_edge){.before = medium, .fits = true, .d = d};
	walk_enter(c, &k, medium);
	return k;
}

static void walk_add(struct walk *k, spectrum depth)
{
	k->all = spectrum_add(k->all, depth);
	k->events = k->scatters ? spectrum_add(k->events, depth) : k->events;
}

/* Adds the optical depth between t0 and t1 on the ray from o. */
static void walk_on(struct walk *k, vec3 o, double t0, double t1)
{
	if (k->edge->medium)
		walk_add(k, medium_depth(&k->lanes, &(struct grid_ray){o, k->d, t0, t1}));
}

/* Returns the light that reaches the start of a segment of that length with constant emission l per length. */
static spectrum even_emission(const struct medium_lanes *m, spectrum l, double length)
{
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double sigma = m->sigma_t[0].v[i];
		if (l.v[i] > 0) /* avoids 0 times infinity */
			l.v[i] *= sigma > 0 ? -expm1(-sigma * length) / sigma : length;
	}
	return l;
}

/* Adds the light that the medium emits between t0 and t1 along the ray, a segment that the edge crosses entirely.
 * Without events and in a homogeneous medium it is known in closed form; otherwise it is estimated at one point. The
 * light is divided by the probability that the edge gets this far, which is the mean over the wavelengths of
 * exp(-depth) of the media that scatter. */
static void walk_shine(struct walk *k, vec3 o, double t0, double t1)
{
	const struct emission *g = &k->shines->emission;
	spectrum l, passed = spectrum_of(0), all, events = k->events;
	if (!g->radiance.grid && !k->lanes.grid && !k->scatters) {
		l = even_emission(&k->lanes, emission_even(g, k->wl), t1 - t0);
	} else {
		double t;
		if (!emission_sample(g, &(struct grid_ray){o, k->d, t0, t1}, k->emission->u, k->wl, &t, &l))
			return;
		passed = medium_depth(&k->lanes, &(struct grid_ray){o, k->d, t0, t});
	}
	all = spectrum_attenuation(spectrum_add(k->all, passed));
	events = spectrum_attenuation(k->scatters ? spectrum_add(events, passed) : events);
	l = spectrum_scale(1 / spectrum_mean(events), spectrum_mul(l, all));
	k->emission->sum = spectrum_add(k->emission->sum, l);
}

/* Like walk_on(), but stops at the event where the depth at wavelength `lane` reaches `depth`, and adds emission.
 * Returns the distance of the event; INFINITY if there is none before t1. depth = INFINITY: no events. */
static double walk_to_event(struct walk *k, vec3 o, double t0, double t1, int lane, double depth)
{
	spectrum passed;
	if (!k->scatters || depth == INFINITY) {
		if (k->shines && t1 > t0)
			walk_shine(k, o, t0, t1);
		walk_on(k, o, t0, t1);
		return INFINITY;
	}
	double t = medium_reach(&k->lanes, &(struct grid_ray){o, k->d, t0, t1}, lane,
				fmax(depth - k->events.v[lane], 0), &passed);
	if (k->shines && fmin(t, t1) > t0)
		walk_shine(k, o, t0, fmin(t, t1));
	walk_add(k, passed);
	return t;
}

/* Passes through a face of `null` at x. */
static void walk_through(const struct path_context *c, struct walk *k, const struct surface_point *x)
{
	uint32_t near, far;
	if (!side_of(c->w, x, vec3_neg(k->d), &near) || !side_of(c->w, x, k->d, &far))
		return;
	k->edge->fits = k->edge->fits && near == k->edge->medium;
	walk_enter(c, k, far);
}

static spectrum walk_end(struct walk *k)
{
	k->edge->free = spectrum_attenuation(k->events);
	return spectrum_attenuation(k->all);
}

static bool is_face(const struct world *w, const struct path_vertex *v)
{
	return v->kind == VERTEX_SURFACE && w->parts[v->x.prim.shape].passable;
}

void path_stop_in_medium(struct path_vertex *to, const struct path_vertex *from, double distance, vec3 d)
{
	to->kind = VERTEX_MEDIUM;
	to->emitter = -1;
	to->bsdf = NULL;
	to->x = (struct surface_point){.p = vec3_madd(from->x.p, distance, d), .prim = prim_none_at(from->x.prim.time)};
}

/* Traces to the event where the depth at wavelength `lane` reaches `depth`; INFINITY: no events. */
static bool extend(struct path_context *c, const struct path_vertex *at, vec3 d, double t_min, double t_max, int lane,
		   double depth, struct path_emission *emission, struct path_vertex *to, spectrum *left)
{
	struct path_edge edge;
	struct walk k = walk_begin(c, at, d, &edge, emission);
	struct path_vertex from = *at;
	for (int i = 0; i < PATH_FACES_MOST; i++) {
		bool met = path_extend(c, &from, d, t_min, t_max, to);
		double end = met && to->kind == VERTEX_SURFACE ? vec3_length(vec3_sub(to->x.p, from.x.p)) : INFINITY;
		double event = walk_to_event(&k, from.x.p, t_min, fmin(end, t_max), lane, depth);
		if (event < INFINITY) {
			path_stop_in_medium(to, &from, event, d);
			met = vec3_is_finite(to->x.p);
		} else if (end > t_max) {
			walk_on(&k, from.x.p, t_max, end);
		}
		if (!met || !is_face(c->w, to)) {
			*left = walk_end(&k);
			to->edge = edge;
			return met;
		}
		walk_through(c, &k, &to->x);
		from = *to;
		t_max -= end;
		t_min = 0;
	}
	return false;
}

bool path_extend_in_media(struct path_context *c, const struct path_vertex *at, vec3 d, double t_min, double t_max,
			  double u, struct path_emission *emission, struct path_vertex *to, spectrum *left)
{
	double place = u * SPECTRUM_LANES, lane = floor(place);
	return extend(c, at, d, t_min, t_max, (int)lane, -log1p(lane - place), emission, to, left);
}

bool path_extend_past_events(struct path_context *c, const struct path_vertex *at, vec3 d, double t_min, double t_max,
			     struct path_vertex *to, spectrum *left)
{
	return extend(c, at, d, t_min, t_max, 0, INFINITY, NULL, to, left);
}

bool path_see_in_media(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
		       struct path_edge *edge, spectrum *left)
{
	double distance2;
	vec3 d = path_direction(z, y, &distance2);
	struct walk k = walk_begin(c, z, d, edge, NULL);
	struct path_vertex from = *z, face;
	double begin = path_ray_begin(c->w, z, d);
	for (int i = 0; i < PATH_FACES_MOST; i++) {
		double end = y->kind == VERTEX_INFINITE ? INFINITY : vec3_length(vec3_sub(y->x.p, from.x.p));
		bool met = c->w->has_passable && path_extend(c, &from, d, begin, end, &face);
		if (!met || !is_face(c->w, &face)) {
			if (!path_visible(c, &from, y))
				return false;
			walk_on(&k, from.x.p, begin, end);
			*left = walk_end(&k);
			return true;
		}
		walk_on(&k, from.x.p, begin, vec3_length(vec3_sub(face.x.p, from.x.p)));
		walk_through(c, &k, &face.x);
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
	const struct medium *m = path_medium(c->w, medium);
	return spectrum_mean(spectrum_mul(medium_extinction(m, to->x.p, edge->d, &c->wl), edge->free));
}

void path_travel(const struct path_context *c, struct path_vertex *to, spectrum left)
{
	double pdf = path_edge_pdf(c, &to->edge, to->edge.medium, to);
	to->pdf *= pdf;
	to->beta = pdf > 0 ? spectrum_scale(1 / pdf, spectrum_mul(to->beta, left)) : spectrum_of(0);
}

spectrum path_scatter_in_medium(const struct world *w, const struct wavelengths *wl, const struct path_vertex *v,
				vec3 wo, vec3 wi)
{
	const struct medium *m = path_medium(w, v->edge.medium);
	return spectrum_scale(phase_eval(&m->phase, v->x.p, wo, wi), medium_scattering(m, v->x.p, wo, wl));
}
