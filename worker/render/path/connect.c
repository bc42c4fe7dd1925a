/* SPDX-License-Identifier: Apache-2.0 */
/*
 * path_connect joins s vertices of the light sub-path to t of the camera's and weights the contribution by the balance
 * heuristic over all techniques that could have made the path. Densities are carried as ratios between neighbouring
 * techniques, whose products stay near 1 where the densities themselves leave the range of doubles.
 *
 * Most connections between two surfaces contribute little once weighted, but cost a ray and a weight like any other.
 * Those that contribute less than path_context.faint_threshold are made with a probability q in proportion to their
 * contribution, and are then multiplied by 1/q. Systematic sampling decides which ones are made (Madow and Madow 1944):
 * the intervals of length q are laid end to end, starting at a random position in [0, 1), and the connections whose
 * intervals contain a whole number are made. So each has exactly its probability, from one random number for all,
 * provided that no q depends on which other connections were made.
 *
 * A connection contributes nothing if it is blocked, has a delta lobe at an end, or is too faint for doubles to weight;
 * none of these is an error.
 */
#include "worker/render/path/connect.h"

#include "worker/render/path/media.h"
#include "worker/render/path/visible.h"

/* The code that runs for every joint is compiled twice: with `without_effects` set for worlds without any effect that
 * joints depend on (effects.joints), and once for all others. The code is so short that testing for the effects
 * would cost several percent. */
#define FORCE_INLINE static inline __attribute__((always_inline))

/* Beyond this ratio a weight is zero in double anyway, and infinities would lead to NaN. */
#define RATIO_LIMIT 1e200

/* Whether the path has a delta lobe at vertex i. At the two ends of the joint it scatters smoothly, so the delta flag
 * of their sub-path does not apply there. */
static bool is_delta(const struct joined_path *p, unsigned i)
{
	if (i + 1 == p->light_count || i == p->light_count + p->passed_count || i == 0 || i == p->edges)
		return false;
	return p->v[i]->is_delta;
}

/* Whether the joint that made the path is refracted. */
static bool is_refracted(const struct joined_path *p)
{
	return p->passed_count > 0 && path_vertex_is_refracting(p->v[p->light_count]);
}

/* Whether points of emitters are joined straight to the lens for this pair. Where they are hardly denser than the
 * film's own samples, whose estimate of directly visible light has no variance, the joints would only add variance. */
static bool can_join_lens(const struct path_context *c, const struct path_vertex *eye,
			  const struct path_vertex *emitter)
{
	if (!c->joins_emitters_to_lens || emitter->kind == VERTEX_INFINITE)
		return false;
	double film = path_pdf(c, NULL, eye, emitter, TRANSPORT_RADIANCE) *
		      (c->light_subpath_interval > 1 ? c->light_subpath_interval : 1);
	return path_pdf_toward(c, emitter, eye->x.p) >= PATH_LENS_DENSITY_RATIO * film;
}

/* Returns the index of the first vertex from x_i on that is not passed: the vertex to which x_{i-1} is joined. */
FORCE_INLINE unsigned first_not_passed(const struct path_context *c, const struct joined_path *p, unsigned i,
				       const bool without_effects)
{
	while (!without_effects && path_allows_see_through(c) && path_joint_passes(p, i))
		i++;
	return i;
}

/* For j > 0 and a specular vertex x_j: whether technique j can join x_{j-1} to the first vertex behind those that light
 * passes straight through, starting at x_j. */
static bool can_join_through(const struct path_context *c, const struct joined_path *p, unsigned j)
{
	unsigned end = first_not_passed(c, p, j, false);
	if (end - j > PATH_PASSED_VERTICES_MAX)
		return false;
	return j == 1 && end == p->edges ? can_join_lens(c, p->v[end], p->v[0]) : !is_delta(p, end);
}

