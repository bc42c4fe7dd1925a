/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Surface points on curves and their derivatives.
 *
 * All derivatives follow from how a point of a cone moves: moving by `around` along `side` turns `radial` by around /
 * axis_distance; moving by `up` along the surface moves the centre of the point's sphere by up / (length cos) of the
 * axis on the cone's side, and turns the normal on a sphere.
 *
 * Nothing fails: where the frame has no derivative, at the poles of spheres and at tips, the derivative is 0.
 */
#include "worker/render/geom/surface_curve.h"

/* D (surface_curve.h) at a point of a cone, and its difference between the two ends. */
struct joint_bend {
	vec3 d, change;
};

/* Returns D at one end; 0 if the tangent points backwards or sideways, so that this end is shaded as the cone is. */
static vec3 bend_at_end(const struct cone *k, const float tangent[3])
{
	vec3 t = {(double)tangent[0], (double)tangent[1], (double)tangent[2]};
	double axis_component = vec3_dot(t, k->axis);
	return axis_component > 0.25 ? vec3_madd(vec3_scale(1 / axis_component, t), -1, k->axis) : (vec3){0, 0, 0};
}

static struct joint_bend compute_bend(const struct curves *c, uint32_t prim, const struct curve_point *p)
{
	struct joint_bend b = {{0, 0, 0}, {0, 0, 0}};
	if (!c->tangent)
		return b;
	uint32_t i = c->cone[prim] >> CURVE_SHIFT;
	vec3 first = bend_at_end(&p->cone, c->tangent[i]);
	b.change = vec3_sub(bend_at_end(&p->cone, c->tangent[i + 1]), first);
	b.d = vec3_madd(first, p->side_position, b.change);
	return b;
}

/* Returns w - (w.D) axis (surface_curve.h), not normalised. */
static vec3 bend_vector(const struct curve_point *p, const struct joint_bend *b, vec3 w)
{
	return vec3_madd(w, -vec3_dot(w, b->d), p->cone.axis);
}

/* Returns the outward shading normal before relief, not normalised; *flat: it is the geometric normal. */
static vec3 outward_normal(const struct curve_point *p, const struct joint_bend *b, bool *flat)
{
	vec3 m = bend_vector(p, b, p->n);
	*flat = !(vec3_dot(m, p->n) > 0.25);
	return *flat ? p->n : m;
}

static struct curve_point compute_curve_point(const struct geom_shape *s, const struct surface_point *x)
{
	struct curve_point p;
	curves_compute_point(s->curves, x->prim.prim, (struct curve_coordinates){x->b1, x->b2}, &p);
	return p;
}

vec3 curve_smooth_normal(const struct geom_shape *s, const struct surface_point *x)
{
	bool flat;
	struct curve_point p = compute_curve_point(s, x);
	struct joint_bend b = compute_bend(s->curves, x->prim.prim, &p);
	return vec3_scale(s->normal_sign, vec3_normalize(outward_normal(&p, &b, &flat)));
}

/* Returns by how much the texture coordinate v grows over the cone. */
static double texture_v_growth(const struct curves *c, uint32_t prim)
{
	uint32_t i = c->cone[prim] >> CURVE_SHIFT;
	return (double)c->v[i + 1] - (double)c->v[i];
}

/* Returns the point before relief. On the spheres dp/dv is 0, so relief does not apply there. */
static struct relief_site make_relief_site(const struct geom_shape *s, const struct surface_point *x,
					   const struct curve_point *p, vec3 n)
{
	struct relief_site r = {.ng = x->ng, .n = n, .axis = x->axis, .u = x->u, .v = x->v, .unit = s->unit};
	double v_growth = texture_v_growth(s->curves, x->prim.prim);
	if (p->part == CONE_SIDE && v_growth > 0) {
		r.tu = vec3_scale(2 * M_PI * p->axis_distance, p->side);
		r.tv = vec3_scale(p->cone.length * p->cone.cos / v_growth, p->up);
	}
	return r;
}

