/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Callbacks by which Embree gets the bounds of a primitive and finds out whether a ray meets it. A sphere is met at the
 * roots of a quadratic, a triangle where the ray crosses its plane, a curve as in curves.h, all in double. Coinciding
 * surfaces and the primitives on which the ray starts and ends are treated as for the triangles that Embree intersects
 * itself. A primitive that moves is placed where it is at the query's time; its bounds hold for all times.
 *
 * Nothing fails here: comparisons are such that a root that is NaN is no hit.
 */
#include "worker/render/geom/user_geometry.h"

bool query_crosses(const struct ray_query *q, const struct accel_shape *s, uint32_t prim)
{
	const struct triangle t = accel_triangle(s, prim, q->start_prim.time);
	double start = triangle_height(&t, q->o);
	double end = q->is_segment ? -triangle_height(&t, q->end) : vec3_dot(t.n, q->d);
	return (start > 0 && end > 0) || (start < 0 && end < 0);
}

/* A ray that leaves a surface at an angle whose sine is less than 1 / GRAZING_FACTOR_MAX may lose hits that are closer
 * to the surface than the error of floats. */
#define GRAZING_FACTOR_MAX 64.0

double query_grazing_factor(vec3 n, vec3 d)
{
	double length = vec3_length(d), height = fabs(vec3_dot(n, d));
	if (!(vec3_dot(n, n) > 0))
		return 1;
	return fmax(height * GRAZING_FACTOR_MAX > length ? length / height : GRAZING_FACTOR_MAX, 1);
}

struct prim_ref query_present_prim(const struct ray_query *q, struct prim_ref prim)
{
	if (!query_may_be_hidden(q, prim.shape))
		return prim;
	const struct triangle t = accel_triangle(&q->shapes[prim.shape], prim.prim, q->start_prim.time);
	double slope = vec3_dot(t.n, q->d);
	if (slope == 0)
		return prim;
	return coincide_present_prim(q->coincidence, q->shapes, prim,
				     vec3_madd(q->o, vec3_dot(t.n, vec3_sub(t.v[0], q->o)) / slope, q->d));
}

bool query_crosses_present(const struct ray_query *q, struct prim_ref prim)
{
	struct prim_ref present = query_present_prim(q, prim);
	return !query_is_end(q, present) && query_crosses(q, &q->shapes[present.shape], present.prim);
}

static void set_bounds(vec3 c, vec3 h, double r, struct RTCBounds *b)
{
	b->lower_x = (float)(c.x - h.x - r);
	b->lower_y = (float)(c.y - h.y - r);
	b->lower_z = (float)(c.z - h.z - r);
	b->upper_x = (float)(c.x + h.x + r);
	b->upper_y = (float)(c.y + h.y + r);
	b->upper_z = (float)(c.z + h.z + r);
}

/* The bounds of a moving primitive, enlarged like those of a sphere that does not move. */
static void set_moving_bounds(const struct placement *p, struct RTCBounds *b)
{
	vec3 c = p->center, h = p->half;
	set_bounds(c, h, 0x1p-20 * (fmax(h.x, fmax(h.y, h.z)) + fabs(c.x) + fabs(c.y) + fabs(c.z)), b);
}

/* Not inline, to keep it out of the path of spheres that do not move. */
__attribute__((noinline)) static struct sphere_prim sphere_at_time(const struct sphere_prim *s, double time)
{
	struct placement placement;
	placement_compute_at(s->placement, time, &placement);
	return (struct sphere_prim){placement_point(&placement, s->center), s->radius * vec3_length(placement.x), NULL,
				    s->shape};
}

static void sphere_bounds(const struct RTCBoundsFunctionArguments *args)
{
	const struct sphere_prim *s = args->geometryUserPtr;
	if (s->placement) {
		set_moving_bounds(s->placement, args->bounds_o);
		return;
	}
	/* Enlarged by one part in 2^20: more than the float rounding of the box and of Embree's slab test. */
	double r = s->radius * (1 + 0x1p-20) + 0x1p-20 * (fabs(s->center.x) + fabs(s->center.y) + fabs(s->center.z));
	set_bounds(s->center, (vec3){0, 0, 0}, r, args->bounds_o);
}

