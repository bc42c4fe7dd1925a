/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The part of surface.h for curves. dp/du runs around a curve and dp/dv along it, as in Mitsuba's `linearcurve`: the
 * shading frame's s is around and its t along the curve.
 *
 * With tangents, shading normals are perpendicular to the tangent of the smooth curve instead of the cone's axis. Let D
 * be the tangent divided by its component along the axis, minus the axis. Then a vector w perpendicular to the axis
 * becomes w - (w.D) axis, which is perpendicular to axis + D. D is interpolated along a cone. Pure; any thread.
 */
#ifndef WORKER_RENDER_GEOM_SURFACE_CURVE_H
#define WORKER_RENDER_GEOM_SURFACE_CURVE_H

#include "worker/render/geom/curves.h"
#include "worker/render/geom/surface_point.h"

void curve_fill_point(const struct geom_shape *s, struct prim_ref prim, struct curve_coordinates coordinates,
		      struct surface_point *x);
void curve_from_hit(const struct geom_shape *s, vec3 o, vec3 d, const struct ray_hit *hit, struct surface_point *x);
bool curve_reproject(const struct geom_shape *s, struct prim_ref prim, struct prim_ref from, vec3 o, vec3 d,
		     double t_near, struct surface_point *x);
bool curve_nearest_point(const struct geom_shape *s, struct prim_ref prim, vec3 p, struct surface_point *x);

vec3 curve_smooth_normal(const struct geom_shape *s, const struct surface_point *x);
struct relief_site curve_relief_site(const struct geom_shape *s, const struct surface_point *x);
/* Computes c->dn and c->daxis. On entry, c has du and dv, axis is du, and the rest is 0. */
void curve_derivatives(const struct geom_shape *s, const struct surface_point *x, struct surface_derivatives *c);

#endif
