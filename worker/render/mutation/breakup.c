/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Proposes a path y from x for a given b and c, and computes its weight (Hanika, Kaplanyan,
 * Dachsbacher 2015, sec. 4 and 5).
 *
 * x_{k-1} .. x_b are traced. Between x_b and x_c each half vector that is not exactly specular takes a Gaussian step,
 * h' = h + dh, and the walk finds vertices that have the new half vectors; a second walk must lead from y back to x.
 * With c = b - 1 there is nothing to walk: x_b and x_c are joined. The logarithm of the weight is that of
 *
 * prod_{j <= c, j = b} f_j  prod_{other j < k} f_j |d i_j^perp / d h_j|  G_b |det d x_{b-1} / d x_c|  /  q
 *
 * with f_0 = L_e, i_j the direction from x_j towards the light, h in slopes, G_b the cosines, the distance and the
 * camera's Jacobian at the edge x_b x_{b-1}, and q the densities of the choice of b and c, of the steps and of the
 * point on the emitter; factors common to f and q are never computed. Each edge also has the transmittance of its media
 * as a factor. Where media scatter, x_j may be an event: f_j is then sigma_s times the phase function, without a half
 * vector, and if x_j was traced there is a factor |x_j - x_{j+1}|, because the logarithm of its distance takes the
 * step. A proposal fails, with the reason counted, if a ray misses, an edge is occluded, a vertex would scatter in
 * another mode, the matrix is singular, the walk does not converge or does not lead back, or the path leaves the film.
 */
#include "worker/render/mutation/breakup.h"

#include "worker/render/mutation/trace.h"
#include "worker/render/path/media.h"

#include <string.h>

/* Rounding of positions, as a fraction of the adjacent edges. */
#define ROUNDING 0x1p-40
/* Step of x_0, in the random numbers that produce it. */
#define EMITTER_STEP 0.1
/* Largest change of the number that determines the wavelengths in dispersive scenes (sec. 6: 50 nm of 470). In other
 * scenes the number is drawn afresh, because all wavelengths are equally good. */
#define WAVELENGTH_STEP (50.0 / 470)

bool breakup_is_allowed(const struct full_path *x, unsigned b, unsigned c)
{
	unsigned k = x->edges;
	if (b > k || (b > 0 && b < k && x->v[b].is_delta))
		return false;
	for (unsigned j = c + 1; j < b; j++)
		if (x->v[j].kind == VERTEX_MEDIUM)
			return false;
	return b == 0 || (c < b && !(c > 0 && x->v[c].is_delta));
}

/* Returns the number for the new wavelength: a symmetric step, reflected at the ends of the range. */
static double move_wavelength(const struct path_context *c, double u, double r)
{
	if (!EFFECT_IS_ON(c->w, dispersion))
		return r;
	double v = u + (2 * r - 1) * WAVELENGTH_STEP;
	v = v < 0 ? -v : v >= 1 ? 2 - v : v;
	return v < 1 ? v : u;
}

/* Whether a vertex that stays would have to move for another wavelength, so that the wavelength must be kept. */
static bool must_keep_wavelength(const struct path_context *c, const struct full_path *x, unsigned b, unsigned c_end)
{
	if (!EFFECT_IS_ON(c->w, dispersion) || b == 0)
		return false;
	for (unsigned j = 1; j < c_end; j++)
		if (x->v[j].is_delta && x->v[j].bsdf->is_dispersive)
			return true;
	return false;
}

static bool move_emitter(struct mutation_ctx *m, const struct full_path *x, struct full_path *y,
			 struct proposal_move *move)
{
	const struct path_context *c = m->path;
	const struct path_vertex *v = &x->v[0];
	struct emitter_storage storage;
	const struct emitter *em = world_emitter_at(c->w, v->emitter, v->x.prim.time, &storage);
	struct emitter_point p = world_emitter_point(&v->x);
	double u[2], r[4], pdf;
	p.is_infinite = v->kind == VERTEX_INFINITE;
	move->log_density[MUTATION_REVERSE] += log(em->ops->pdf_point(em, &p));
	em->ops->point_inverse(em, &p, u);
	mutation_draw_uniforms(m, BLOCK_VERTEX, r);
	if (!mutation_step_in_square(u, r, EMITTER_STEP))
		return false;
	if (!em->ops->sample_point(em, u, &p, &pdf) || !(pdf > 0))
		return false;
	y->v[0] = path_emitter_vertex(c->w, v->emitter, &p, v->x.prim.time);
	move->log_density[MUTATION_FORWARD] += log(pdf);
	return true;
}

