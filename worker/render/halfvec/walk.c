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

/* The state of a walk. Trials start from the kept state, so a rejected trial leaves nothing to undo. */
struct walk {
	struct path_context *c;
	struct full_path *y; /* the path of the trial */
	unsigned b, end;
	const struct walk_target *target;
	const struct constraint_solver *solver;
	double scale; /* factor on the tolerances of a forward walk */
	bool back;
	struct walk_scratch *s;
	/* Bit j: light leaves vertex j on the side of the geometric normal. */
	uint64_t above;
	/* Bit e: a ray of this trial has hit the next vertex along edge e. */
	uint64_t seen;
	vec3 move[FULL_PATH_MAX_VERTICES]; /* a full Newton step from the kept state */
};

static uint64_t bit_of(unsigned i)
{
	return (uint64_t)1 << i;
}

static bool light_above(const struct full_path *y, unsigned j)
{
	return vec3_dot(y->v[j].x.ng, y->edge[j - 1].w) < 0;
}

static bool mode_holds(const struct full_path *y, unsigned j)
{
	return full_path_mode(y, j) == (y->v[j].mode & (BSDF_REFLECT | BSDF_TRANSMIT));
}

/* Moves the vertex to where a ray along d hits a surface of the same material, possibly another primitive. The ray
 * passes surfaces that are not vertices (path/media.h). */
static enum walk_end cast(struct walk *m, unsigned j, vec3 d)
{
	const struct world *w = m->c->w;
	const struct path_vertex *from = &m->y->v[j + 1];
	struct path_vertex *to = &m->y->v[j];
	bool camera = from->kind == VERTEX_CAMERA;
	struct ray_end start = {from->x.p, camera ? (vec3){0, 0, 0} : from->x.ng, from->x.prim};
	double t_min = 0, t_max = INFINITY;
	struct camera room;
	if (camera)
		camera_clip(world_camera(w, &from->x, &room), d, &t_min, &t_max);
	struct ray_hit hit;
	const struct world_shape *part;
	for (unsigned faces = 0;; faces++) {
		m->c->counters[COUNT_RAYS_CLOSEST]++;
		if (faces > PATH_FACES_MOST || !accel_closest(w->accel, &start, d, t_min, t_max, &hit))
			return WALK_MISSED;
		part = &w->parts[hit.prim.shape];
		surface_from_hit(&w->shapes[hit.prim.shape], start.p, d, &hit, &to->x);
		if (!part->passable)
			break;
		t_max -= vec3_length(vec3_sub(to->x.p, start.p));
		start = (struct ray_end){to->x.p, to->x.ng, to->x.prim};
		t_min = 0;
	}
	if (&w->bsdfs[part->bsdf] != to->bsdf)
		return WALK_BLOCKED;
	to->emitter = part->emitter;
	m->seen |= bit_of(j);
	return WALK_OK;
}

/* Projects vertex j of the trial onto the surface, along the ray from the previous vertex
 * towards the predicted position. */
static enum walk_end put_back(struct walk *m, unsigned j, double step)
{
	const struct path_vertex *from = &m->y->v[j + 1], *kept = &m->s->kept[j];
	struct path_vertex *to = &m->y->v[j];
	vec3 d = vec3_sub(vec3_madd(kept->x.p, step, m->move[j]), from->x.p);
	double t = vec3_length(d);
	if (!(t > 0) || !isfinite(t))
		return WALK_MISSED;
	d = vec3_scale(1 / t, d);
	struct prim_ref prim = kept->x.prim;
	if (!surface_reproject(&m->c->w->shapes[prim.shape], prim, from->x.prim, from->x.p, d, t, &to->x))
		return cast(m, j, d);
	to->emitter = kept->emitter;
	return WALK_OK;
}

static enum walk_end trial(struct walk *m, double step)
{
	struct full_path *y = m->y;
	m->seen = 0;
	for (unsigned j = m->b - 1;; j--) {
		if (j > m->end) {
			enum walk_end put = put_back(m, j, step);
			if (put != WALK_OK)
				return put;
		}
		if (!full_path_join(y, j))
			return WALK_SINGULAR;
		if (j + 1 < m->b && (!mode_holds(y, j + 1) || light_above(y, j + 1) != ((m->above >> (j + 1)) & 1)))
			return WALK_MODE;
		if (j == m->end)
			return WALK_OK;
	}
}

/* How near the half vectors s->k[].h are to the targets. */
struct nearness {
	double error; /* the largest residual, for step control */
	bool forward; /* all are within the tolerances of a forward walk */
	bool within;  /* all are within the tolerances of this walk */
};

static struct nearness residuals(struct walk *m)
{
	struct nearness n = {0, true, true};
	for (unsigned j = m->end + 1; j < m->b; j++) {
		vec2 h = m->s->k[j].h, r = vec2_sub(m->target[j].h, h);
		double tolerance = m->scale * m->target[j].tolerance, r2 = vec2_dot(r, r);
		double tighter = m->back ? WALK_BACK_SCALE * tolerance : tolerance;
		m->s->residual[j] = r;
		if (!isfinite(r2))
			return (struct nearness){INFINITY, false, false};
		n.forward = n.forward && r2 <= tolerance * tolerance;
		n.within = n.within && r2 <= tighter * tighter;
		n.error = fmax(n.error, r2 / (1 + vec2_dot(h, h)));
	}
	return n;
}

