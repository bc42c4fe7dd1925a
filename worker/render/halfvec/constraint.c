/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/halfvec/constraint.h"

/* What a constraint needs to know about an adjacent vertex. */
struct neighbour {
	vec3 w;		      /* unit direction to the adjacent vertex */
	double turn_rate;     /* how fast w turns as the adjacent vertex moves perpendicular to w */
	double own_turn_rate; /* how fast w turns as the constraint's own vertex moves */
	vec3 du, dv;	      /* tangents along which the adjacent vertex moves */
};

/* A half vector before normalisation, and its slopes. */
struct half_vector {
	vec3 sum;		 /* i + eta o */
	double normal_component; /* h.n; 1 if index-matched, where slopes are not divided */
	vec2 h;
	bool is_matched, is_finite;
};

static vec3 towards_light(const struct full_path *x, unsigned j)
{
	return vec3_neg(x->edge[j - 1].w);
}

static struct half_vector compute_half_vector(const struct full_path *x, unsigned j, double eta)
{
	const struct path_vertex *v = &x->v[j];
	struct half_vector r = {
		.sum = vec3_madd(towards_light(x, j), eta, x->edge[j].w), .normal_component = 1, .is_finite = true};
	vec3 l = frame_to_local(&v->x.sh, r.sum);
	r.is_matched = eta == 1 && (v->mode & BSDF_TRANSMIT);
	if (!r.is_matched) {
		r.normal_component = l.z;
		/* For smaller values, the derivatives could overflow, since they divide by the square. */
		r.is_finite = fabs(l.z) > 0x1p-300 * vec3_length(r.sum);
	}
	r.h = r.is_finite ? (vec2){l.x / r.normal_component, l.y / r.normal_component} : (vec2){INFINITY, INFINITY};
	return r;
}

vec2 halfvec_of(const struct full_path *x, unsigned j)
{
	return compute_half_vector(x, j, full_path_eta(x, j)).h;
}

/* Returns the derivative of a unit direction that turns at `turn_rate` as one of its ends moves along d. */
static inline vec3 direction_derivative(vec3 w, vec3 d, double turn_rate)
{
	return vec3_scale(turn_rate, vec3_madd(d, -vec3_dot(w, d), w));
}

/* Returns the derivative of the slopes as the half vector changes by d, in a fixed frame. */
static inline vec2 slope_derivative(const struct frame *f, const struct half_vector *r, vec3 d)
{
	vec3 l = frame_to_local(f, d);
	if (r->is_matched)
		return (vec2){l.x, l.y};
	return (vec2){(l.x - r->h.x * l.z) / r->normal_component, (l.y - r->h.y * l.z) / r->normal_component};
}

static inline mat2 derivative_by_neighbour(const struct frame *f, const struct half_vector *r,
					   const struct neighbour *n, double weight)
{
	return mat2_of_columns(slope_derivative(f, r, direction_derivative(n->w, n->du, weight * n->turn_rate)),
			       slope_derivative(f, r, direction_derivative(n->w, n->dv, weight * n->turn_rate)));
}

/* Returns the derivative of the slopes as the vertex itself moves along d: both directions turn, and the frame turns
 * with the shading normal (by dn) and with the axis a (by da). ds = -(s.dn) n + w t and dt = -(t.dn) n - w s, where w
 * is the rate at which s = N(a - n (n.a)) turns around n. */
static inline vec2 derivative_by_vertex(const struct frame *f, const struct half_vector *r, const struct neighbour *i,
					const struct neighbour *o, double eta, vec3 d, vec3 a, vec3 dn, vec3 da)
{
	vec3 sum = vec3_add(direction_derivative(i->w, d, -i->own_turn_rate),
			    direction_derivative(o->w, d, -eta * o->own_turn_rate));
	vec2 c = slope_derivative(f, r, sum);
	double dns = vec3_dot(f->s, dn), dnt = vec3_dot(f->t, dn);
	double axis_length = vec3_dot(f->s, a); /* |a - n (n.a)| */
	double twist = axis_length > 0 ? (vec3_dot(f->t, da) - dnt * vec3_dot(f->n, a)) / axis_length : 0;
	double normal = 1, stretch = 0; /* normal: n component of the vector from which the slopes are computed */
	if (r->is_matched)
		normal = vec3_dot(r->sum, f->n);
	else
		stretch = r->h.x * dns + r->h.y * dnt;
	c.x += twist * r->h.y - normal * dns - stretch * r->h.x;
	c.y += -twist * r->h.x - normal * dnt - stretch * r->h.y;
	return c;
}