FORCE_INLINE bool technique_exists(const struct path_context *c, const struct joined_path *p, unsigned j,
				   const bool without_effects)
{
	if (j == 0)
		return true;
	if (!without_effects && p->mismatched_edge && j > p->mismatched_edge)
		return false;
	if (p->edges == 1)
		return j == 1 && can_join_lens(c, p->v[1], p->v[0]);
	if (j > p->edges || is_delta(p, j - 1))
		return false;
	return !is_delta(p, j) || (!without_effects && path_allows_see_through(c) && can_join_through(c, p, j));
}

/* Edge i and its media at x_{i-1} (light) and at x_i (camera). Only where media scatter. */
struct joined_edge {
	const struct path_edge *edge;
	uint32_t light_medium, camera_medium;
};

static struct joined_edge joined_edge_at(const struct joined_path *p, unsigned i)
{
	const struct path_edge *e = i == p->light_count	 ? p->joint_vertices
				    : i < p->light_count ? &p->v[i]->edge
							 : &p->v[i - 1]->edge;
	bool from_light = i < p->light_count;
	return (struct joined_edge){e, from_light ? e->previous_medium : e->medium,
				    from_light ? e->medium : e->previous_medium};
}

/* Returns the factor that edge i contributes to the density of x_i (or, if back, of x_{i-1}) as
 * generated from its other end. */
FORCE_INLINE double edge_pdf(const struct path_context *c, const struct joined_path *p, unsigned i, bool from_camera,
			     const bool without_effects)
{
	if (without_effects || !EFFECT_IS_ON(c->w, scattering))
		return 1;
	struct joined_edge e = joined_edge_at(p, i);
	return path_edge_pdf(c, e.edge, from_camera ? e.light_medium : e.camera_medium, p->v[from_camera ? i - 1 : i]);
}

/* Returns the density of x_i as generated from the light's side, for i >= s. */
FORCE_INLINE double pdf_from_light(const struct path_context *c, const struct joined_path *p, unsigned i,
				   const bool without_effects)
{
	unsigned s = p->light_count, passed = without_effects ? 0 : p->passed_count;
	if (i == 0)
		return path_pdf_emitter(c, p->v[0]);
	if (i >= s + passed + 2)
		return p->v[i]->pdf_rev;
	if (i > s && i <= s + passed)
		return is_refracted(p) ? path_pdf_refracted(c, p->v[i - 2], p->v[i - 1], p->v[i], TRANSPORT_IMPORTANCE)
				       : path_pdf_passed(c, p->v[i - 1], p->v[i], TRANSPORT_IMPORTANCE);
	const struct path_vertex *prev = i >= 2 ? p->v[i - 2] : NULL;
	return path_pdf(c, prev, p->v[i - 1], p->v[i], TRANSPORT_IMPORTANCE) *
	       edge_pdf(c, p, i, false, without_effects);
}

/* Returns the density of x_i as generated from the camera's side, for i < s. */
FORCE_INLINE double pdf_from_camera(const struct path_context *c, const struct joined_path *p, unsigned i,
				    const bool without_effects)
{
	unsigned s = p->light_count, k = p->edges;
	if (i + 3 <= s)
		return p->v[i]->pdf_rev;
	if (!without_effects && i + 1 == s && p->passed_count)
		return is_refracted(p) ? path_pdf_refracted(c, p->v[s + 1], p->v[s], p->v[i], TRANSPORT_RADIANCE)
				       : path_pdf_passed(c, p->v[s], p->v[i], TRANSPORT_RADIANCE);
	const struct path_vertex *prev = i + 2 <= k ? p->v[i + 2] : NULL;
	return path_pdf(c, prev, p->v[i + 1], p->v[i], TRANSPORT_RADIANCE) *
	       edge_pdf(c, p, i + 1, true, without_effects);
}

/* Returns the density of joining x_{first-1} to x_end, which passes x_first .. x_{end-1}, divided by that of drawing
 * the passed vertices as their sub-path did; 1 if there are none. */