/* Makes the trial the kept state and computes Newton's step from there. factored: s->system already belongs to s->k. */
static enum walk_end accept_trial(struct walk *m, bool factored)
{
	struct walk_scratch *s = m->s;
	if (!factored && m->solver->factor_to_solve(s->k, m->b, m->end, &s->system) != CONSTRAINT_OK)
		return WALK_SINGULAR;
	m->solver->solve(s->k, &s->system, s->residual, s->dx);
	for (unsigned j = m->end + 1; j < m->b; j++) {
		s->kept[j].x = m->y->v[j].x;
		s->kept[j].emitter = m->y->v[j].emitter;
		if (!isfinite(s->dx[j].x) || !isfinite(s->dx[j].y))
			return WALK_SINGULAR;
		vec3 du, dv;
		surface_tangents(&s->kept[j].x, &du, &dv);
		m->move[j] = vec3_madd(vec3_scale(s->dx[j].x, du), s->dx[j].y, dv);
	}
	return WALK_OK;
}

static enum walk_end start(struct walk *m)
{
	struct full_path *y = m->y;
	for (unsigned e = m->end; e < m->b; e++)
		if (!full_path_join(y, e))
			return WALK_SINGULAR;
	for (unsigned j = m->end + 1; j < m->b; j++) {
		if (!mode_holds(y, j))
			return WALK_MODE;
		if (light_above(y, j))
			m->above |= bit_of(j);
	}
	return WALK_OK;
}

/* Whether all edges are unoccluded. Where media scatter, every edge is traced, because its transmittance is needed. */
static bool all_visible(const struct walk *m)
{
	uint64_t seen = EFFECT_IS_ON(m->c->w, scattering) ? 0 : m->seen;
	for (unsigned e = m->b; e-- > m->end;)
		if (!(seen & bit_of(e)) && !full_path_visible(m->c, m->y, e))
			return false;
	return true;
}

static void compute_constraints(struct walk *m, unsigned b, unsigned end)
{
	constraints_of(m->c->w, m->y, b, end, m->s->k);
}

static void refresh_constraints(struct walk *m, unsigned stale)
{
	if (stale & WALK_STALE) {
		compute_constraints(m, m->b, m->end);
		return;
	}
	if (stale & WALK_STALE_B)
		compute_constraints(m, m->b, m->b - 2);
	if (stale & WALK_STALE_C)
		compute_constraints(m, m->end + 2, m->end);
}

/* Evaluates the trial. Half vectors alone are cheap; derivatives are only computed if the walk continues
 * or the caller needs them. */
static struct nearness evaluate_trial(struct walk *m)
{
	for (unsigned j = m->end + 1; j < m->b; j++)
		m->s->k[j].h = halfvec_of(m->y, j);
	return residuals(m);
}

/* Iterates until the residuals are small enough, or returns the reason for failing. */
static enum walk_end iterate(struct walk *m, const struct walk_limits *limits, unsigned stale)
{
	struct walk_scratch *s = m->s;
	refresh_constraints(m, stale);
	double error = residuals(m).error, step = 1;
	unsigned most = limits->iterations;
	enum walk_end last = isfinite(error) ? accept_trial(m, !stale) : WALK_SINGULAR;
	if (last != WALK_OK)
		return last;
	while (s->iterations < most) {
		s->iterations++;
		last = trial(m, step);
		if (last == WALK_OK) {
			struct nearness now = evaluate_trial(m);
			if (now.within ? !m->back : now.error < error)
				compute_constraints(m, m->b, m->end);
			if (now.within)
				return WALK_OK;
			if (now.forward)
				most = 2 * limits->iterations;
			if (now.error < error) {
				error = now.error;
				last = accept_trial(m, false);
				if (last != WALK_OK)
					return last;
				step = fmin(1, 2 * step);
				continue;
			}
			last = WALK_DIVERGED;
		}
		step /= 2;
		if (step < limits->least_step)
			return last;
	}
	return last == WALK_OK ? WALK_ITERATIONS : last;
}

enum walk_end halfvec_walk(struct path_context *c, struct full_path *y, unsigned b, unsigned c_end,
			   const struct walk_target *target, bool visible, const struct walk_limits *limits,
			   unsigned stale, struct walk_scratch *s)
{
	assert(c_end + 1 < b && b <= y->edges);
	struct walk m = {.c = c,
			 .y = y,
			 .b = b,
			 .end = c_end,
			 .target = target,
			 .solver = limits->solver,
			 .scale = limits->scale,
			 .back = visible,
			 .s = s};
	s->iterations = 0;
	full_path_forget(y, c_end + 1, b - 1);
	enum walk_end end = start(&m);
	if (end == WALK_OK)
		end = iterate(&m, limits, stale);
	if (end != WALK_OK || visible)
		return end;
	if (!all_visible(&m))
		return WALK_BLOCKED;
	for (unsigned j = c_end + 1; j < b; j++)
		surface_uv(&c->w->shapes[y->v[j].x.prim.shape], &y->v[j].x);
	return WALK_OK;
}