/* Sets the tangents along which an end of the sub-path moves, as seen from the adjacent vertex in that direction. */
static void set_end_tangents(const struct world *w, const struct path_vertex *v, vec3 direction, struct neighbour *n)
{
	struct frame f;
	struct camera storage;
	if (v->kind == VERTEX_SURFACE) {
		surface_tangents(&v->x, &n->du, &n->dv);
		return;
	}
	if (v->kind == VERTEX_CAMERA)
		f = world_camera_at(w, &v->x, &storage)->axes;
	else if (v->kind == VERTEX_EMITTER && vec3_dot(v->x.ng, v->x.ng) > 0)
		f = frame_around(v->x.ng);
	else
		f = frame_around(direction);
	n->du = f.s;
	n->dv = f.t;
}

static struct neighbour neighbour_along(const struct full_path *x, unsigned edge, bool to_light)
{
	struct neighbour n = {.w = to_light ? vec3_neg(x->edge[edge].w) : x->edge[edge].w};
	n.turn_rate = n.own_turn_rate = 1 / sqrt(x->edge[edge].distance2);
	if (to_light && x->v[edge].kind == VERTEX_INFINITE) {
		n.turn_rate = 1;
		n.own_turn_rate = 0;
	}
	return n;
}

static void fill_constraint(const struct path_vertex *v, double eta, const struct half_vector *r,
			    const struct surface_derivatives *change, const struct neighbour *i,
			    const struct neighbour *o, struct constraint *k)
{
	const struct frame *f = &v->x.sh;
	k->h = r->h;
	k->a = k->b = k->c = (mat2){0, 0, 0, 0};
	if (!r->is_finite)
		return;
	k->a = derivative_by_neighbour(f, r, i, 1);
	k->c = derivative_by_neighbour(f, r, o, eta);
	k->b = mat2_of_columns(
		derivative_by_vertex(f, r, i, o, eta, change->du, change->axis, change->dn[0], change->daxis[0]),
		derivative_by_vertex(f, r, i, o, eta, change->dv, change->axis, change->dn[1], change->daxis[1]));
}

void constraints_compute(const struct world *w, const struct full_path *x, unsigned b, unsigned c, struct constraint *k)
{
	assert(c < b && b <= x->edges);
	struct surface_derivatives change[2];
	struct neighbour i, o;
	for (unsigned j = c + 1; j < b; j++) {
		const struct path_vertex *v = &x->v[j];
		struct surface_derivatives *current = &change[j & 1], *next = &change[~j & 1];
		i = neighbour_along(x, j - 1, true);
		o = neighbour_along(x, j, false);
		if (j == c + 1) {
			surface_compute_derivatives(&w->shapes[v->x.prim.shape], &v->x, current);
			set_end_tangents(w, &x->v[c], i.w, &i);
		} else {
			i.du = next->du;
			i.dv = next->dv;
		}
		if (j + 1 == b) {
			set_end_tangents(w, &x->v[b], o.w, &o);
		} else {
			surface_compute_derivatives(&w->shapes[x->v[j + 1].x.prim.shape], &x->v[j + 1].x, next);
			o.du = next->du;
			o.dv = next->dv;
		}
		double eta = full_path_eta(x, j);
		struct half_vector r = compute_half_vector(x, j, eta);
		fill_constraint(v, eta, &r, current, &i, &o, &k[j]);
	}
}
