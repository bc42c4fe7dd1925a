/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Computes points on primitives. A hit is converted to coordinates on its primitive (barycentrics, or the direction
 * from a sphere's centre), these to a point with frame and texture coordinates, and, for half vectors, to the
 * derivatives of the frame along two tangents. Relief bends the normal and its derivatives in the same way.
 *
 * Nothing fails: if texture coordinates are degenerate, another tangent is used that turns as little as possible, and a
 * normal of zero length is replaced by the geometric one.
 */
#include "worker/render/geom/surface.h"

#include "worker/render/geom/surface_curve.h"
#include "worker/render/math/sphere.h"

static vec3 load_float3(const float (*a)[3], uint32_t i)
{
	return (vec3){(double)a[i][0], (double)a[i][1], (double)a[i][2]};
}

/* Moves a point in the triangle's plane that is outside the triangle to the nearest point inside. Clamping each
 * barycentric separately would move it along a sliver by as many of the sliver's widths as it is off. */
static void move_inside(vec3 e1, vec3 e2, double *b1, double *b2)
{
	const double start[3][2] = {{0, 0}, {0, 0}, {1, 0}}, step[3][2] = {{1, 0}, {0, 1}, {-1, 1}};
	vec3 q = vec3_madd(vec3_scale(*b1, e1), *b2, e2);
	double best = INFINITY;
	for (int i = 0; i < 3; i++) {
		vec3 a = vec3_scale(start[i][0], e1), g = vec3_madd(vec3_scale(step[i][0], e1), step[i][1], e2);
		vec3 aq = vec3_sub(q, a);
		double s = fmin(fmax(vec3_dot(aq, g) / vec3_dot(g, g), 0), 1);
		vec3 offset = vec3_madd(aq, -s, g);
		if (vec3_dot(offset, offset) >= best)
			continue;
		best = vec3_dot(offset, offset);
		*b1 = start[i][0] + s * step[i][0];
		*b2 = start[i][1] + s * step[i][1];
	}
}

/* Computes the barycentrics of the ray's crossing with the triangle's plane, clamped to the triangle because Embree
 * reported a hit. Returns false if the ray is in the plane. */
static bool solve_triangle(vec3 o, vec3 d, vec3 v0, vec3 e1, vec3 e2, double *b1, double *b2)
{
	vec3 h = vec3_cross(d, e2), s = vec3_sub(o, v0), q = vec3_cross(s, e1);
	double det = vec3_dot(e1, h);
	if (det == 0)
		return false;
	double u = vec3_dot(s, h) / det, v = vec3_dot(d, q) / det;
	if (!isfinite(u) || !isfinite(v))
		return false;
	*b1 = u;
	*b2 = v;
	if (u < 0 || v < 0 || u + v > 1)
		move_inside(e1, e2, b1, b2);
	return true;
}

/* Returns a tangent that turns as little as possible from one triangle to the next: the shortest rotation from r to n
 * applied to a. Half vectors are coordinates in frames, and frames aligned with edges would turn at random. Every such
 * field has a singularity; this one's is at n = -r, which few surfaces face. */
static vec3 default_axis(vec3 n)
{
	const vec3 r = {2.0 / 7, 3.0 / 7, 6.0 / 7}, a = {3.0 / 7, -6.0 / 7, 2.0 / 7};
	double k = 1 + vec3_dot(r, n);
	return k > 0x1p-20 ? vec3_madd(a, -vec3_dot(a, n) / k, vec3_add(r, n)) : a;
}

/* dp/du and dp/dv, computed from the texture coordinates. */
struct tangents {
	vec3 u, v;
	bool are_valid; /* false: texture coordinates are missing or degenerate */
};

static struct tangents compute_tangents(const struct geom_shape *s, const uint32_t i[3], vec3 e1, vec3 e2)
{
	struct tangents t = {.are_valid = false};
	if (!s->uv)
		return t;
	double du1 = (double)s->uv[i[1]][0] - (double)s->uv[i[0]][0],
	       dv1 = (double)s->uv[i[1]][1] - (double)s->uv[i[0]][1];
	double du2 = (double)s->uv[i[2]][0] - (double)s->uv[i[0]][0],
	       dv2 = (double)s->uv[i[2]][1] - (double)s->uv[i[0]][1];
	double det = du1 * dv2 - dv1 * du2;
	if (det == 0)
		return t;
	t.u = vec3_scale(1 / det, vec3_sub(vec3_scale(dv2, e1), vec3_scale(dv1, e2)));
	t.v = vec3_scale(1 / det, vec3_sub(vec3_scale(du1, e2), vec3_scale(du2, e1)));
	t.are_valid = vec3_is_finite(t.u) && vec3_dot(t.u, t.u) > 0;
	return t;
}

/* A shape in its position at a time. */
struct posed_shape {
	struct geom_shape shape;
	struct placement placement;
};

/* Not inline, to keep it out of the path of shapes that do not move. */
__attribute__((noinline)) static const struct geom_shape *pose_moving(const struct geom_shape *s, double time,
								      struct posed_shape *storage)
{
	const struct placement *p = &storage->placement;
	placement_compute_at(s->placement, time, &storage->placement);
	storage->shape = *s;
	storage->shape.placement = p;
	if (!s->is_sphere)
		return &storage->shape;
	storage->shape.center = placement_point(p, s->center);
	storage->shape.radius = s->radius * vec3_length(p->x);
	storage->shape.sphere_axes = (struct frame){vec3_normalize(placement_vector(p, s->sphere_axes.s)),
						    vec3_normalize(placement_vector(p, s->sphere_axes.t)),
						    vec3_normalize(placement_vector(p, s->sphere_axes.n))};
	return &storage->shape;
}

static inline const struct geom_shape *shape_at(const struct geom_shape *s, double time, struct posed_shape *storage)
{
	return surface_is_moving(s) ? pose_moving(s, time, storage) : s;
}

/* A triangle's first vertex and its edges from there. */
struct corner {
	vec3 v0, e1, e2;
};

static struct corner placed_corner(const struct geom_shape *s, const uint32_t i[3])
{
	vec3 p0 = load_float3(s->position, i[0]), p1 = load_float3(s->position, i[1]),
	     p2 = load_float3(s->position, i[2]);
	return (struct corner){placement_point(s->placement, p0), placement_vector(s->placement, vec3_sub(p1, p0)),
			       placement_vector(s->placement, vec3_sub(p2, p0))};
}

static struct corner unrounded_corner(const struct geom_shape *s, const uint32_t i[3])
{
	const struct triangle t = triangle_unrounded((const double(*)[3])s->unrounded, i);
	return (struct corner){t.v[0], vec3_sub(t.v[1], t.v[0]), vec3_sub(t.v[2], t.v[0])};
}

static struct corner load_corner(const struct geom_shape *s, const uint32_t i[3])
{
	if (s->placement)
		return placed_corner(s, i);
	if (s->unrounded)
		return unrounded_corner(s, i);
	vec3 v0 = load_float3(s->position, i[0]);
	return (struct corner){v0, vec3_sub(load_float3(s->position, i[1]), v0),
			       vec3_sub(load_float3(s->position, i[2]), v0)};
}

static vec3 vertex_normal(const struct geom_shape *s, uint32_t i)
{
	return s->placement ? placement_normal(s->placement, load_float3(s->normal, i)) : load_float3(s->normal, i);
}

/* Returns the interpolated normal, not normalised. */
static vec3 interpolated_normal(const struct geom_shape *s, const uint32_t i[3], double b1, double b2)
{
	vec3 m = vec3_scale(1 - b1 - b2, vertex_normal(s, i[0]));
	return vec3_madd(vec3_madd(m, b1, vertex_normal(s, i[1])), b2, vertex_normal(s, i[2]));
}

/* Returns a triangle's point before relief. Without texture coordinates, barycentrics are used. */
static struct relief_site site_on_triangle(const struct geom_shape *s, const struct corner *c, const struct tangents *t,
					   vec3 n, const struct surface_point *x)
{
	struct relief_site r = {
		.ng = x->ng, .n = n, .axis = x->axis, .tu = c->e1, .tv = c->e2, .u = x->u, .v = x->v, .unit = s->unit};
	if (s->uv) {
		bool are_valid = t->are_valid && vec3_is_finite(t->v);
		r.tu = are_valid ? t->u : (vec3){0, 0, 0};
		r.tv = are_valid ? t->v : (vec3){0, 0, 0};
	}
	return r;
}

/* Returns the shading normal before relief. Where the interpolated normal points to the back, the
 * triangle is shaded flat. */
static vec3 smooth_normal(const struct geom_shape *s, const uint32_t i[3], const struct surface_point *x)
{
	if (!s->normal)
		return x->ng;
	vec3 m = interpolated_normal(s, i, x->b1, x->b2);
	return vec3_dot(m, x->ng) > 0 ? vec3_normalize(m) : x->ng;
}

/* Computes the interpolated tangent, not normalised. Returns false if there is none or opposite tangents cancel. */
static bool interpolate_axis(const struct geom_shape *s, uint32_t prim, double b1, double b2, vec3 *axis)
{
	if (!s->tangent)
		return false;
	const float(*t)[3] = (const float(*)[3])s->tangent[prim];
	vec3 a = vec3_madd(vec3_madd(vec3_scale(1 - b1 - b2, load_float3(t, 0)), b1, load_float3(t, 1)), b2,
			   load_float3(t, 2));
	if (!(vec3_dot(a, a) > 0x1p-20))
		return false;
	*axis = s->placement ? placement_vector(s->placement, a) : a;
	return true;
}

/* Fills in everything except x->shape and x->prim. */
static void fill_triangle(const struct geom_shape *s, const uint32_t i[3], const struct corner *c, double b1, double b2,
			  struct surface_point *x)
{
	double b0 = 1 - b1 - b2;
	x->b1 = b1;
	x->b2 = b2;
	x->p = vec3_madd(vec3_madd(c->v0, b1, c->e1), b2, c->e2);
	x->ng = vec3_normalize(vec3_cross(c->e1, c->e2));
	struct tangents t = compute_tangents(s, i, c->e1, c->e2);
	if (!interpolate_axis(s, x->prim.prim, b1, b2, &x->axis))
		x->axis = t.are_valid ? t.u : default_axis(x->ng);
	vec3 n = smooth_normal(s, i, x);
	x->u = b1;
	x->v = b2;
	if (s->uv) {
		x->u = b0 * (double)s->uv[i[0]][0] + b1 * (double)s->uv[i[1]][0] + b2 * (double)s->uv[i[2]][0];
		x->v = b0 * (double)s->uv[i[0]][1] + b1 * (double)s->uv[i[1]][1] + b2 * (double)s->uv[i[2]][1];
	}
	if (s->relief) {
		struct relief_site site = site_on_triangle(s, c, &t, n, x);
		n = relief_normal(s->relief, &site);
	}
	x->sh = frame_along(n, x->axis);
}

void surface_on_triangle(const struct geom_shape *s, struct prim_ref prim, double b1, double b2,
			 struct surface_point *x)
{
	struct posed_shape storage;
	const struct geom_shape *posed = shape_at(s, prim.time, &storage);
	const uint32_t *i = s->index[prim.prim];
	struct corner c = load_corner(posed, i);
	x->prim = prim;
	x->shape = s;
	fill_triangle(posed, i, &c, b1, b2, x);
}

bool surface_on_curve(const struct geom_shape *s, struct prim_ref prim, double along, double around,
		      struct surface_point *x)
{
	struct curve_coordinates coordinates = {along, around};
	if (!curves_have_point(s->curves, prim.prim, coordinates))
		return false;
	curve_fill_point(s, prim, coordinates, x);
	return true;
}

void surface_uv(const struct geom_shape *s, struct surface_point *x)
{
	struct posed_shape storage;
	if (!s->is_sphere)
		return;
	s = shape_at(s, x->prim.time, &storage);
	sphere_uv(&s->sphere_axes, vec3_scale(s->normal_sign, x->ng), &x->u, &x->v);
}

/* Returns a sphere's point before relief. At the poles dp/du is 0. */
static struct relief_site site_on_sphere(const struct geom_shape *s, const struct surface_point *x)
{
	struct relief_site r = {.ng = x->ng, .n = x->ng, .axis = x->axis, .u = x->u, .v = x->v, .unit = s->unit};
	const struct frame *f = &s->sphere_axes;
	double length = vec3_length(x->axis);
	if (!(length > 0))
		return r;
	r.tu = vec3_scale(vec3_dot(vec3_cross(f->s, f->t), f->n) < 0 ? -1 : 1, x->axis);
	r.tv = vec3_scale(M_PI * s->radius * s->normal_sign / length, vec3_cross(x->axis, x->ng));
	return r;
}

/* Fills in everything except x->shape, and u and v unless there is relief. */
static void fill_sphere(const struct geom_shape *s, struct prim_ref prim, vec3 w, struct surface_point *x)
{
	x->prim = prim;
	x->p = vec3_madd(s->center, s->radius, w);
	x->b1 = x->b2 = 0;
	x->ng = vec3_scale(s->normal_sign, w);
	/* The axis is along the longitude, axis x normal. It is undefined at the poles, where
	 * frame_along chooses a frame. */
	x->axis = vec3_scale(2 * M_PI * s->radius, vec3_cross(s->sphere_axes.n, w));
	vec3 n = x->ng;
	if (s->relief) {
		surface_uv(s, x);
		struct relief_site site = site_on_sphere(s, x);
		n = relief_normal(s->relief, &site);
	}
	x->sh = frame_along(n, x->axis);
}

void surface_on_sphere(const struct geom_shape *s, struct prim_ref prim, vec3 w, struct surface_point *x)
{
	struct posed_shape storage;
	const struct geom_shape *posed = shape_at(s, prim.time, &storage);
	x->shape = s;
	fill_sphere(posed, prim, w, x);
	surface_uv(posed, x);
}

static struct relief_site relief_site_of(const struct surface_point *x)
{
	struct posed_shape storage;
	const struct geom_shape *s = shape_at(x->shape, x->prim.time, &storage);
	if (s->curves)
		return curve_relief_site(s, x);
	if (s->is_sphere) {
		struct surface_point y = *x;
		surface_uv(s, &y);
		return site_on_sphere(s, &y);
	}
	const uint32_t *i = s->index[x->prim.prim];
	struct corner c = load_corner(s, i);
	struct tangents t = compute_tangents(s, i, c.e1, c.e2);
	return site_on_triangle(s, &c, &t, smooth_normal(s, i, x), x);
}

static vec3 normal_with_relief(const struct surface_point *x, const struct relief *r)
{
	struct posed_shape storage;
	const struct geom_shape *s = shape_at(x->shape, x->prim.time, &storage);
	if (!r && s->curves)
		return curve_smooth_normal(s, x);
	if (!r)
		return s->is_sphere ? x->ng : smooth_normal(s, s->index[x->prim.prim], x);
	struct relief_site site = relief_site_of(x);
	return relief_normal(r, &site);
}

struct frame surface_frame_with_relief(const void *surface_point, const struct relief *r)
{
	const struct surface_point *x = surface_point;
	struct frame f = frame_along(normal_with_relief(x, r), x->axis);
	return frame_relative_to(&x->sh, &f);
}

void surface_flip_relief(struct surface_point *x)
{
	vec3 n0 = normal_with_relief(x, NULL), n = vec3_madd(vec3_neg(x->sh.n), 2 * vec3_dot(x->sh.n, n0), n0);
	x->sh = frame_along(vec3_normalize(n), x->axis);
}

/* Returns the direction from the centre to the hit in double: the root nearest to Embree's. */
static vec3 sphere_direction(const struct geom_shape *s, vec3 o, vec3 d, double t)
{
	vec3 oc = vec3_sub(o, s->center);
	double b = vec3_dot(oc, d), l = vec3_length(oc), c = (l - s->radius) * (l + s->radius);
	vec3 nearest = vec3_madd(oc, -b, d);
	double disc = fmax(s->radius * s->radius - vec3_dot(nearest, nearest), 0);
	double k = -b - copysign(sqrt(disc), b);
	double other_root = k != 0 ? c / k : k;
	double root = fabs(k - t) < fabs(other_root - t) ? k : other_root;
	return vec3_normalize(vec3_madd(oc, root, d));
}

void surface_from_hit(const struct geom_shape *s, vec3 o, vec3 d, const struct ray_hit *hit, struct surface_point *x)
{
	struct posed_shape storage;
	const struct geom_shape *posed = shape_at(s, hit->prim.time, &storage);
	if (s->is_sphere) {
		surface_on_sphere(posed, hit->prim, sphere_direction(posed, o, d, hit->t), x);
		x->shape = s;
		return;
	}
	if (s->curves) {
		curve_from_hit(s, o, d, hit, x);
		return;
	}
	const uint32_t *i = s->index[hit->prim.prim];
	struct corner c = load_corner(posed, i);
	double b1 = fmin(fmax(hit->u, 0), 1), b2 = fmin(fmax(hit->v, 0), 1 - b1);
	solve_triangle(o, d, c.v0, c.e1, c.e2, &b1, &b2);
	x->prim = hit->prim;
	x->shape = s;
	fill_triangle(posed, i, &c, b1, b2, x);
}

void surface_tangents(const struct surface_point *x, vec3 *du, vec3 *dv)
{
	/* If both normals are equal, the shading frame is also the frame of ng. */
	if (x->sh.n.x == x->ng.x && x->sh.n.y == x->ng.y && x->sh.n.z == x->ng.z) {
		*du = x->sh.s;
		*dv = x->sh.t;
		return;
	}
	struct frame f = frame_along(x->ng, x->axis);
	*du = f.s;
	*dv = f.t;
}

static void sphere_derivatives(const struct geom_shape *s, const struct surface_point *x, struct surface_derivatives *c)
{
	double curvature = 1 / s->radius;
	c->dn[0] = vec3_scale(s->normal_sign * curvature, c->du);
	c->dn[1] = vec3_scale(s->normal_sign * curvature, c->dv);
	/* du is the normalised axis x w. Per unit length along the circle of latitude, it turns by `curvature` towards
	 * the centre and by curvature cot(theta) towards the pole; along the meridian it is transported in parallel. */
	vec3 w = vec3_scale(s->normal_sign, x->ng);
	double cosine = vec3_dot(s->sphere_axes.n, w), sine = vec3_length(vec3_cross(s->sphere_axes.n, w));
	vec3 turn = vec3_scale(-curvature, w);
	if (sine > 0)
		turn = vec3_madd(turn, curvature * cosine / sine, vec3_cross(w, c->du));
	c->daxis[0] = vec3_is_finite(turn) ? turn : vec3_scale(-curvature, w);
}

static void bend_sphere_derivatives(const struct geom_shape *s, const struct surface_point *x,
				    struct surface_derivatives *c)
{
	struct relief_site site = site_on_sphere(s, x);
	double tu2 = vec3_dot(site.tu, site.tu), tv2 = vec3_dot(site.tv, site.tv),
	       orientation = vec3_dot(site.tu, x->axis) < 0 ? -1 : 1;
	if (!(tu2 > 0) || !(tv2 > 0))
		return;
	vec3 w = vec3_scale(s->normal_sign, x->ng);
	site.axis = c->axis;
	for (int k = 0; k < 2; k++) {
		vec3 tangent = k ? c->dv : c->du;
		struct relief_derivatives d = {.dn = c->dn[k],
					       .daxis = c->daxis[k],
					       .du = vec3_dot(tangent, site.tu) / tu2,
					       .dv = vec3_dot(tangent, site.tv) / tv2};
		d.dtu = vec3_scale(2 * M_PI * orientation, vec3_cross(s->sphere_axes.n, tangent));
		d.dtv = vec3_scale(M_PI, vec3_madd(vec3_cross(c->du, tangent), s->radius, vec3_cross(c->daxis[k], w)));
		c->dn[k] = relief_normal_derivative(s->relief, &site, &d);
	}
}

/* Computes the gradients of the second and third barycentric. */
static void barycentric_gradients(const struct corner *k, vec3 *g1, vec3 *g2)
{
	vec3 area = vec3_cross(k->e1, k->e2);
	double inverse = 1 / vec3_dot(area, area);
	*g1 = vec3_scale(inverse, vec3_cross(k->e2, area));
	*g2 = vec3_scale(inverse, vec3_cross(area, k->e1));
}

/* Computes the unit axis and its derivatives from the interpolated tangent. */
static void axis_derivatives(const struct geom_shape *s, const struct surface_point *x, struct surface_derivatives *c)
{
	vec3 a, g1, g2;
	if (!interpolate_axis(s, x->prim.prim, x->b1, x->b2, &a))
		return;
	const float(*t)[3] = (const float(*)[3])s->tangent[x->prim.prim];
	vec3 a1 = vec3_sub(load_float3(t, 1), load_float3(t, 0)), a2 = vec3_sub(load_float3(t, 2), load_float3(t, 0));
	if (s->placement) {
		a1 = placement_vector(s->placement, a1);
		a2 = placement_vector(s->placement, a2);
	}
	struct corner k = load_corner(s, s->index[x->prim.prim]);
	barycentric_gradients(&k, &g1, &g2);
	double length = vec3_length(a);
	c->axis = vec3_scale(1 / length, a);
	for (int d = 0; d < 2; d++) {
		vec3 tangent = d ? c->dv : c->du;
		vec3 da = vec3_madd(vec3_scale(vec3_dot(tangent, g1), a1), vec3_dot(tangent, g2), a2);
		vec3 turn = vec3_scale(1 / length, vec3_madd(da, -vec3_dot(c->axis, da), c->axis));
		if (vec3_is_finite(turn))
			c->daxis[d] = turn;
	}
}

/* Returns the normal without relief and sets its derivatives in c->dn. */
static vec3 triangle_derivatives(const struct geom_shape *s, const struct surface_point *x,
				 struct surface_derivatives *c)
{
	const uint32_t *i = s->index[x->prim.prim];
	if (!s->normal)
		return x->ng;
	vec3 m = interpolated_normal(s, i, x->b1, x->b2), n0 = vertex_normal(s, i[0]), g1, g2;
	if (!(vec3_dot(m, x->ng) > 0))
		return x->ng;
	struct corner k = load_corner(s, i);
	barycentric_gradients(&k, &g1, &g2);
	vec3 m1 = vec3_sub(vertex_normal(s, i[1]), n0), m2 = vec3_sub(vertex_normal(s, i[2]), n0),
	     n = s->relief ? vec3_normalize(m) : x->sh.n;
	double length = vec3_length(m);
	for (int d = 0; d < 2; d++) {
		vec3 tangent = d ? c->dv : c->du;
		vec3 dm = vec3_madd(vec3_scale(vec3_dot(tangent, g1), m1), vec3_dot(tangent, g2), m2);
		vec3 dn = vec3_scale(1 / length, vec3_madd(dm, -vec3_dot(n, dm), n));
		if (vec3_is_finite(dn))
			c->dn[d] = dn;
	}
	return n;
}

static void bend_triangle_derivatives(const struct geom_shape *s, const struct surface_point *x, vec3 n,
				      struct surface_derivatives *c)
{
	const uint32_t *i = s->index[x->prim.prim];
	struct corner k = load_corner(s, i);
	struct tangents t = compute_tangents(s, i, k.e1, k.e2);
	struct relief_site site = site_on_triangle(s, &k, &t, n, x);
	double t1[2] = {1, 0}, t2[2] = {0, 1}; /* derivatives of (u,v) with respect to the barycentrics */
	for (int a = 0; s->uv && a < 2; a++) {
		t1[a] = (double)s->uv[i[1]][a] - (double)s->uv[i[0]][a];
		t2[a] = (double)s->uv[i[2]][a] - (double)s->uv[i[0]][a];
	}
	vec3 g1, g2;
	barycentric_gradients(&k, &g1, &g2);
	site.axis = c->axis;
	for (int a = 0; a < 2; a++) {
		vec3 tangent = a ? c->dv : c->du;
		double b1 = vec3_dot(tangent, g1), b2 = vec3_dot(tangent, g2);
		struct relief_derivatives d = {.dn = c->dn[a],
					       .daxis = c->daxis[a],
					       .du = b1 * t1[0] + b2 * t2[0],
					       .dv = b1 * t1[1] + b2 * t2[1]};
		c->dn[a] = relief_normal_derivative(s->relief, &site, &d);
	}
}

void surface_compute_derivatives(const struct geom_shape *s, const struct surface_point *x,
				 struct surface_derivatives *c)
{
	struct posed_shape storage;
	*c = (struct surface_derivatives){.dn = {{0, 0, 0}}};
	surface_tangents(x, &c->du, &c->dv);
	c->axis = c->du;
	s = shape_at(s, x->prim.time, &storage);
	if (s->curves) {
		curve_derivatives(s, x, c);
	} else if (s->is_sphere) {
		sphere_derivatives(s, x, c);
		if (s->relief)
			bend_sphere_derivatives(s, x, c);
	} else if (s->normal || s->relief) {
		axis_derivatives(s, x, c);
		vec3 n = triangle_derivatives(s, x, c);
		if (s->relief)
			bend_triangle_derivatives(s, x, n, c);
	}
}

static bool reproject_triangle(const struct geom_shape *s, struct prim_ref prim, vec3 o, vec3 d,
			       struct surface_point *x)
{
	const uint32_t *i = s->index[prim.prim];
	struct corner c = load_corner(s, i);
	vec3 h = vec3_cross(d, c.e2), offset = vec3_sub(o, c.v0), q = vec3_cross(offset, c.e1);
	double det = vec3_dot(c.e1, h), side = copysign(1, det);
	double b1 = side * vec3_dot(offset, h), b2 = side * vec3_dot(d, q), scale = fabs(det);
	if (!(b1 >= 0) || !(b2 >= 0) || !(b1 + b2 <= scale) || !(side * vec3_dot(c.e2, q) > 0) || !(scale > 0))
		return false;
	x->prim = prim;
	fill_triangle(s, i, &c, b1 / scale, b2 / scale, x);
	return true;
}

static bool reproject_sphere(const struct geom_shape *s, struct prim_ref prim, bool starts_on_sphere, vec3 o, vec3 d,
			     double t_near, struct surface_point *x)
{
	vec3 oc = vec3_sub(o, s->center);
	double b = vec3_dot(oc, d), root;
	if (starts_on_sphere) {
		root = -2 * b; /* the other root is the start */
	} else {
		double line_distance = vec3_length(vec3_madd(oc, -b, d)), l = vec3_length(oc);
		double disc = (s->radius - line_distance) * (s->radius + line_distance),
		       c = (l - s->radius) * (l + s->radius);
		if (!(disc >= 0))
			return false;
		double k = -b - copysign(sqrt(disc), b), other = k != 0 ? c / k : k;
		double nearer = fmin(k, other), farther = fmax(k, other);
		root = nearer > 0 && fabs(nearer - t_near) <= fabs(farther - t_near) ? nearer : farther;
	}
	if (!(root > 0) || !isfinite(root))
		return false;
	fill_sphere(s, prim, vec3_normalize(vec3_madd(oc, root, d)), x);
	return true;
}

bool surface_reproject(const struct geom_shape *s, struct prim_ref prim, struct prim_ref from, vec3 o, vec3 d,
		       double t_near, struct surface_point *x)
{
	struct posed_shape storage;
	const struct geom_shape *posed = shape_at(s, prim.time, &storage);
	bool starts_on_prim = prim.shape == from.shape && prim.prim == from.prim;
	x->shape = s;
	if (s->is_sphere)
		return reproject_sphere(posed, prim, starts_on_prim, o, d, t_near, x);
	if (s->curves)
		return curve_reproject(s, prim, from, o, d, t_near, x);
	return !starts_on_prim && reproject_triangle(posed, prim, o, d, x);
}

bool surface_nearest(const struct geom_shape *s, struct prim_ref prim, vec3 p, struct surface_point *x)
{
	struct posed_shape storage;
	const struct geom_shape *posed = shape_at(s, prim.time, &storage);
	if (s->is_sphere) {
		vec3 d = vec3_sub(p, posed->center);
		if (!(vec3_dot(d, d) > 0))
			return false;
		surface_on_sphere(s, prim, vec3_normalize(d), x);
		return true;
	}
	if (s->curves)
		return curve_nearest_point(s, prim, p, x);
	if (prim.prim >= s->triangle_count)
		return false;
	const uint32_t *i = s->index[prim.prim];
	struct corner c = load_corner(posed, i);
	vec3 area = vec3_cross(c.e1, c.e2), d = vec3_sub(p, c.v0);
	double area2 = vec3_dot(area, area);
	if (!(area2 > 0))
		return false;
	double b1 = vec3_dot(vec3_cross(d, c.e2), area) / area2, b2 = vec3_dot(vec3_cross(c.e1, d), area) / area2;
	if (!isfinite(b1) || !isfinite(b2))
		return false;
	if (b1 < 0 || b2 < 0 || b1 + b2 > 1)
		move_inside(c.e1, c.e2, &b1, &b2);
	x->prim = prim;
	x->shape = s;
	fill_triangle(posed, i, &c, b1, b2, x);
	return true;
}
