/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds vertices x_{b-1} .. x_{c+1} with given half vectors h*, by Newton's method (see walk.h).
 *
 * Each iteration solves M dx = h* - h, where M = dh/dx is block tridiagonal, moves every vertex by step * dx in its
 * tangent plane and projects it back onto the surface along the ray from the vertex before it. If the largest residual,
 * |h* - h|^2 / (1 + |h|^2), has shrunk, the trial is kept and the step doubled, up to 1; otherwise the vertices stay
 * and the step is halved. The walk succeeds when each |h* - h| is within its vertex's tolerance and every edge is
 * unoccluded, which is not tested if the caller knows it. At least one trial is made, because the rays of the initial
 * path were never traced. The walk fails if the step becomes too short (the reason is that of the last trial: missed,
 * blocked, another mode, or residuals grew), if M is singular, or if the iterations run out.
 */
#include "worker/render/halfvec/walk.h"

#include "worker/render/halfvec/constraint_system.h"
#include "worker/render/path/media.h"

struct walk_limits walk_limits_of(const struct accuracy_settings *k)
{
	return (struct walk_limits){(unsigned)k->iterations, k->least_step,	     1, k->tolerance,
				    k->reverse_tolerance,    constraint_solver_of(k)};
}

/* The state of a walk. Trials start from the accepted state, so a rejected trial leaves nothing to undo. */
struct walk {
	struct path_context *c;
	struct full_path *y; /* the path of the trial */
	unsigned b, c_end;
	const struct walk_target *target;
	const struct constraint_solver *solver;
	double tolerance_scale; /* factor on the tolerances of a forward walk */
	bool is_reverse;
	struct walk_scratch *scratch;
	/* Bit j: light leaves vertex j on the side of the geometric normal. */
	uint64_t above_bits;
	/* Bit e: a ray of this trial has hit the next vertex along edge e. */
	uint64_t hit_edges;
	vec3 newton_step[FULL_PATH_VERTICES_MAX]; /* full, from the accepted state */
};

static uint64_t vertex_bit(unsigned i)
{
	return (uint64_t)1 << i;
}

static bool light_is_above(const struct full_path *y, unsigned j)
{
	return vec3_dot(y->v[j].x.ng, y->edge[j - 1].w) < 0;
}

static bool mode_is_unchanged(const struct full_path *y, unsigned j)
{
	return full_path_mode(y, j) == (y->v[j].mode & (BSDF_REFLECT | BSDF_TRANSMIT));
}

/* Moves the vertex to where a ray along d hits a surface of the same material, possibly another primitive. The ray
 * passes surfaces that are not vertices (path/media.h). */
static enum walk_result cast_ray(struct walk *m, unsigned j, vec3 d)
{
	const struct world *w = m->c->w;
	const struct path_vertex *from = &m->y->v[j + 1];
	struct path_vertex *to = &m->y->v[j];
	bool from_camera = from->kind == VERTEX_CAMERA;
	struct ray_end start = {from->x.p, from_camera ? (vec3){0, 0, 0} : from->x.ng, from->x.prim};
	double t_min = 0, t_max = INFINITY;
	struct camera storage;
	if (from_camera)
		camera_clip_range(world_camera_at(w, &from->x, &storage), d, &t_min, &t_max);
	struct ray_hit hit;
	const struct shape_binding *binding;
	for (unsigned faces = 0;; faces++) {
		m->c->counters[COUNT_RAYS_CLOSEST]++;
		if (faces > PATH_NULL_FACES_MAX || !accel_closest(w->accel, &start, d, t_min, t_max, &hit))
			return WALK_MISSED;
		binding = &w->shape_bindings[hit.prim.shape];
		surface_from_hit(&w->shapes[hit.prim.shape], start.p, d, &hit, &to->x);
		if (!binding->is_null_face)
			break;
		t_max -= vec3_length(vec3_sub(to->x.p, start.p));
		start = (struct ray_end){to->x.p, to->x.ng, to->x.prim};
		t_min = 0;
	}
	if (&w->bsdfs[binding->bsdf] != to->bsdf)
		return WALK_BLOCKED;
	to->emitter = binding->emitter;
	m->hit_edges |= vertex_bit(j);
	return WALK_OK;
}