FORCE_INLINE double joint_over_drawn_ratio(const struct path_context *c, const struct joined_path *p, unsigned first,
					   unsigned end, const bool without_effects)
{
	double pdf[PATH_PASSED_VERTICES_MAX];
	if (without_effects || !path_allows_see_through(c) || first == end)
		return 1;
	for (unsigned i = first; i < end; i++)
		pdf[i - first] = p->v[i]->pdf;
	return path_passed_ratio(p->v, first, end - 1, pdf);
}

/* For the technique that made the path: returns the density of drawing the vertices that its joint passes, from the
 * light's or the camera's side, divided by that of joining; 1 if the joint passes nothing. */
FORCE_INLINE double drawn_over_joint_ratio(const struct path_context *c, const struct joined_path *p, bool from_light,
					   const bool without_effects)
{
	double pdf[PATH_PASSED_VERTICES_MAX];
	if (without_effects || !p->passed_count)
		return 1;
	for (unsigned i = 0; i < p->passed_count; i++)
		pdf[i] = from_light ? pdf_from_light(c, p, p->light_count + i, false) : p->v[p->light_count + i]->pdf;
	return 1 / (is_refracted(p)
			    ? path_refracted_ratio(p->v, p->passed_count, p->log_transfer, pdf)
			    : path_passed_ratio(p->v, p->light_count, p->light_count + p->passed_count - 1, pdf));
}

/* How technique 1 makes the path if its joint is refracted. */
struct refracted_joint {
	unsigned end; /* it joins x_0 to x_end; 0: it is not refracted */
	double ratio; /* its density divided by that of drawing x_1 .. x_{end-1} as their sub-path did */
};

FORCE_INLINE struct refracted_joint find_refracted_joint(struct path_context *c, const struct joined_path *p,
							 const bool without_effects)
{
	struct refracted_joint r = {0, 0};
	if (without_effects)
		return r;
	if (path_allows_refraction(c) && is_refracted(p))
		r.end = p->passed_count + 1;
	if (r.end || !path_allows_refraction(c))
		return r;
	unsigned end = path_refracted_end(p->v, p->edges);
	if (end && !is_delta(p, end))
		r.ratio = path_refracted_over_drawn_ratio(c, p->v, end);
	if (r.ratio > 0)
		r.end = end;
	return r;
}

/* Computes path_technique_ratios. r is the density of technique j divided by that of technique s, computed as if j drew
 * every vertex, although joints pass vertices without drawing them. drawn_over_joint_ratio corrects r for the joint of
 * s, once for each direction; joint_over_drawn_ratio corrects each stored ratio for the joint of j. */
