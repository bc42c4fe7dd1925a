/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/halfvec/constraint.h"

/* What a constraint needs to know about an adjacent vertex. */
struct neighbour {
	vec3 w;	     /* unit direction to the adjacent vertex */
	double rate; /* how fast w turns as the adjacent vertex moves perpendicular to w */
	double own;  /* how fast w turns as the constraint's own vertex moves */
	vec3 du, dv; /* tangents along which the adjacent vertex moves */
};

/* A half vector before normalisation, and its slopes. */
struct half {
	vec3 sum;     /* i + eta o */
	double along; /* h.n; 1 if index-matched, where slopes are not divided */
	vec2 h;
	bool matched, finite;
};

static vec3 towards_light(const struct full_path *x, unsigned j)
{
	return vec3_neg(x->edge[j - 1].w);
}

static struct half half_of(const struct full_path *x, unsigned j, double eta)
{
	const struct path_vertex *v = &x->v[j];
	struct half r = {.sum = vec3_madd(towards_light(x, j), eta, x->edge[j].w), .along = 1, .finite = true};
	vec3 l = frame_to_local(&v->x.sh, r.sum);
	r.matched = eta == 1 && (v->mode & BSDF_TRANSMIT);
	if (!r.matched) {
		r.along = l.z;
		/* For smaller values, the derivatives could overflow, since they divide by the square. */
		r.finite = fabs(l.z) > 0x1p-300 * vec3_length(r.sum);
	}
	r.h = r.finite ? (vec2){l.x / r.along, l.y / r.along} : (vec2){INFINITY, INFINITY};
	return r;
}

vec2 halfvec_of(const struct full_path *x, unsigned j)
{
	return half_of(x, j, full_path_eta(x, j)).h;
}

/* Returns the derivative of a unit direction that turns at `rate` as one of its ends moves along d. */
static inline vec3 turn(vec3 w, vec3 d, double rate)
{
	return vec3_scale(rate, vec3_madd(d, -vec3_dot(w, d), w));
}

/* Returns the derivative of the slopes as the half vector changes by d, in a fixed frame. */
static inline vec2 slope_change(const struct frame *f, const struct half *r, vec3 d)
{
	vec3 l = frame_to_local(f, d);
	if (r->matched)
		return (vec2){l.x, l.y};
	return (vec2){(l.x - r->h.x * l.z) / r->along, (l.y - r->h.y * l.z) / r->along};
}

static inline mat2 by_neighbour(const struct frame *f, const struct half *r, const struct neighbour *n, double weight)
{
	return mat2_of_columns(slope_change(f, r, turn(n->w, n->du, weight * n->rate)),
			       slope_change(f, r, turn(n->w, n->dv, weight * n->rate)));
}

/* Returns the derivative of the slopes as the vertex itself moves along d: both directions turn, and the frame turns
 * with the shading normal (by dn) and with the axis a (by da). ds = -(s.dn) n + w t and dt = -(t.dn) n - w s, where w
 * is the rate at which s = N(a - n (n.a)) turns around n. */
static inline vec2 by_itself(const struct frame *f, const struct half *r, const struct neighbour *i,
			     const struct neighbour *o, double eta, vec3 d, vec3 a, vec3 dn, vec3 da)
{
	vec3 sum = vec3_add(turn(i->w, d, -i->own), turn(o->w, d, -eta * o->own));
	vec2 c = slope_change(f, r, sum);
	double dns = vec3_dot(f->s, dn), dnt = vec3_dot(f->t, dn);
	double bent = vec3_dot(f->s, a); /* |a - n (n.a)| */
	double twist = bent > 0 ? (vec3_dot(f->t, da) - dnt * vec3_dot(f->n, a)) / bent : 0;
	double normal = 1, stretch = 0; /* normal: n component of the vector from which the slopes are computed */
	if (r->matched)
		normal = vec3_dot(r->sum, f->n);
	else
		stretch = r->h.x * dns + r->h.y * dnt;
	c.x += twist * r->h.y - normal * dns - stretch * r->h.x;
	c.y += -twist * r->h.x - normal * dnt - stretch * r->h.y;
	return c;
}

/* Sets the tangents along which an end of the sub-path moves, as seen from the adjacent vertex in that direction. */
static void end_tangents(const struct world *w, const struct path_vertex *v, vec3 direction, struct neighbour *n)
{
	struct frame f;
	struct camera room;
	if (v->kind == VERTEX_SURFACE) {
		surface_tangents(&v->x, &n->du, &n->dv);
		return;
	}
	if (v->kind == VERTEX_CAMERA)
		f = world_camera(w, &v->x, &room)->axes;
	else if (v->kind == VERTEX_EMITTER && vec3_dot(v->x.ng, v->x.ng) > 0)
		f = frame_around(v->x.ng);
	else
		f = frame_around(direction);
	n->du = f.s;
	n->dv = f.t;
}

static struct neighbour neighbour_of(const struct full_path *x, unsigned edge, bool to_light)
{
	struct neighbour n = {.w = to_light ? vec3_neg(x->edge[edge].w) : x->edge[edge].w};
	n.rate = n.own = 1 / sqrt(x->edge[edge].distance2);
	if (to_light && x->v[edge].kind == VERTEX_INFINITE) {
		n.rate = 1;
		n.own = 0;
	}
	return n;
}

static void fill_constraint(const struct path_vertex *v, double eta, const struct half *r,
			    const struct surface_change *change, const struct neighbour *i, const struct neighbour *o,
			    struct constraint *k)
{
	const struct frame *f = &v->x.sh;
	k->h = r->h;
	k->a = k->b = k->c = (mat2){0, 0, 0, 0};
	if (!r->finite)
		return;
	k->a = by_neighbour(f, r, i, 1);
	k->c = by_neighbour(f, r, o, eta);
	k->b = mat2_of_columns(by_itself(f, r, i, o, eta, change->du, change->axis, change->dn[0], change->daxis[0]),
			       by_itself(f, r, i, o, eta, change->dv, change->axis, change->dn[1], change->daxis[1]));
}

void constraints_of(const struct world *w, const struct full_path *x, unsigned b, unsigned c, struct constraint *k)
{
	assert(c < b && b <= x->edges);
	struct surface_change change[2];
	struct neighbour i, o;
	for (unsigned j = c + 1; j < b; j++) {
		const struct path_vertex *v = &x->v[j];
		struct surface_change *here = &change[j & 1], *next = &change[~j & 1];
		i = neighbour_of(x, j - 1, true);
		o = neighbour_of(x, j, false);
		if (j == c + 1) {
			surface_change_of(&w->shapes[v->x.prim.shape], &v->x, here);
			end_tangents(w, &x->v[c], i.w, &i);
		} else {
			i.du = next->du;
			i.dv = next->dv;
		}
		if (j + 1 == b) {
			end_tangents(w, &x->v[b], o.w, &o);
		} else {
			surface_change_of(&w->shapes[x->v[j + 1].x.prim.shape], &x->v[j + 1].x, next);
			o.du = next->du;
			o.dv = next->dv;
		}
		double eta = full_path_eta(x, j);
		struct half r = half_of(x, j, eta);
		fill_constraint(v, eta, &r, here, &i, &o, &k[j]);
	}
}