static enum proposal_result result_of_walk(enum walk_result result)
{
	switch (result) {
	case WALK_OK:
		return PROPOSAL_MADE;
	case WALK_MISSED:
		return PROPOSAL_MISSED;
	case WALK_BLOCKED:
		return PROPOSAL_BLOCKED;
	case WALK_MODE_CHANGED:
		return PROPOSAL_MODE_CHANGED;
	case WALK_SINGULAR:
		return PROPOSAL_SINGULAR;
	case WALK_DIVERGED:
		return PROPOSAL_DIVERGED;
	case WALK_ITERATION_LIMIT:
		break;
	}
	return PROPOSAL_ITERATION_LIMIT;
}

static double halfvec_tolerance(const struct mutation_ctx *m, const struct path_vertex *v, const struct halfvec_step *s)
{
	if (v->is_delta)
		return WALK_SPECULAR_TOLERANCE;
	return m->limits.tolerance * fmin(halfvec_lobe_width(v), fmin(s->sigma[0], s->sigma[1]));
}

/* Draws the steps of the half vectors and sets their targets. */
static void set_targets(struct mutation_ctx *m, const struct breakup *breakup, const struct full_path *x)
{
	struct mutation_scratch *s = &m->scratch;
	for (unsigned j = breakup->c + 1; j < breakup->b; j++) {
		struct walk_target *t = &s->target[j];
		s->dh[j] = (vec2){0, 0};
		t->tolerance = halfvec_tolerance(m, &x->v[j], &s->step[MUTATION_FORWARD][j]);
		t->h = x->v[j].is_delta ? (vec2){0, 0} : s->constraints[j].h;
		if (x->v[j].is_delta || !breakup->moves_halfvecs)
			continue;
		double r[4], g[2];
		mutation_draw_uniforms(m, BLOCK_VERTEX + j, r);
		mutation_normals_from_uniform(r, g);
		s->dh[j] = halfvec_step_sample(&s->step[MUTATION_FORWARD][j], g[0], g[1]);
		t->h = vec2_add(t->h, s->dh[j]);
	}
}

static void add_step_densities(struct mutation_ctx *m, const struct breakup *breakup, const struct full_path *x,
			       struct proposal_move *move)
{
	const struct mutation_scratch *s = &m->scratch;
	for (unsigned j = breakup->c + 1; breakup->moves_halfvecs && j < breakup->b; j++) {
		if (x->v[j].is_delta)
			continue;
		move->log_density[MUTATION_FORWARD] += halfvec_step_log_pdf(&s->step[MUTATION_FORWARD][j], s->dh[j]);
		move->log_density[MUTATION_REVERSE] +=
			halfvec_step_log_pdf(&s->step[MUTATION_REVERSE][j], vec2_scale(-1, s->dh[j]));
	}
}

/* Returns which constraints of one path are stale when the walk to the other starts from it. */
static unsigned stale_constraints(const struct mutation_ctx *m, const struct breakup *breakup,
				  const struct full_path *x, const struct full_path *y)
{
	if (EFFECT_IS_ON(m->path->w, dispersion) && x->wavelength_u != y->wavelength_u)
		return WALK_STALE_ALL;
	bool aperture = breakup->moves_aperture && EFFECT_IS_ON(m->path->w, aperture);
	bool b_moved = breakup->b < x->edges || aperture, c_moved = breakup->c == 0 && breakup->moves_emitter;
	return (b_moved ? WALK_STALE_B : 0) | (c_moved ? WALK_STALE_C : 0);
}

/* Whether the walk from y leads back to x. If it does not, the proposal cannot be reversed, and detailed
 * balance requires rejecting it. */
static bool is_reversible(struct mutation_ctx *m, const struct breakup *breakup, const struct full_path *x,
			  const struct full_path *y)
{
	struct mutation_scratch *s = &m->scratch;
	unsigned b = breakup->b, c = breakup->c;
	struct full_path *reverse = &s->reverse_path;
	full_path_copy(reverse, y, c, b);
	reverse->v[b] = x->v[b];
	reverse->v[c] = x->v[c];
	reverse->wl = x->wl;
	double max_move2 = 0;
	for (unsigned j = c + 1; j < b; j++) {
		vec3 d = vec3_sub(y->v[j].x.p, x->v[j].x.p);
		max_move2 = fmax(max_move2, vec3_dot(d, d));
		s->target[j].h = x->v[j].is_delta ? (vec2){0, 0} : s->constraints[j].h;
		s->target[j].tolerance = halfvec_tolerance(m, &x->v[j], &s->step[MUTATION_FORWARD][j]);
	}
	m->counters[STRATEGY_REVERSE_WALKS]++;
	enum walk_result result = halfvec_walk(m->path, reverse, b, c, s->target, true, &m->limits,
					       stale_constraints(m, breakup, x, y), &s->walk);
	m->counters[STRATEGY_WALKS]++;
	m->counters[STRATEGY_ITERATIONS] += s->walk.iterations;
	if (result != WALK_OK)
		return false;
	double tolerance = m->limits.reverse_tolerance * m->limits.tolerance_scale;
	for (unsigned j = c + 1; j < b; j++) {
		vec3 d = vec3_sub(reverse->v[j].x.p, x->v[j].x.p);
		double rounding = ROUNDING * ROUNDING * (x->edge[j].distance2 + x->edge[j - 1].distance2);
		if (vec3_dot(d, d) > fmax(tolerance * tolerance * max_move2, rounding))
			return false;
	}
	return true;
}