FORCE_INLINE void technique_ratios(struct path_context *c, const struct joined_path *p, unsigned max_s, double *ratio,
				   const bool without_effects)
{
	const bool sees_through = !without_effects && path_allows_see_through(c);
	unsigned s = p->light_count, k = p->edges, last = max_s < k ? max_s : k,
		 joint_end = without_effects ? s : s + p->passed_count;
	for (unsigned j = 0; j <= k; j++)
		ratio[j] = 0;
	/* Technique 1 draws x_0 as seen from the vertex to which it is joined; longer light
	 * sub-paths draw it independently. */
	double pdf_toward = 1, pdf_point = 1;
	const struct refracted_joint refracted = find_refracted_joint(c, p, without_effects);
	const bool first_exists = refracted.end || technique_exists(c, p, 1, without_effects);
	if ((k >= 2 && s <= 1) || first_exists) {
		pdf_toward = path_pdf_toward(
			c, p->v[0],
			p->v[refracted.end ? refracted.end : first_not_passed(c, p, 1, without_effects)]->x.p);
		pdf_point = s >= 1 ? p->v[0]->pdf : path_pdf_emitter(c, p->v[0]);
	}
	double first = s == 1 ? pdf_point / pdf_toward : 1;
	double r = joint_end < last ? first * drawn_over_joint_ratio(c, p, true, without_effects) : first;
	for (unsigned j = joint_end; j < last && r > 0 && r < RATIO_LIMIT; j++) {
		if (j == 0 && first_exists)
			ratio[1] = r * pdf_toward / p->v[0]->pdf *
				   (refracted.end ? refracted.ratio
						  : joint_over_drawn_ratio(c, p, 1,
									   first_not_passed(c, p, 1, without_effects),
									   without_effects));
		r *= (j == 0 ? pdf_point : pdf_from_light(c, p, j, without_effects)) / p->v[j]->pdf;
		if (j > 0 && technique_exists(c, p, j + 1, without_effects))
			ratio[j + 1] =
				r * joint_over_drawn_ratio(c, p, j + 1, first_not_passed(c, p, j + 1, without_effects),
							   without_effects);
	}
	bool exceeds_limit = r >= RATIO_LIMIT;
	r = first * drawn_over_joint_ratio(c, p, false, without_effects);
	double r_end = r; /* r at x_end, the nearest vertex on the camera's side of x_j that is not passed */
	double r_refracted = 0;
	for (unsigned j = s, end = s; j > 0 && r_end > 0 && r < RATIO_LIMIT; j--) {
		r *= pdf_from_camera(c, p, j - 1, without_effects) / p->v[j - 1]->pdf;
		bool passed = sees_through && path_joint_passes(p, j - 1);
		if (!passed) {
			r_end = r;
			end = j - 1;
		}
		if (j - 1 == refracted.end)
			r_refracted = r;
		if (j - 1 == 1 && refracted.end) {
			ratio[1] = r_refracted * refracted.ratio * pdf_toward / pdf_point;
		} else if (technique_exists(c, p, j - 1, without_effects)) {
			double ratio_here =
				passed ? r_end * joint_over_drawn_ratio(c, p, j - 1, end, without_effects) : r;
			ratio[j - 1] = j - 1 == 1 ? ratio_here * pdf_toward / pdf_point : ratio_here;
		}
	}
	ratio[s] = 1;
	if (exceeds_limit || r >= RATIO_LIMIT)
		ratio[s == 0 ? k : 0] = RATIO_LIMIT;
}

static void ratios_without_effects(struct path_context *c, const struct joined_path *p, unsigned max_s, double *ratio)
{
	technique_ratios(c, p, max_s, ratio, true);
}

static __attribute__((noinline)) void ratios_with_effects(struct path_context *c, const struct joined_path *p,
							  unsigned max_s, double *ratio)
{
	technique_ratios(c, p, max_s, ratio, false);
}

void path_technique_ratios(struct path_context *c, const struct joined_path *p, unsigned max_s, double *ratio)
{
	if (EFFECT_IS_ON(c->w, has_joint_effects))
		ratios_with_effects(c, p, max_s, ratio);
	else
		ratios_without_effects(c, p, max_s, ratio);
}

FORCE_INLINE double balance_weight(struct path_context *c, const struct joined_path *p, unsigned max_s,
				   const bool without_effects)
{
	double ratio[PATH_EDGES_MAX + 2], sum = 0;
	/* The first technique that needs a light sub-path. */
	unsigned first_with_light = first_not_passed(c, p, 1, without_effects) == p->edges ? 1 : 2;
	if (without_effects)
		ratios_without_effects(c, p, max_s, ratio);
	else
		ratios_with_effects(c, p, max_s, ratio);
	for (unsigned j = 0; j <= p->edges; j++)
		sum += j >= first_with_light && c->light_subpath_interval > 1 ? ratio[j] / c->light_subpath_interval
									      : ratio[j];
	return 1 / sum;
}

double path_balance_weight(struct path_context *c, const struct joined_path *p, unsigned max_s)
{
	return balance_weight(c, p, max_s, !EFFECT_IS_ON(c->w, has_joint_effects));
}

static void assemble_path(const struct path_context *c, const struct path_vertex *light, unsigned s, unsigned t,
			  struct joined_path *p)
{
	p->light_count = s;
	p->passed_count = c->passed_count;
	p->log_transfer = c->log_transfer;
	p->edges = s + t - 1 + p->passed_count;
	for (unsigned i = 0; i < s; i++)
		p->v[i] = &light[i];
	for (unsigned i = 0; i < p->passed_count; i++)
		p->v[s + i] = &c->passed[p->passed_count - 1 - i];
	for (unsigned i = 0; i < t; i++)
		p->v[p->edges - i] = &c->camera[i];
}

