/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The half vector as a function of the positions of three vertices, with 113 bits of mantissa, and its derivatives by
 * differences: an independent implementation, which shares no formula of a derivative with the program.
 */
#ifndef TESTS_WORKER_HALFVEC_QUAD_H
#define TESTS_WORKER_HALFVEC_QUAD_H

#include "tests/worker/render/halfvec/hand.h"

typedef __float128 quad;
typedef struct {
	quad x, y, z;
} qvec;

static inline quad q_abs(quad a)
{
	return a < 0 ? -a : a;
}

static inline quad q_sqrt(quad a)
{
	if (!(a > 0))
		return 0;
	quad r = (quad)sqrt((double)a);
	for (int i = 0; i < 3; i++)
		r = (r + a / r) / 2;
	return r;
}

static inline qvec q_from_vec3(vec3 a)
{
	return (qvec){a.x, a.y, a.z};
}

static inline qvec q_from_floats(const float a[3])
{
	return (qvec){(quad)a[0], (quad)a[1], (quad)a[2]};
}

static inline qvec q_madd(qvec a, quad s, qvec b)
{
	return (qvec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static inline qvec q_sub(qvec a, qvec b)
{
	return q_madd(a, -1, b);
}

static inline qvec q_scale(quad s, qvec a)
{
	return (qvec){s * a.x, s * a.y, s * a.z};
}

static inline quad q_dot(qvec a, qvec b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline qvec q_cross(qvec a, qvec b)
{
	return (qvec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline qvec q_unit(qvec a)
{
	return q_scale(1 / q_sqrt(q_dot(a, a)), a);
}

/* Returns the part of a perpendicular to the unit vector n, normalised. */
static inline qvec q_perpendicular(qvec a, qvec n)
{
	return q_unit(q_madd(a, -q_dot(a, n), n));
}

enum quad_kind { QUAD_TRIANGLE, QUAD_SPHERE, QUAD_POINT, QUAD_DIRECTION };

/* The shape on which a vertex lies, and its position. */
struct quad_vertex {
	enum quad_kind kind;
	qvec p;
	bool is_smooth;
	qvec e1, e2, normal[3]; /* of a triangle */
	quad b1, b2;
	quad dpdu_e1, dpdu_e2; /* dp/du = dpdu_e1 e1 + dpdu_e2 e2, unless carried by the normal or turning */
	bool is_carried, is_turning;
	qvec tangent[3];
	qvec center, axis; /* of a sphere */
	quad radius, sign;
	qvec du, dv; /* of points and directions */
};

/* Position and frame of a vertex after moving by (a, b) in its tangent plane. */
struct quad_point_frame {
	qvec p, s, t, n;
};

static inline qvec quad_interpolate(const qvec corner[3], quad b1, quad b2)
{
	return q_madd(q_madd(q_scale(1 - b1 - b2, corner[0]), b1, corner[1]), b2, corner[2]);
}

/* Returns dp/du of a triangle. Without uv: (3, -6, 2) / 7, carried along by the shortest rotation from (2, 3, 6) / 7
 * to the normal. With tangents: interpolated at the barycentric coordinates (b1, b2). */
static inline qvec quad_dpdu(const struct quad_vertex *v, quad b1, quad b2)
{
	if (v->is_turning)
		return quad_interpolate(v->tangent, b1, b2);
	qvec reference = {(quad)2 / 7, (quad)3 / 7, (quad)6 / 7}, axis = {(quad)3 / 7, (quad)-6 / 7, (quad)2 / 7};
	qvec ng = q_unit(q_cross(v->e1, v->e2));
	if (v->is_carried)
		return q_madd(axis, -q_dot(axis, ng) / (1 + q_dot(reference, ng)), q_madd(reference, 1, ng));
	return q_madd(q_scale(v->dpdu_e1, v->e1), v->dpdu_e2, v->e2);
}

static inline void quad_tangents(const struct quad_vertex *v, qvec *du, qvec *dv)
{
	if (v->kind == QUAD_TRIANGLE) {
		qvec ng = q_unit(q_cross(v->e1, v->e2));
		*du = q_perpendicular(quad_dpdu(v, v->b1, v->b2), ng);
		*dv = q_cross(ng, *du);
	} else if (v->kind == QUAD_SPHERE) {
		qvec w = q_unit(q_sub(v->p, v->center));
		*du = q_unit(q_cross(v->axis, w));
		*dv = q_scale(v->sign, q_cross(w, *du));
	} else {
		*du = v->du;
		*dv = v->dv;
	}
}

static inline struct quad_point_frame quad_moved_frame(const struct quad_vertex *v, quad a, quad b)
{
	struct quad_point_frame r = {.p = v->p};
	qvec du, dv, along = {0, 0, 0};
	quad_tangents(v, &du, &dv);
	r.p = q_madd(q_madd(v->p, a, du), b, dv);
	if (v->kind == QUAD_DIRECTION)
		r.p = q_unit(r.p);
	if (v->kind == QUAD_TRIANGLE) {
		/* move = c1 e1 + c2 e2 */
		qvec move = q_sub(r.p, v->p), area = q_cross(v->e1, v->e2);
		quad inverse = 1 / q_dot(area, area);
		quad b1 = v->b1 + inverse * q_dot(q_cross(move, v->e2), area),
		     b2 = v->b2 + inverse * q_dot(q_cross(v->e1, move), area);
		along = quad_dpdu(v, b1, b2);
		r.n = q_unit(area);
		if (v->is_smooth) {
			qvec m = quad_interpolate(v->normal, b1, b2);
			if (q_dot(m, r.n) > 0)
				r.n = q_unit(m);
		}
	}
	if (v->kind == QUAD_SPHERE) {
		qvec w = q_unit(q_sub(r.p, v->center));
		r.p = q_madd(v->center, v->radius, w);
		r.n = q_scale(v->sign, w);
		along = q_unit(q_cross(v->axis, w));
	}
	if (v->kind == QUAD_TRIANGLE || v->kind == QUAD_SPHERE) {
		r.s = q_perpendicular(along, r.n);
		r.t = q_cross(r.n, r.s);
	}
	return r;
}

struct quad_problem {
	struct quad_vertex v[3]; /* towards the light, the vertex itself, towards the camera */
	quad eta;
	bool is_matched;
};

static inline void quad_half_vector(const struct quad_problem *q, const struct quad_point_frame *p, quad h[2])
{
	qvec i = q->v[0].kind == QUAD_DIRECTION ? p[0].p : q_unit(q_sub(p[0].p, p[1].p));
	qvec sum = q_madd(i, q->eta, q_unit(q_sub(p[2].p, p[1].p)));
	quad along = q->is_matched ? 1 : q_dot(sum, p[1].n);
	h[0] = q_dot(sum, p[1].s) / along;
	h[1] = q_dot(sum, p[1].t) / along;
}

/* Computes the half vector h and m[vertex][2 row + column], by central differences with steps s and s/2,
 * extrapolated. */
static inline void quad_derivatives(const struct quad_problem *q, quad step, quad h[2], quad m[3][4])
{
	struct quad_point_frame base_frames[3];
	for (int k = 0; k < 3; k++)
		base_frames[k] = quad_moved_frame(&q->v[k], 0, 0);
	quad_half_vector(q, base_frames, h);
	for (int k = 0; k < 3; k++) {
		struct quad_point_frame p[3] = {base_frames[0], base_frames[1], base_frames[2]};
		for (int column = 0; column < 2; column++) {
			quad d[2][2];
			for (int half = 0; half < 2; half++) {
				quad s = half ? step / 2 : step, up[2], down[2];
				p[k] = quad_moved_frame(&q->v[k], column ? 0 : s, column ? s : 0);
				quad_half_vector(q, p, up);
				p[k] = quad_moved_frame(&q->v[k], column ? 0 : -s, column ? -s : 0);
				quad_half_vector(q, p, down);
				for (int row = 0; row < 2; row++)
					d[half][row] = (up[row] - down[row]) / (2 * s);
			}
			for (int row = 0; row < 2; row++)
				m[k][2 * row + column] = (4 * d[1][row] - d[0][row]) / 3;
		}
	}
}

static inline struct quad_vertex quad_vertex_from_surface(const struct hand *h, unsigned j)
{
	const struct surface_point *x = &h->x.v[j].x;
	const struct geom_shape *s = &h->shape[j];
	struct quad_vertex v = {.kind = QUAD_SPHERE, .p = q_from_vec3(x->p)};
	if (s->is_sphere) {
		v.center = q_from_vec3(s->center);
		v.axis = q_from_vec3(s->sphere_axes.n);
		v.radius = s->radius;
		v.sign = s->normal_sign;
		return v;
	}
	v.kind = QUAD_TRIANGLE;
	v.e1 = q_sub(q_from_floats(s->position[1]), q_from_floats(s->position[0]));
	v.e2 = q_sub(q_from_floats(s->position[2]), q_from_floats(s->position[0]));
	v.b1 = x->b1;
	v.b2 = x->b2;
	v.is_smooth = s->normal != NULL;
	for (int m = 0; m < 3 && v.is_smooth; m++)
		v.normal[m] = q_from_floats(s->normal[m]);
	v.is_carried = true;
	v.is_turning = s->tangent != NULL;
	for (int m = 0; m < 3 && v.is_turning; m++)
		v.tangent[m] = q_from_floats(s->tangent[0][m]);
	if (s->uv) {
		quad u1 = (quad)s->uv[1][0] - (quad)s->uv[0][0], v1 = (quad)s->uv[1][1] - (quad)s->uv[0][1];
		quad u2 = (quad)s->uv[2][0] - (quad)s->uv[0][0], v2 = (quad)s->uv[2][1] - (quad)s->uv[0][1];
		quad det = u1 * v2 - v1 * u2;
		v.is_carried = det == 0;
		v.dpdu_e1 = v.is_carried ? 0 : v2 / det;
		v.dpdu_e2 = v.is_carried ? 0 : -v1 / det;
	}
	return v;
}

static inline struct quad_vertex quad_vertex_from_end(const struct hand *h, unsigned j)
{
	const struct path_vertex *v = &h->x.v[j];
	if (v->kind == VERTEX_SURFACE)
		return quad_vertex_from_surface(h, j);
	struct quad_vertex r = {.kind = v->kind == VERTEX_INFINITE ? QUAD_DIRECTION : QUAD_POINT,
				.p = q_from_vec3(v->x.p)};
	struct frame f;
	if (v->kind == VERTEX_CAMERA)
		f = h->w.camera.axes;
	else if (v->kind == VERTEX_EMITTER && vec3_dot(v->x.ng, v->x.ng) > 0)
		f = frame_around(v->x.ng);
	else
		f = frame_around(vec3_neg(h->x.edge[0].w));
	r.du = q_from_vec3(f.s);
	r.dv = q_from_vec3(f.t);
	return r;
}

static inline struct quad_problem quad_problem_from_hand(const struct hand *h, unsigned j)
{
	struct quad_problem q = {
		.v = {quad_vertex_from_end(h, j - 1), quad_vertex_from_surface(h, j), quad_vertex_from_end(h, j + 1)},
		.eta = 1};
	const struct path_vertex *v = &h->x.v[j];
	if (v->mode & BSDF_TRANSMIT) {
		quad eta = h->bsdf[j].eta;
		q.eta = vec3_dot(v->x.sh.n, h->x.edge[j].w) > 0 ? 1 / eta : eta;
		q.is_matched = eta == 1;
	}
	return q;
}

/* Returns the number shaken by one rounding of double, up or down. */
static inline quad quad_perturbed(quad a, struct dice *d)
{
	return a * (1 + (dice_uniform(d) < 0.5 ? -1 : 1) * (quad)0x1p-53);
}

static inline qvec q_perturbed(qvec a, struct dice *d)
{
	return (qvec){quad_perturbed(a.x, d), quad_perturbed(a.y, d), quad_perturbed(a.z, d)};
}

static inline struct quad_problem quad_problem_perturbed(const struct quad_problem *q, struct dice *d)
{
	struct quad_problem r = *q;
	for (int k = 0; k < 3; k++) {
		struct quad_vertex *v = &r.v[k];
		qvec *vectors[] = {&v->p,	   &v->e1,	  &v->e2,	  &v->normal[0],
				   &v->normal[1],  &v->normal[2], &v->tangent[0], &v->tangent[1],
				   &v->tangent[2], &v->center,	  &v->axis};
		for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++)
			*vectors[i] = q_perturbed(*vectors[i], d);
		v->b1 = quad_perturbed(v->b1, d);
		v->b2 = quad_perturbed(v->b2, d);
		v->radius = quad_perturbed(v->radius, d);
	}
	if (!q->is_matched)
		r.eta = quad_perturbed(q->eta, d);
	return r;
}

#endif