/* Moves the vertices between x_b and x_c by half vectors. */
static enum proposal_result walk_between(struct mutation_ctx *m, const struct breakup *breakup, struct full_path *x,
					 struct full_path *y, struct proposal_move *move)
{
	struct mutation_scratch *s = &m->scratch;
	struct path_context *c = m->path;
	constraints_compute(c->w, x, breakup->b, breakup->c, s->constraints);
	if (m->limits.solver->factor(s->constraints, breakup->b, breakup->c, &s->walk.system) != CONSTRAINT_OK)
		return PROPOSAL_SINGULAR;
	move->log_transfer[MUTATION_REVERSE] = s->walk.system.log_transfer;
	halfvec_compute_steps(c, x, s->constraints, breakup->b, breakup->c, s->step[MUTATION_FORWARD]);
	set_targets(m, breakup, x);
	memcpy(&s->walk.k[breakup->c + 1], &s->constraints[breakup->c + 1],
	       (breakup->b - breakup->c - 1) * sizeof s->constraints[0]);
	enum walk_result result = halfvec_walk(c, y, breakup->b, breakup->c, s->target, false, &m->limits,
					       stale_constraints(m, breakup, x, y), &s->walk);
	m->counters[STRATEGY_WALKS]++;
	m->counters[STRATEGY_ITERATIONS] += s->walk.iterations;
	if (result != WALK_OK)
		return result_of_walk(result);
	if (m->limits.solver->factor(s->walk.k, breakup->b, breakup->c, &s->walk.system) != CONSTRAINT_OK)
		return PROPOSAL_SINGULAR;
	move->log_transfer[MUTATION_FORWARD] = s->walk.system.log_transfer;
	halfvec_compute_steps(c, y, s->walk.k, breakup->b, breakup->c, s->step[MUTATION_REVERSE]);
	add_step_densities(m, breakup, x, move);
	return is_reversible(m, breakup, x, y) ? PROPOSAL_MADE : PROPOSAL_IRREVERSIBLE;
}

static enum proposal_result join_edge(struct mutation_ctx *m, unsigned e, struct full_path *y)
{
	return full_path_compute_edge(y, e) && full_path_edge_is_visible(m->path, y, e) ? PROPOSAL_MADE
											: PROPOSAL_BLOCKED;
}

/* Sets the mode in which x_j scatters now that its neighbours have moved. Returns false if it cannot scatter. */
static bool set_mode(struct full_path *y, unsigned j)
{
	if (j == 0 || j == y->edges)
		return true;
	y->v[j].mode = full_path_mode(y, j);
	return y->v[j].mode != 0;
}

/* Whether x_c .. x_0 are still in the same media. They are, unless x_c states no medium and is now
 * reached through another one. */
static bool media_are_unchanged(const struct path_context *c, const struct full_path *y, unsigned c_end)
{
	const struct path_vertex *v = &y->v[c_end];
	if (!EFFECT_IS_ON(c->w, scattering) || c_end == 0)
		return true;
	vec3 to_light = vec3_neg(y->edge[c_end - 1].w);
	return path_medium_after(c->w, v, v->edge.medium, to_light) == y->v[c_end - 1].edge.previous_medium;
}

/* Recomputes the transmittance of all edges if the wavelength changed. Returns false if an edge is occluded. */
static bool retrace_media(struct path_context *c, const struct full_path *x, struct full_path *y,
			  struct proposal_move *move)
{
	if (!EFFECT_IS_ON(c->w, scattering) || y->wavelength_u == x->wavelength_u)
		return true;
	move->first = 0;
	return full_path_edges_are_visible(c, y);
}

/* Whether some vertex that would need a half vector scatters with a turned normal. Half vectors cannot describe such a
 * vertex, so the path has no weight and no move. */
static bool has_turned_normal(const struct full_path *x, unsigned b, unsigned c)
{
	for (unsigned j = c + 1; j < x->edges; j++)
		if (j != b && full_path_is_turned(x, j))
			return true;
	return false;
}