spectrum path_collapse_to_hero(spectrum l, bool dispersive)
{
	if (!dispersive)
		return l;
	return (spectrum){{SPECTRUM_LANES * l.v[0]}};
}

static bool is_dispersed(const struct path_context *c, const struct joined_path *p)
{
	if (!EFFECT_IS_ON(c->w, dispersion))
		return false;
	bool dispersed = c->is_dispersed;
	for (unsigned i = 1; i < p->edges && !dispersed; i++)
		dispersed = path_vertex_disperses(p->v[i]);
	return dispersed;
}

/* Whether the edge lies in the medium that a sub-path from the light (or the camera) expects at its start. */
static bool edge_is_in(const struct joined_edge *e, uint32_t medium, bool from_light)
{
	return e->edge->has_matching_media && medium == (from_light ? e->light_medium : e->camera_medium);
}

/* Whether a sub-path from the camera would be in the same media along the edges that the light's sub-path made. */
static bool camera_media_agree(const struct path_context *c, const struct joined_path *p)
{
	double unused;
	for (unsigned i = p->light_count; i-- > 1;) {
		struct joined_edge e = joined_edge_at(p, i), before = joined_edge_at(p, i + 1);
		vec3 d = path_direction(p->v[i], p->v[i - 1], &unused);
		if (!edge_is_in(&e, path_medium_after(c->w, p->v[i], before.light_medium, d), false))
			return false;
	}
	return true;
}

unsigned path_find_mismatched_edge(const struct path_context *c, const struct joined_path *p)
{
	double unused;
	uint32_t medium = path_medium_of_emitter(c->w, p->v[0], path_direction(p->v[0], p->v[1], &unused));
	for (unsigned i = 1; i <= p->edges; i++) {
		struct joined_edge e = joined_edge_at(p, i);
		if (i > 1)
			medium = path_medium_after(c->w, p->v[i - 1], medium,
						   path_direction(p->v[i - 1], p->v[i], &unused));
		if (!edge_is_in(&e, medium, true))
			return i;
		medium = e.camera_medium;
	}
	return 0;
}

static __attribute__((noinline)) spectrum weight_with_effects(struct path_context *c, struct joined_path *p,
							      unsigned max_s, spectrum l)
{
	if (EFFECT_IS_ON(c->w, scattering)) {
		p->mismatched_edge = path_find_mismatched_edge(c, p);
		if (!technique_exists(c, p, p->light_count, false) || !camera_media_agree(c, p))
			return spectrum_constant(0);
	}
	return path_collapse_to_hero(spectrum_scale(balance_weight(c, p, max_s, false), l), is_dispersed(c, p));
}

/* Weights the contribution l of technique s. joint: edge s, where media scatter and s > 0. */
static spectrum weight_contribution(struct path_context *c, const struct path_vertex *light, unsigned s, unsigned t,
				    unsigned max_s, const struct path_edge *joint, spectrum l)
{
	struct joined_path p;
	assemble_path(c, light, s, t, &p);
	p.joint_vertices = joint;
	p.mismatched_edge = 0;
	if (EFFECT_IS_ON(c->w, has_joint_effects))
		return weight_with_effects(c, &p, max_s, l);
	return spectrum_scale(balance_weight(c, &p, max_s, true), l);
}

static spectrum hit_emitter(struct path_context *c, unsigned t, unsigned max_s)
{
	const struct path_vertex *z = &c->camera[t - 1];
	if (z->emitter < 0)
		return spectrum_constant(0);
	spectrum l = spectrum_mul(z->beta, path_emitted_radiance(c, z, z->to_prev, &c->wl));
	return spectrum_is_zero(l) ? l : weight_contribution(c, NULL, 0, t, max_s, NULL, l);
}

/* Returns the transmittance of the light sub-path's edges before its vertex s - 1, which the camera's side
 * reached through `medium`. */