/* Projects vertex j of the trial onto the surface, along the ray from the previous vertex
 * towards the predicted position. */
static enum walk_result project_back(struct walk *m, unsigned j, double step)
{
	const struct path_vertex *from = &m->y->v[j + 1], *accepted = &m->scratch->accepted[j];
	struct path_vertex *to = &m->y->v[j];
	vec3 d = vec3_sub(vec3_madd(accepted->x.p, step, m->newton_step[j]), from->x.p);
	double t = vec3_length(d);
	if (!(t > 0) || !isfinite(t))
		return WALK_MISSED;
	d = vec3_scale(1 / t, d);
	struct prim_ref prim = accepted->x.prim;
	if (!surface_reproject(&m->c->w->shapes[prim.shape], prim, from->x.prim, from->x.p, d, t, &to->x))
		return cast_ray(m, j, d);
	to->emitter = accepted->emitter;
	return WALK_OK;
}

static enum walk_result try_step(struct walk *m, double step)
{
	struct full_path *y = m->y;
	m->hit_edges = 0;
	for (unsigned j = m->b - 1;; j--) {
		if (j > m->c_end) {
			enum walk_result result = project_back(m, j, step);
			if (result != WALK_OK)
				return result;
		}
		if (!full_path_compute_edge(y, j))
			return WALK_SINGULAR;
		if (j + 1 < m->b &&
		    (!mode_is_unchanged(y, j + 1) || light_is_above(y, j + 1) != ((m->above_bits >> (j + 1)) & 1)))
			return WALK_MODE_CHANGED;
		if (j == m->c_end)
			return WALK_OK;
	}
}

/* How near the half vectors scratch->k[].h are to the targets. */
struct residual_summary {
	double error;		/* the largest residual, for step control */
	bool is_within_forward; /* all are within the tolerances of a forward walk */
	bool is_within;		/* all are within the tolerances of this walk */
};

static struct residual_summary compute_residuals(struct walk *m)
{
	struct residual_summary n = {0, true, true};
	for (unsigned j = m->c_end + 1; j < m->b; j++) {
		vec2 h = m->scratch->k[j].h, r = vec2_sub(m->target[j].h, h);
		double tolerance = m->tolerance_scale * m->target[j].tolerance, r2 = vec2_dot(r, r);
		double limit = m->is_reverse ? WALK_REVERSE_SCALE * tolerance : tolerance;
		m->scratch->residual[j] = r;
		if (!isfinite(r2))
			return (struct residual_summary){INFINITY, false, false};
		n.is_within_forward = n.is_within_forward && r2 <= tolerance * tolerance;
		n.is_within = n.is_within && r2 <= limit * limit;
		n.error = fmax(n.error, r2 / (1 + vec2_dot(h, h)));
	}
	return n;
}

/* Makes the trial the accepted state and computes Newton's step from there. factored: s->system already belongs to
 * s->k. */
static enum walk_result accept_trial(struct walk *m, bool factored)
{
	struct walk_scratch *s = m->scratch;
	if (!factored && m->solver->factor_to_solve(s->k, m->b, m->c_end, &s->system) != CONSTRAINT_OK)
		return WALK_SINGULAR;
	m->solver->solve(s->k, &s->system, s->residual, s->dx);
	for (unsigned j = m->c_end + 1; j < m->b; j++) {
		s->accepted[j].x = m->y->v[j].x;
		s->accepted[j].emitter = m->y->v[j].emitter;
		if (!isfinite(s->dx[j].x) || !isfinite(s->dx[j].y))
			return WALK_SINGULAR;
		vec3 du, dv;
		surface_tangents(&s->accepted[j].x, &du, &dv);
		m->newton_step[j] = vec3_madd(vec3_scale(s->dx[j].x, du), s->dx[j].y, dv);
	}
	return WALK_OK;
}

static enum walk_result begin_walk(struct walk *m)
{
	struct full_path *y = m->y;
	for (unsigned e = m->c_end; e < m->b; e++)
		if (!full_path_compute_edge(y, e))
			return WALK_SINGULAR;
	for (unsigned j = m->c_end + 1; j < m->b; j++) {
		if (!mode_is_unchanged(y, j))
			return WALK_MODE_CHANGED;
		if (light_is_above(y, j))
			m->above_bits |= vertex_bit(j);
	}
	return WALK_OK;
}

