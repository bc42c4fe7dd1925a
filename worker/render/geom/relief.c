/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/geom/relief.h"

#include <stddef.h>

/* The bent normal before normalisation, and its derivative. */
struct bent_normal {
	vec3 m, dm;
};

/* Computes the tangent t made orthogonal to n and lifted by the slope, and its derivative if d is given. */
static void lift_tangent(const struct relief_site *s, const struct relief_derivatives *d, vec3 t, vec3 dt, double slope,
			 double dslope, struct bent_normal *out)
{
	double rise = slope - vec3_dot(s->n, t);
	out->m = vec3_madd(t, rise, s->n);
	if (!d)
		return;
	double drise = dslope - vec3_dot(d->dn, t) - vec3_dot(s->n, dt);
	out->dm = vec3_madd(vec3_madd(dt, rise, d->dn), drise, s->n);
}

static void bend_height(const struct relief_site *s, const struct relief_derivatives *d, const struct relief_sample *h,
			struct bent_normal *out)
{
	struct bent_normal a = {.dm = {0, 0, 0}}, b = {.dm = {0, 0, 0}};
	vec3 change = d ? vec3_scale(s->unit, vec3_madd(vec3_scale(d->du, h->du), d->dv, h->dv)) : (vec3){0, 0, 0},
	     zero = {0, 0, 0};
	lift_tangent(s, d, s->tu, d ? d->dtu : zero, s->unit * h->x.x, change.x, &a);
	lift_tangent(s, d, s->tv, d ? d->dtv : zero, s->unit * h->x.y, change.y, &b);
	/* The sign accounts for mirrored texture coordinates. */
	double orientation = vec3_dot(vec3_cross(s->tu, s->tv), s->n) < 0 ? -1 : 1;
	out->m = vec3_scale(orientation, vec3_cross(a.m, b.m));
	if (d)
		out->dm = vec3_scale(orientation, vec3_add(vec3_cross(a.dm, b.m), vec3_cross(a.m, b.dm)));
}

/* Whether the texture coordinates are mirrored, as seen from outside with v pointing down. */
static bool is_mirrored(const struct relief_site *s)
{
	return vec3_dot(vec3_cross(s->tu, s->tv), s->n) > 0;
}

/* Bends the normal by a normal map. The frame turns with n, and around n with the axis: see
 * worker/render/halfvec/constraint.c. */
static void bend_normal(const struct relief_site *s, const struct relief_derivatives *d, struct relief_sample *l,
			bool mirrored, struct bent_normal *out)
{
	struct frame f = frame_along(s->n, s->axis);
	if (mirrored) {
		l->x.y = -l->x.y;
		l->du.y = -l->du.y;
		l->dv.y = -l->dv.y;
	}
	out->m = frame_to_world(&f, l->x);
	if (!d)
		return;
	double dns = vec3_dot(f.s, d->dn), dnt = vec3_dot(f.t, d->dn), axis_length = vec3_dot(f.s, s->axis);
	double twist = axis_length > 0 ? (vec3_dot(f.t, d->daxis) - dnt * vec3_dot(f.n, s->axis)) / axis_length : 0;
	vec3 ds = vec3_madd(vec3_scale(-dns, f.n), twist, f.t), dt = vec3_madd(vec3_scale(-dnt, f.n), -twist, f.s);
	vec3 change = vec3_madd(vec3_scale(d->du, l->du), d->dv, l->dv);
	out->dm = vec3_add(frame_to_world(&f, change),
			   vec3_madd(vec3_madd(vec3_scale(l->x.x, ds), l->x.y, dt), l->x.z, d->dn));
}

/* Computes the bent normal. Returns false if the surface keeps its normal. */
static bool apply_relief(const struct relief *r, const struct relief_site *s, const struct relief_derivatives *d,
			 struct bent_normal *out)
{
	struct relief_sample x;
	if (!(vec3_dot(s->tu, s->tu) > 0) || !(vec3_dot(s->tv, s->tv) > 0))
		return false;
	r->eval(r->data, s->u, s->v, &x);
	if (r->kind == RELIEF_HEIGHT)
		bend_height(s, d, &x, out);
	else
		bend_normal(s, d, &x, r->uses_handedness && is_mirrored(s), out);
	double length2 = vec3_dot(out->m, out->m);
	return vec3_dot(out->m, s->ng) > 0 && length2 > 0x1p-900 && isfinite(length2);
}

/* Returns the point with the normal that it has before r bends it, and changes the step, if there is one, to match. */
static struct relief_site site_under(const struct relief *r, const struct relief_site *s, struct relief_derivatives *d)
{
	struct relief_site raised = *s;
	if (!r->base)
		return raised;
	raised.n = relief_normal(r->base, s);
	if (d)
		d->dn = relief_normal_derivative(r->base, s, d);
	return raised;
}

vec3 relief_normal(const struct relief *r, const struct relief_site *s)
{
	struct bent_normal b;
	const struct relief_site from = site_under(r, s, NULL);
	vec3 n = apply_relief(r, &from, NULL, &b) ? vec3_normalize(b.m) : from.n;
	return vec3_is_finite(n) ? n : from.n;
}

vec3 relief_normal_derivative(const struct relief *r, const struct relief_site *s, const struct relief_derivatives *d)
{
	struct bent_normal b;
	struct relief_derivatives step = *d;
	const struct relief_site from = site_under(r, s, &step);
	if (!apply_relief(r, &from, &step, &b))
		return step.dn;
	vec3 n = vec3_normalize(b.m);
	vec3 turn = vec3_scale(1 / vec3_length(b.m), vec3_madd(b.dm, -vec3_dot(n, b.dm), n));
	return vec3_is_finite(turn) ? turn : step.dn;
}