static spectrum transmittance_along_light(const struct path_context *c, unsigned s, uint32_t medium)
{
	spectrum t = spectrum_constant(1);
	for (unsigned i = s - 1; i > 0; i--) {
		const struct path_vertex *v = &c->light[i];
		medium = path_medium_after(c->w, v, medium, v->to_prev);
		t = spectrum_mul(t, path_transmittance(c->w, &c->wl, medium, v, v - 1));
	}
	return t;
}

/* Returns the transmittance of absorbing media along the way to z from the emitter, through y, vertex s - 1
 * of the light's sub-path. */
static spectrum transmittance_to_light(const struct path_context *c, const struct path_vertex *z, vec3 to_light,
				       const struct path_vertex *y, unsigned s)
{
	uint32_t medium = path_medium_after(c->w, z, z->edge.medium, to_light);
	return spectrum_mul(path_transmittance(c->w, &c->wl, medium, z, y), transmittance_along_light(c, s, medium));
}

static bool media_only_absorb(const struct path_context *c)
{
	return EFFECT_IS_ON(c->w, absorption) && !EFFECT_IS_ON(c->w, scattering);
}

static inline spectrum attenuate_by_absorption(const struct path_context *c, const struct path_vertex *z, vec3 to_light,
					       const struct path_vertex *y, unsigned s, spectrum l)
{
	return media_only_absorb(c) ? spectrum_mul(l, transmittance_to_light(c, z, to_light, y, s)) : l;
}

/* Whether z and y see each other. Where media scatter, also fills in the edge between them and multiplies
 * *l by its transmittance. */
static bool is_visible_in_media(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
				struct path_edge *joint, spectrum *l)
{
	spectrum transmittance;
	if (!EFFECT_IS_ON(c->w, scattering))
		return path_is_visible(c, z, y);
	if (!path_is_visible_in_media(c, z, y, joint, &transmittance))
		return false;
	*l = spectrum_mul(*l, transmittance);
	return !spectrum_is_zero(*l);
}

static __attribute__((noinline)) spectrum visible_part_with_effects(struct path_context *c, const struct path_vertex *y,
								    unsigned s, unsigned t, vec3 to_light, spectrum l,
								    spectrum direct, struct path_edge *joint)
{
	const struct path_vertex *z = &c->camera[t - 1];
	spectrum transmittance;
	const bool can_pass = path_allows_see_through(c);
	if (s + t > c->min_depth && !spectrum_is_zero(direct) && is_visible_in_media(c, z, y, joint, &direct))
		return direct;
	if (!can_pass || spectrum_is_zero(l))
		return spectrum_constant(0);
	bool is_open = path_trace_passed(c, t > 1 ? z - 1 : NULL, z, y, &transmittance);
	unsigned edges = s + t - 1 + c->passed_count;
	if (!is_open || edges < c->min_depth || edges > c->max_depth) {
		c->passed_count = 0;
		return spectrum_constant(0);
	}
	l = spectrum_mul(l, transmittance);
	return attenuate_by_absorption(c, &c->passed[c->passed_count - 1], to_light, y, s, l);
}

/* Returns the part of l that reaches the camera's vertex t - 1 from y, vertex s - 1 of the light's sub-path,
 * directly or through surfaces; zero if they do not see each other. direct: l after absorption by media for a
 * joint that passes nothing. */
static inline spectrum visible_part(struct path_context *c, const struct path_vertex *y, unsigned s, unsigned t,
				    vec3 to_light, spectrum l, spectrum direct, struct path_edge *joint)
{
	if (EFFECT_IS_ON(c->w, has_joint_effects))
		return visible_part_with_effects(c, y, s, t, to_light, l, direct, joint);
	bool is_open = s + t > c->min_depth && !spectrum_is_zero(l) && path_is_visible(c, &c->camera[t - 1], y);
	return is_open ? l : spectrum_constant(0);
}

/* Returns the contribution of the refracted path from y, drawn with density pdf, to the camera's vertex t - 1; zero
 * if there is no such path. */