/* Computes the nearest valid root of |o + t d - c|^2 = r^2 in (t_min, t_max). If the ray starts on the sphere one
 * root is 0, if a segment ends on it one root is 1: the other root follows from Vieta's formulas without
 * cancellation. Otherwise the discriminant is computed from the distance of the line to the centre (Haines et al.
 * 2019, Ray Tracing Gems ch. 7). */
static bool sphere_root(const struct sphere_prim *sphere, const struct ray_query *q, double t_max, double *t)
{
	struct sphere_prim moved;
	const struct sphere_prim *s = sphere;
	if (sphere->placement) {
		moved = sphere_at_time(sphere, q->start_prim.time);
		s = &moved;
	}
	vec3 oc = vec3_sub(q->o, s->center);
	double a = vec3_dot(q->d, q->d), b = vec3_dot(oc, q->d);
	double length = vec3_length(oc), c = (length - s->radius) * (length + s->radius);
	bool starts = q->start_prim.shape == s->shape, ends = q->end_prim.shape == s->shape;
	if (starts && ends)
		return false;
	if (starts || ends) {
		*t = starts ? -2 * b / a : c / a;
		return *t > q->t_min && *t < t_max;
	}
	vec3 nearest = vec3_madd(oc, -b / a, q->d);
	double disc = s->radius * s->radius - vec3_dot(nearest, nearest);
	if (!(disc >= 0))
		return false;
	double k = -b - copysign(sqrt(disc * a), b);
	double t0 = k / a, t1 = k != 0 ? c / k : t0;
	double first = fmin(t0, t1), second = fmax(t0, t1);
	*t = first > q->t_min ? first : second;
	return *t > q->t_min && *t < t_max;
}

static void sphere_intersect(const struct RTCIntersectFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	const struct ray_query *q = (const struct ray_query *)(const void *)args->context;
	const struct sphere_prim *s = args->geometryUserPtr;
	struct RTCRayHit *rh = (struct RTCRayHit *)(void *)args->rayhit;
	double t;
	if (!sphere_root(s, q, (double)rh->ray.tfar - q->origin_lead, &t))
		return;
	rh->ray.tfar = (float)(t + q->origin_lead);
	rh->hit.geomID = s->shape;
	rh->hit.primID = 0;
	rh->hit.u = rh->hit.v = 0;
}

static void sphere_occluded(const struct RTCOccludedFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	const struct ray_query *q = (const struct ray_query *)(const void *)args->context;
	struct RTCRay *ray = (struct RTCRay *)(void *)args->ray;
	double t;
	if (sphere_root(args->geometryUserPtr, q, q->is_segment ? 1 : INFINITY, &t))
		ray->tfar = -INFINITY;
}

static void wide_bounds(const struct RTCBoundsFunctionArguments *args)
{
	const struct wide_prims *w = args->geometryUserPtr;
	const uint32_t *i = w->shape->index[w->prims[args->primID]];
	const float(*p)[3] = w->shape->position;
	float low[3], high[3];
	for (int k = 0; k < 3; k++) {
		float margin = 0x1p-20f * (fabsf(p[i[0]][k]) + fabsf(p[i[1]][k]) + fabsf(p[i[2]][k]));
		low[k] = fminf(p[i[0]][k], fminf(p[i[1]][k], p[i[2]][k])) - margin;
		high[k] = fmaxf(p[i[0]][k], fmaxf(p[i[1]][k], p[i[2]][k])) + margin;
	}
	*args->bounds_o = (struct RTCBounds){.lower_x = low[0],
					     .lower_y = low[1],
					     .lower_z = low[2],
					     .upper_x = high[0],
					     .upper_y = high[1],
					     .upper_z = high[2]};
}

/* The same tests as in the filter for triangles that Embree intersects; these triangles are never PRIM_NONE. */
static bool wide_root(const struct wide_prims *w, uint32_t prim, const struct ray_query *q, double t_max, double *t)
{
	const struct prim_ref ref = {w->shape_id, prim, q->start_prim.time};
	if (query_is_end(q, ref) ||
	    !(query_may_be_hidden(q, w->shape_id) ? query_crosses_present(q, ref) : query_crosses(q, w->shape, prim)))
		return false;
	const struct triangle k = accel_triangle(w->shape, prim, q->start_prim.time);
	return triangle_intersect(&k, q->o, q->d, t) && *t > q->t_min && *t < t_max;
}