/* Whether all edges are unoccluded. Where media scatter, every edge is traced, because its transmittance is needed. */
static bool all_edges_are_visible(const struct walk *m)
{
	uint64_t hit_edges = EFFECT_IS_ON(m->c->w, scattering) ? 0 : m->hit_edges;
	for (unsigned e = m->b; e-- > m->c_end;)
		if (!(hit_edges & vertex_bit(e)) && !full_path_edge_is_visible(m->c, m->y, e))
			return false;
	return true;
}

static void compute_constraints(struct walk *m, unsigned b, unsigned end)
{
	constraints_compute(m->c->w, m->y, b, end, m->scratch->k);
}

static void refresh_constraints(struct walk *m, unsigned stale)
{
	if (stale & WALK_STALE_ALL) {
		compute_constraints(m, m->b, m->c_end);
		return;
	}
	if (stale & WALK_STALE_B)
		compute_constraints(m, m->b, m->b - 2);
	if (stale & WALK_STALE_C)
		compute_constraints(m, m->c_end + 2, m->c_end);
}

/* Evaluates the trial. Half vectors alone are cheap; derivatives are only computed if the walk continues
 * or the caller needs them. */
static struct residual_summary evaluate_trial(struct walk *m)
{
	for (unsigned j = m->c_end + 1; j < m->b; j++)
		m->scratch->k[j].h = halfvec_of(m->y, j);
	return compute_residuals(m);
}

/* Iterates until the residuals are small enough, or returns the reason for failing. */
static enum walk_result iterate(struct walk *m, const struct walk_limits *limits, unsigned stale)
{
	struct walk_scratch *s = m->scratch;
	refresh_constraints(m, stale);
	double error = compute_residuals(m).error, step = 1;
	unsigned max_iterations = limits->max_iterations;
	enum walk_result result = isfinite(error) ? accept_trial(m, !stale) : WALK_SINGULAR;
	if (result != WALK_OK)
		return result;
	while (s->iterations < max_iterations) {
		s->iterations++;
		result = try_step(m, step);
		if (result == WALK_OK) {
			struct residual_summary current = evaluate_trial(m);
			if (current.is_within ? !m->is_reverse : current.error < error)
				compute_constraints(m, m->b, m->c_end);
			if (current.is_within)
				return WALK_OK;
			if (current.is_within_forward)
				max_iterations = 2 * limits->max_iterations;
			if (current.error < error) {
				error = current.error;
				result = accept_trial(m, false);
				if (result != WALK_OK)
					return result;
				step = fmin(1, 2 * step);
				continue;
			}
			result = WALK_DIVERGED;
		}
		step /= 2;
		if (step < limits->min_step)
			return result;
	}
	return result == WALK_OK ? WALK_ITERATION_LIMIT : result;
}

enum walk_result halfvec_walk(struct path_context *c, struct full_path *y, unsigned b, unsigned c_end,
			      const struct walk_target *target, bool is_reverse, const struct walk_limits *limits,
			      unsigned stale, struct walk_scratch *s)
{
	assert(c_end + 1 < b && b <= y->edges);
	struct walk m = {.c = c,
			 .y = y,
			 .b = b,
			 .c_end = c_end,
			 .target = target,
			 .solver = limits->solver,
			 .tolerance_scale = limits->tolerance_scale,
			 .is_reverse = is_reverse,
			 .scratch = s};
	s->iterations = 0;
	full_path_invalidate(y, c_end + 1, b - 1);
	enum walk_result result = begin_walk(&m);
	if (result == WALK_OK)
		result = iterate(&m, limits, stale);
	if (result != WALK_OK || is_reverse)
		return result;
	if (!all_edges_are_visible(&m))
		return WALK_BLOCKED;
	for (unsigned j = c_end + 1; j < b; j++)
		surface_uv(&c->w->shapes[y->v[j].x.prim.shape], &y->v[j].x);
	return WALK_OK;
}