static spectrum join_refracted(struct path_context *c, const struct path_vertex *y, unsigned t, double pdf)
{
	const struct path_vertex *z = &c->camera[t - 1];
	spectrum transmittance;
	double distance2, unused;
	if (!path_trace_refracted(c, z - 1, z, y, &transmittance) || t + c->passed_count < c->min_depth ||
	    t + c->passed_count > c->max_depth) {
		c->passed_count = 0;
		return spectrum_constant(0);
	}
	const struct path_vertex *first = &c->passed[0], *last = &c->passed[c->passed_count - 1];
	vec3 d = path_direction(z, first, &distance2), to_light = path_direction(last, y, &unused);
	spectrum l = spectrum_mul(spectrum_mul(z->beta, path_scatter(c, z, z->to_prev, d)),
				  path_emitted_radiance(c, y, vec3_neg(to_light), &c->wl));
	l = spectrum_scale(path_geometry_term(z, first, d, distance2) * exp(c->log_transfer) / pdf, l);
	return attenuate_by_absorption(c, last, to_light, y, 1, spectrum_mul(l, transmittance));
}

static spectrum join_emitter(struct path_context *c, unsigned t, unsigned max_s)
{
	const struct path_vertex *z = &c->camera[t - 1];
	struct path_vertex y;
	double pdf, distance2;
	if (!path_scatters_smoothly(z) || !path_sample_next_event(c, z, &y, &pdf))
		return spectrum_constant(0);
	vec3 to_light = path_direction(z, &y, &distance2);
	if (!(distance2 > 0))
		return spectrum_constant(0);
	spectrum f = path_scatter(c, z, z->to_prev, to_light);
	spectrum l = spectrum_mul(spectrum_mul(z->beta, f), path_emitted_radiance(c, &y, vec3_neg(to_light), &c->wl));
	l = spectrum_scale(path_cosine(z, to_light) * path_cosine(&y, to_light) / distance2 / pdf, l);
	struct path_edge joint;
	l = visible_part(c, &y, 1, t, to_light, l, attenuate_by_absorption(c, z, to_light, &y, 1, l), &joint);
	if (spectrum_is_zero(l) && path_allows_refraction(c) && path_should_refract(c, z - 1, z, &y, pdf, f))
		l = join_refracted(c, &y, t, pdf);
	return spectrum_is_zero(l) ? l : weight_contribution(c, &y, 1, t, max_s, &joint, l);
}

/* Projects y on the film as seen from the lens. Sets the film point, the unit direction d to y, and *jac, the film's
 * density per area at y. Returns false if the film does not see y. */
static bool project_on_film(const struct path_context *c, const struct path_vertex *y, double film[2], vec3 *d,
			    double *jac)
{
	const struct path_vertex *eye = &c->camera[0];
	double distance2;
	struct camera storage;
	const struct camera *camera = world_camera_at(c->w, &eye->x, &storage);
	*d = path_direction(eye, y, &distance2);
	if (!(distance2 > 0) || !camera_project(camera, eye->x.p, *d, sqrt(distance2), &film[0], &film[1]))
		return false;
	if (!film_window_contains(&c->window, film))
		return false;
	*jac = camera_jac_film_from_solid(camera, *d) * path_jac_solid_from_vertex(y, *d, distance2);
	return true;
}

/* Joins the s vertices from `light` on to the lens. l is the contribution without visibility and absorption. */
static spectrum join_lens(struct path_context *c, const struct path_vertex *light, unsigned s, unsigned max_s, vec3 d,
			  spectrum l)
{
	const struct path_vertex *y = &light[s - 1];
	struct path_edge joint;
	l = visible_part(c, y, s, 1, d, l, attenuate_by_absorption(c, &c->camera[0], d, y, s, l), &joint);
	return spectrum_is_zero(l) ? l : weight_contribution(c, light, s, 1, max_s, &joint, l);
}