static void wide_intersect(const struct RTCIntersectFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	const struct ray_query *q = (const struct ray_query *)(const void *)args->context;
	const struct wide_prims *w = args->geometryUserPtr;
	uint32_t prim = w->prims[args->primID];
	struct RTCRayHit *rh = (struct RTCRayHit *)(void *)args->rayhit;
	double t;
	if (!wide_root(w, prim, q, (double)rh->ray.tfar - q->origin_lead, &t))
		return;
	rh->ray.tfar = (float)(t + q->origin_lead);
	rh->hit.geomID = w->shape_id;
	rh->hit.primID = prim;
	rh->hit.u = rh->hit.v = 0;
}

static void wide_occluded(const struct RTCOccludedFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	const struct ray_query *q = (const struct ray_query *)(const void *)args->context;
	const struct wide_prims *w = args->geometryUserPtr;
	double t;
	if (wide_root(w, w->prims[args->primID], q, q->is_segment ? 1 : INFINITY, &t))
		((struct RTCRay *)(void *)args->ray)->tfar = -INFINITY;
}

static void curve_bounds(const struct RTCBoundsFunctionArguments *args)
{
	const struct curve_prims *c = args->geometryUserPtr;
	vec3 low, high;
	curves_box(c->curves, args->primID, &low, &high);
	vec3 half = vec3_scale(0.5, vec3_sub(high, low)), center = vec3_add(low, half);
	double distance = triangle_norm_max(center);
	set_bounds(center, half,
		   2 * (c->ray_error + c->ray_error_slope * distance) + 0x1p-20 * (triangle_norm_max(half) + distance),
		   args->bounds_o);
}

static struct curve_ray make_curve_ray(const struct curve_prims *c, const struct ray_query *q, double t_max)
{
	return (struct curve_ray){.o = q->o,
				  .d = q->d,
				  .end = q->end,
				  .starts_on_curve = q->start_surface && q->start_prim.shape == c->shape,
				  .ends_on_curve = q->end_surface && q->end_prim.shape == c->shape,
				  .start_prim = q->start_prim.prim,
				  .end_prim = q->end_prim.prim,
				  .t_min = q->t_min,
				  .t_max = t_max,
				  .culls_backfaces = c->culls_backfaces};
}

/* Hairs are so thin that two crossings may have the same float tfar, so they are compared in double. hit.u and hit.v
 * hold the part and the root, from which surface.h computes the crossing again. */
static void curve_intersect(const struct RTCIntersectFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	struct ray_query *q = (struct ray_query *)(void *)args->context;
	const struct curve_prims *c = args->geometryUserPtr;
	struct RTCRayHit *rh = (struct RTCRayHit *)(void *)args->rayhit;
	bool exact = rh->hit.geomID != RTC_INVALID_GEOMETRY_ID && rh->ray.tfar == q->nearest_tfar;
	struct curve_ray r = make_curve_ray(c, q, exact ? q->nearest_t : (double)rh->ray.tfar - q->origin_lead);
	struct curve_crossing x;
	if (!curves_intersect(c->curves, args->primID, &r, &x))
		return;
	q->nearest_t = x.t;
	q->nearest_tfar = rh->ray.tfar = (float)(x.t + q->origin_lead);
	rh->hit.geomID = c->shape;
	rh->hit.primID = args->primID;
	rh->hit.u = (float)x.part;
	rh->hit.v = (float)x.root;
}

static void curve_occluded(const struct RTCOccludedFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	const struct ray_query *q = (const struct ray_query *)(const void *)args->context;
	const struct curve_prims *c = args->geometryUserPtr;
	struct curve_ray r = make_curve_ray(c, q, q->is_segment ? 1 : INFINITY);
	struct curve_crossing x;
	if (curves_intersect(c->curves, args->primID, &r, &x))
		((struct RTCRay *)(void *)args->ray)->tfar = -INFINITY;
}

const struct embree_ops user_sphere_ops = {sphere_bounds, sphere_intersect, sphere_occluded};
const struct embree_ops user_triangle_ops = {wide_bounds, wide_intersect, wide_occluded};
const struct embree_ops user_curve_ops = {curve_bounds, curve_intersect, curve_occluded};