enum proposal_result breakup_propose(struct mutation_ctx *m, const struct breakup *breakup, struct full_path *x,
				     struct full_path *y, struct proposal_move *move)
{
	struct path_context *c = m->path;
	unsigned k = x->edges, b = breakup->b, c_end = b > 0 ? breakup->c : 0;
	*move = (struct proposal_move){
		.first = c_end, .last = k, .b = b, .c = c_end, .log_density = {breakup->log_choice, 0}};
	if (breakup->moves_wavelength && EFFECT_IS_ON(c->w, colour) && !must_keep_wavelength(c, x, b, c_end)) {
		double r[4];
		mutation_draw_uniforms(m, BLOCK_ENDS, r);
		full_path_set_wavelength(c, y, move_wavelength(c, x->wavelength_u, r[0]));
	}
	bool aperture = breakup->moves_aperture && EFFECT_IS_ON(c->w, aperture);
	enum proposal_result result = PROPOSAL_MADE;
	if (has_turned_normal(x, b, c_end))
		return PROPOSAL_MODE_CHANGED;
	if (b == c_end && b > 0)
		return retrace_media(c, x, y, move) ? PROPOSAL_MADE : PROPOSAL_BLOCKED;
	if (b < k)
		result = trace_multichain(m, b, aperture, x, y, move);
	else if (aperture && !trace_move_aperture(m, x, y))
		result = PROPOSAL_OUTSIDE;
	if (!result && breakup->moves_emitter && !move_emitter(m, x, y, move))
		result = PROPOSAL_OUTSIDE;
	if (!result && b > 0)
		result = b - c_end >= 2 ? walk_between(m, breakup, x, y, move) : join_edge(m, c_end, y);
	move->first = c_end;
	if (result)
		return result;
	full_path_invalidate(y, c_end + 1, k);
	if (!set_mode(y, b) || !set_mode(y, c_end) || !media_are_unchanged(c, y, c_end))
		return PROPOSAL_MODE_CHANGED;
	if (!retrace_media(c, x, y, move))
		return PROPOSAL_BLOCKED;
	if (EFFECT_IS_ON(c->w, scattering) && !full_path_can_be_made(c, y))
		return PROPOSAL_BLACK;
	return b < k || full_path_project(c, y) ? PROPOSAL_MADE : PROPOSAL_OUTSIDE;
}

/* Returns the logarithm of the cosines, distances and Jacobians that do not cancel between f and T, by sec. 5. Only one
 * geometric normal remains, at x_{b-1}. */
static double log_geometry(const struct path_context *c, const struct full_path *x, unsigned b, unsigned c_end)
{
	if (b == 0 || b == c_end)
		return 0;
	const struct full_path_edge *e = &x->edge[b - 1];
	double log_g = log(path_cosine(&x->v[b - 1], e->w) / e->distance2);
	/* x_c does not move, but may use its own normal in x and the turned one in y. */
	if (c_end > 0 && full_path_is_turned(x, c_end))
		log_g += log(full_path_cosine_to_light(x, c_end) /
			     fabs(vec3_dot(x->v[c_end].x.sh.n, x->edge[c_end - 1].w)));
	struct camera storage;
	if (b == x->edges)
		return log_g +
		       log(camera_jac_film_from_solid(world_camera_at(c->w, &x->v[b].x, &storage), vec3_neg(e->w)));
	return log_g + log(full_path_cosine_to_light(x, b));
}

/* Returns the logarithm of the Jacobians of the distances to events in the traced part, which take
 * steps in their logarithm. */
static double log_distance_jacobian(const struct full_path *x, unsigned b)
{
	double sum = 0;
	for (unsigned j = b; j < x->edges; j++)
		if (x->v[j].kind == VERTEX_MEDIUM)
			sum += 0.5 * log(x->edge[j].distance2);
	return sum;
}

double breakup_log_weight(struct mutation_ctx *m, struct full_path *into, const struct proposal_move *move,
			  enum mutation_direction direction)
{
	const struct path_context *c = m->path;
	struct scaled_product p = PRODUCT_ONE;
	for (unsigned j = 0; j < into->edges; j++)
		scaled_product_mul(&p, j <= move->c || j == move->b ? full_path_eval_f(c, into, j)
								    : full_path_eval_fh(c, into, j));
	full_path_attenuate(c->w, into, &p);
	return scaled_product_log_intensity(c, into, &p) + log_geometry(c, into, move->b, move->c) +
	       (EFFECT_IS_ON(c->w, scattering) ? log_distance_jacobian(into, move->b) : 0) +
	       move->log_transfer[direction] - move->log_density[direction];
}