static spectrum join_camera(struct path_context *c, unsigned s, unsigned max_s, double film[2])
{
	const struct path_vertex *y = &c->light[s - 1];
	vec3 d;
	double jac;
	if (!project_on_film(c, y, film, &d, &jac))
		return spectrum_constant(0);
	spectrum l = spectrum_mul(y->beta, path_scatter(c, y, vec3_neg(d), y->to_prev));
	return join_lens(c, c->light, s, max_s, d, spectrum_scale(jac, l));
}

/* Joins a point of an emitter to the lens: few film samples, or none, hit a small or distant emitter. */
static spectrum join_emitter_to_lens(struct path_context *c, unsigned max_s, double film[2])
{
	struct path_vertex y;
	double pdf, jac;
	vec3 d;
	if (!path_sample_next_event(c, &c->camera[0], &y, &pdf) || !path_can_be_hit(c, &y) ||
	    !can_join_lens(c, &c->camera[0], &y))
		return spectrum_constant(0);
	if (!project_on_film(c, &y, film, &d, &jac))
		return spectrum_constant(0);
	spectrum l = spectrum_scale(jac / pdf, path_emitted_radiance(c, &y, vec3_neg(d), &c->wl));
	return join_lens(c, &y, 1, max_s, d, l);
}

/* Returns the factor by which a connection with contribution l counts: 1, or, if it is faint, 1 / q with probability q
 * and otherwise 0, which saves its rays. q should depend on the weight of the connection, but that is not known yet;
 * light_subpath_interval / edges stands for it, as if all techniques had the same weight. So the contribution of a
 * faint connection that is made is at most `edges` times `faint_threshold`, whatever its weight turns out to be. */
static double faint_connection_factor(struct path_context *c, unsigned edges, spectrum l)
{
	double estimate =
		spectrum_mean(l) * ((c->light_subpath_interval > 1 ? c->light_subpath_interval : 1) / (double)edges);
	if (!isgreater(estimate, 0) || !isless(estimate, c->faint_threshold))
		return 1;
	double q = estimate / c->faint_threshold, start = c->faint_position;
	c->faint_position += q;
	return floor(c->faint_position) > floor(start) ? 1 / q : 0;
}

static spectrum join_surfaces(struct path_context *c, unsigned s, unsigned t, unsigned max_s)
{
	const struct path_vertex *y = &c->light[s - 1], *z = &c->camera[t - 1];
	double distance2;
	vec3 to_light = path_direction(z, y, &distance2);
	if (!(distance2 > 0))
		return spectrum_constant(0);
	spectrum l = spectrum_mul(y->beta, path_scatter(c, y, vec3_neg(to_light), y->to_prev));
	if (spectrum_is_zero(l)) /* usually because z lies behind an opaque surface at y */
		return l;
	l = spectrum_mul(l, spectrum_mul(z->beta, path_scatter(c, z, z->to_prev, to_light)));
	l = spectrum_scale(path_geometry_term(z, y, to_light, distance2), l);
	spectrum direct = attenuate_by_absorption(c, z, to_light, y, s, l);
	if (spectrum_is_zero(l))
		return l;
	double factor = faint_connection_factor(c, s + t - 1, direct);
	if (factor == 0)
		return spectrum_constant(0);
	struct path_edge joint;
	l = visible_part(c, y, s, t, to_light, spectrum_scale(factor, l), spectrum_scale(factor, direct), &joint);
	return spectrum_is_zero(l) ? l : weight_contribution(c, c->light, s, t, max_s, &joint, l);
}

spectrum path_connect(struct path_context *c, unsigned s, unsigned t, unsigned max_s, double film[2])
{
	c->passed_count = 0;
	if (s == 0)
		return hit_emitter(c, t, max_s);
	if (t > 1 && c->camera[t - 1].kind == VERTEX_INFINITE)
		return spectrum_constant(0);
	if (t == 1)
		return s == 1 ? join_emitter_to_lens(c, max_s, film) : join_camera(c, s, max_s, film);
	return s == 1 ? join_emitter(c, t, max_s) : join_surfaces(c, s, t, max_s);
}