struct relief_site curve_relief_site(const struct geom_shape *s, const struct surface_point *x)
{
	struct curve_point p = compute_curve_point(s, x);
	return make_relief_site(s, x, &p, curve_smooth_normal(s, x));
}

void curve_fill_point(const struct geom_shape *s, struct prim_ref prim, struct curve_coordinates coordinates,
		      struct surface_point *x)
{
	struct curve_point p;
	bool flat;
	curves_compute_point(s->curves, prim.prim, coordinates, &p);
	struct joint_bend b = compute_bend(s->curves, prim.prim, &p);
	x->prim = prim;
	x->shape = s;
	x->p = p.p;
	x->b1 = coordinates.along;
	x->b2 = coordinates.around;
	x->u = p.u;
	x->v = p.v;
	x->ng = vec3_scale(s->normal_sign, p.n);
	x->axis = bend_vector(&p, &b, p.side);
	vec3 m = outward_normal(&p, &b, &flat),
	     n = flat || !s->curves->tangent ? x->ng : vec3_scale(s->normal_sign, vec3_normalize(m));
	if (s->relief) {
		struct relief_site site = make_relief_site(s, x, &p, n);
		n = relief_normal(s->relief, &site);
	}
	x->sh = frame_along(n, x->axis);
}

void curve_from_hit(const struct geom_shape *s, vec3 o, vec3 d, const struct ray_hit *hit, struct surface_point *x)
{
	struct cone k = curves_cone(s->curves, hit->prim.prim);
	enum cone_part part = hit->u < 0.5 ? CONE_START : hit->u < 1.5 ? CONE_SIDE : CONE_END;
	double root[2], t = hit->t;
	/* If rounding leaves no two roots, Embree's distance is as good. */
	if (cone_roots(&k, part, o, d, root) && isfinite(root[hit->v > 0.5]))
		t = root[hit->v > 0.5];
	if (part == CONE_SIDE && !(k.cos > 0))
		part = k.sin > 0 ? CONE_START : CONE_END;
	curve_fill_point(s, hit->prim, curves_coordinates(&k, part, vec3_madd(o, t, d)), x);
}

bool curve_reproject(const struct geom_shape *s, struct prim_ref prim, struct prim_ref from, vec3 o, vec3 d,
		     double t_near, struct surface_point *x)
{
	struct curve_ray r = {.o = o,
			      .d = d,
			      .starts_on_curve = prim.shape == from.shape,
			      .start_prim = from.prim,
			      .t_max = INFINITY};
	struct curve_crossing crossing;
	if (prim.prim >= s->curves->count || !curves_intersect_near(s->curves, prim.prim, &r, t_near, &crossing))
		return false;
	struct cone k = curves_cone(s->curves, prim.prim);
	curve_fill_point(s, prim, curves_coordinates(&k, crossing.part, vec3_madd(o, crossing.t, d)), x);
	return true;
}

bool curve_nearest_point(const struct geom_shape *s, struct prim_ref prim, vec3 p, struct surface_point *x)
{
	if (prim.prim >= s->curves->count)
		return false;
	struct curve_coordinates coordinates = curves_nearest_coordinates(s->curves, prim.prim, p);
	if (!vec3_is_finite(p) || !curves_have_point(s->curves, prim.prim, coordinates))
		return false;
	curve_fill_point(s, prim, coordinates, x);
	return true;
}

/* ---- derivatives ---- */

/* Derivatives as the point moves by a unit length along a tangent. */
struct point_derivatives {
	/* turn: of curve_point.radial around the axis, in radians; s: along the axis, in units of the cone's length. */
	double turn, s;
	vec3 dn, dside;
};

static struct point_derivatives derivatives_along(const struct curve_point *p, vec3 tangent)
{
	double around = vec3_dot(tangent, p->side), up = vec3_dot(tangent, p->up);
	struct point_derivatives m = {.turn = p->axis_distance > 0 ? around / p->axis_distance : 0};
	if (!isfinite(m.turn))
		m.turn = 0;
	m.dside = vec3_scale(-m.turn, p->radial);
	if (p->part == CONE_SIDE) {
		m.s = up / (p->cone.length * p->cone.cos);
		m.dn = vec3_scale(m.turn * p->cone.cos, p->side);
	} else {
		double radius = p->part == CONE_START ? p->cone.r0 : p->cone.r1;
		m.dn = vec3_scale(radius > 0 ? 1 / radius : 0, tangent);
	}
	return m;
}

/* Returns the derivative of bend_vector() if w changes by dw. */
static vec3 bend_vector_derivative(const struct curve_point *p, const struct joint_bend *b,
				   const struct point_derivatives *m, vec3 w, vec3 dw)
{
	return vec3_madd(dw, -vec3_dot(dw, b->d) - m->s * vec3_dot(w, b->change), p->cone.axis);
}

/* Returns the derivative of w / |w|. */
static vec3 unit_vector_derivative(vec3 w, vec3 dw)
{
	double length = vec3_length(w);
	vec3 unit = vec3_scale(1 / length, w);
	return vec3_scale(1 / length, vec3_madd(dw, -vec3_dot(unit, dw), unit));
}

/* Returns how dp/du and dp/dv change on the side: `radial` turns, axis_distance shrinks by sin as the point
 * moves up, and `up` turns with `radial`. */
static struct relief_derivatives make_relief_derivatives(const struct geom_shape *s, const struct surface_point *x,
							 const struct curve_point *p, const struct point_derivatives *m,
							 double up)
{
	const struct cone *k = &p->cone;
	double v_growth = texture_v_growth(s->curves, x->prim.prim);
	struct relief_derivatives d = {.du = m->turn / (2 * M_PI), .dv = m->s * v_growth};
	d.dtu = vec3_scale(2 * M_PI, vec3_madd(vec3_scale(p->axis_distance, m->dside), -up * k->sin, p->side));
	d.dtv = vec3_scale(-k->length * k->cos / v_growth * k->sin * m->turn, p->side);
	return d;
}

void curve_derivatives(const struct geom_shape *s, const struct surface_point *x, struct surface_derivatives *c)
{
	struct curve_point p = compute_curve_point(s, x);
	struct joint_bend b = compute_bend(s->curves, x->prim.prim, &p);
	bool flat;
	vec3 m = outward_normal(&p, &b, &flat), axis = bend_vector(&p, &b, p.side);
	struct relief_site site = make_relief_site(s, x, &p, vec3_scale(s->normal_sign, vec3_normalize(m)));
	bool relief = s->relief && vec3_dot(site.tu, site.tu) > 0 && vec3_dot(site.tv, site.tv) > 0;
	c->axis = site.axis = vec3_normalize(axis);
	for (int i = 0; i < 2; i++) {
		vec3 tangent = i ? c->dv : c->du;
		struct point_derivatives step = derivatives_along(&p, tangent);
		vec3 dm = flat ? step.dn : bend_vector_derivative(&p, &b, &step, p.n, step.dn),
		     dn = vec3_scale(s->normal_sign, unit_vector_derivative(m, dm)),
		     da = unit_vector_derivative(axis, bend_vector_derivative(&p, &b, &step, p.side, step.dside));
		c->dn[i] = vec3_is_finite(dn) ? dn : (vec3){0, 0, 0};
		c->daxis[i] = vec3_is_finite(da) ? da : (vec3){0, 0, 0};
		if (!relief)
			continue;
		struct relief_derivatives d = make_relief_derivatives(s, x, &p, &step, vec3_dot(tangent, p.up));
		d.dn = c->dn[i];
		d.daxis = c->daxis[i];
		c->dn[i] = relief_normal_derivative(s->relief, &site, &d);
	}
}
