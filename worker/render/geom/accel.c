/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tracing rays with Embree, with hits decided in double.
 *
 * To build, triangles, spheres and curves become Embree geometries, with filters where a hit must be checked in double;
 * large triangles of a scene of mixed scales become a user geometry that is intersected in double. To trace, the ray
 * enters the scene's box in double, Embree proposes hits in float, the filter accepts or rejects them, and the caller
 * computes the hit again (surface.h).
 *
 * Only building can fail: out of memory, or with an error that Embree reports. Tracing never returns an error; a ray
 * that is not finite is a fault (worker/render/math/fptrap.h).
 */
#include "worker/render/geom/accel.h"

#include "common/base/mem.h"
#include "worker/render/geom/instances.h"
#include "worker/render/math/fptrap.h"

#include <float.h>
#include <stdatomic.h>
#include <sys/types.h>

struct accel {
	RTCDevice device;
	RTCScene scene;
	uint32_t count, sphere_count;
	struct sphere_prim *spheres;
	struct accel_shape *shapes;
	const struct coincidence *coincidence;
	struct wide_prims *wide_prims; /* one entry per shape */
	struct curve_prims *curves;    /* one entry per shape */
	struct instances instances;
	atomic_size_t bytes, peak_bytes;
	vec3 box_min, box_max;
	double side_sum;    /* of the bounding box */
	double float_error; /* error bound of Embree's floats, see float_error_in_box */
	/* The same bound before the size of the scene is known: ray_error + ray_error_slope |p| at p. */
	double ray_error, ray_error_slope;
	double smallest_extent; /* in a scene of mixed scales, the extent of its smallest shape; otherwise 0 */
};

static bool memory_monitor(void *user, ssize_t bytes, bool post)
{
	(void)post;
	struct accel *a = user;
	size_t total = atomic_fetch_add(&a->bytes, (size_t)bytes) + (size_t)bytes;
	if (total > atomic_load(&a->peak_bytes))
		atomic_store(&a->peak_bytes, total); /* no race: only one thread builds */
	return true;
}

/* Whether both ends are so high over the triangle's plane that not even Embree's float normal of a tiny distant
 * triangle can be wrong about their sides. For most hits this avoids loading the vertices. */
static bool clearly_crosses(const struct ray_query *q, const struct RTCHit *hit, const struct RTCRay *ray)
{
	vec3 n = {(double)hit->Ng_x, (double)hit->Ng_y, (double)hit->Ng_z};
	double t = (double)ray->tfar - q->origin_lead, nearer = q->is_segment ? fmin(t, 1 - t) : t;
	return fabs(vec3_dot(n, q->d)) * nearer > 0x1p10 * q->float_error * triangle_norm1(n);
}

/* Whether a triangle is intersected in double by a user geometry instead (user_geometry.c). */
static bool is_wide(const struct ray_query *q, const struct accel_shape *s, uint32_t prim)
{
	return isfinite(q->min_wide_extent) &&
	       (double)triangle_extent(s->position, s->index[prim]) >= q->min_wide_extent;
}

static void filter_triangle(const struct RTCFilterFunctionNArguments *args)
{
	const struct ray_query *q = (const struct ray_query *)(const void *)args->context;
	/* Single rays only (N = 1): accessors of packets exist only in C++. */
	const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
	if (query_is_end(q, (struct prim_ref){hit->geomID, hit->primID, q->start_prim.time}))
		args->valid[0] = 0;
	else if (is_wide(q, args->geometryUserPtr, hit->primID))
		args->valid[0] = 0;
	else if (query_may_be_hidden(q, hit->geomID)) {
		if (!query_crosses_present(q, (struct prim_ref){hit->geomID, hit->primID, q->start_prim.time}))
			args->valid[0] = 0;
	} else if (!clearly_crosses(q, hit, (const struct RTCRay *)(const void *)args->ray) &&
		   !query_crosses(q, args->geometryUserPtr, hit->primID))
		args->valid[0] = 0;
}

/* The final hit is one of those that pass this filter, so it prefetches its vertices while Embree continues. */
static void filter_closest(const struct RTCFilterFunctionNArguments *args)
{
	const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
	const struct accel_shape *s = args->geometryUserPtr;
	const uint32_t *i = s->index[hit->primID];
	for (int k = 0; k < 3; k++)
		__builtin_prefetch(s->position[i[k]]);
	filter_triangle(args);
}

static int attach_triangles(struct accel *a, struct accel_shape *s, uint32_t id)
{
	RTCGeometry g = embree_new_triangles(a->device, s);
	if (!g)
		return -ENOMEM;
	rtcSetGeometryUserData(g, s);
	rtcSetGeometryIntersectFilterFunction(g, filter_closest);
	rtcSetGeometryOccludedFilterFunction(g, filter_triangle);
	embree_attach(a->scene, g, id);
	return 0;
}

/* Attaches primitives that we intersect ourselves. */
static int attach_user_geometry(struct accel *a, uint32_t id, uint32_t count, void *data, const struct embree_ops *ops)
{
	RTCGeometry g = rtcNewGeometry(a->device, RTC_GEOMETRY_TYPE_USER);
	if (!g)
		return -ENOMEM;
	rtcSetGeometryUserPrimitiveCount(g, count);
	rtcSetGeometryUserData(g, data);
	rtcSetGeometryBoundsFunction(g, ops->bounds, NULL);
	rtcSetGeometryIntersectFunction(g, ops->intersect);
	rtcSetGeometryOccludedFunction(g, ops->occluded);
	embree_attach(a->scene, g, id);
	return 0;
}

static int attach_sphere(struct accel *a, const struct accel_shape *s, uint32_t id)
{
	struct sphere_prim *prim = &a->spheres[a->sphere_count++];
	*prim = (struct sphere_prim){s->center, s->radius, s->placement, id};
	return attach_user_geometry(a, id, 1, prim, &user_sphere_ops);
}

static int attach_curves(struct accel *a, const struct accel_shape *s, uint32_t id)
{
	a->curves[id] = (struct curve_prims){s->curves, s->culls_backfaces, id, a->ray_error, a->ray_error_slope};
	return attach_user_geometry(a, id, s->curves->count, &a->curves[id], &user_curve_ops);
}

/* Attaches the shape's triangles with an extent of at least `min_extent`, as a user geometry whose ID
 * follows those of the shapes. */
static int attach_wide(struct accel *a, uint32_t shape_count, uint32_t id, double min_extent)
{
	struct wide_prims *w = &a->wide_prims[id];
	*w = (struct wide_prims){&a->shapes[id], id, 0, NULL};
	if (a->shapes[id].is_sphere || a->shapes[id].placement || a->shapes[id].curves)
		return 0;
	for (int pass = 0; pass < 2; pass++) {
		w->count = 0;
		for (uint32_t i = 0; i < w->shape->triangle_count; i++) {
			if (triangle_extent(w->shape->position, w->shape->index[i]) < min_extent)
				continue;
			if (pass)
				w->prims[w->count] = i;
			w->count++;
		}
		if (w->count == 0)
			return 0;
		if (!pass && !(w->prims = mem_alloc(w->count, sizeof *w->prims)))
			return -ENOMEM;
	}
	return attach_user_geometry(a, shape_count + id, w->count, w, &user_triangle_ops);
}

/* Embree uses AVX2 on all machines that have it, so that all workers of a mixed farm get the same bits. */
static bool has_avx2(void)
{
#if defined(__x86_64__)
	return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
	return false;
#endif
}

const char *accel_version(void)
{
#define TEXT_(x) #x
#define TEXT(x) TEXT_(x)
#define EMBREE_TEXT "embree " TEXT(RTC_VERSION_MAJOR) "." TEXT(RTC_VERSION_MINOR) "." TEXT(RTC_VERSION_PATCH)
	return has_avx2() ? EMBREE_TEXT " avx2" : EMBREE_TEXT " native";
}

static int embree_failure(RTCDevice device, struct error *e)
{
	enum RTCError code = rtcGetDeviceError(device);
	if (code == RTC_ERROR_NONE)
		return 0;
	return error_set(e, code == RTC_ERROR_OUT_OF_MEMORY ? ENOMEM : EIO, "Embree reports error %d while building",
			 (int)code);
}

/* Returns the error bound of a float point and of Embree's robust test, for vertices anywhere in the box: half a unit
 * in the last place of each coordinate for the point, as much again for the differences, times four. */
static double float_error_in_box(vec3 low, vec3 high)
{
	vec3 m = {fmax(fabs(low.x), fabs(high.x)), fmax(fabs(low.y), fabs(high.y)), fmax(fabs(low.z), fabs(high.z))};
	return 0x1p-21 * fmax(m.x, fmax(m.y, m.z));
}

/* A scene has mixed scales if its smallest shape is so small that float errors of the scene exceed a thousandth of it.
 * Triangles that exceed the smallest shape by this factor are intersected in double. */
#define MIXED_SCALES_RATIO 0x1p11

static double shape_extent(const struct accel_shape *s)
{
	if (s->is_sphere)
		return 2 * s->radius;
	struct placement storage;
	if (accel_is_instance(s))
		return 2 * triangle_norm_max(placement_at(s->placement, 0, &storage)->half);
	if (s->curves) {
		vec3 low, high;
		curves_bounds(s->curves, &low, &high);
		return triangle_norm_max(vec3_sub(high, low));
	}
	float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, max_extent = 0;
	for (uint32_t i = 0; i < s->triangle_count; i++)
		for (int j = 0; j < 3; j++)
			for (int k = 0; k < 3; k++) {
				low[k] = fminf(low[k], s->position[s->index[i][j]][k]);
				high[k] = fmaxf(high[k], s->position[s->index[i][j]][k]);
			}
	for (int k = 0; k < 3; k++)
		max_extent = fmaxf(max_extent, high[k] - low[k]);
	return (double)max_extent;
}

/* Returns float_error_in_box of a shape's bounding box. */
static double shape_float_error(const struct accel_shape *s)
{
	double error = 0;
	vec3 low, high, r = {s->radius, s->radius, s->radius};
	if (s->placement)
		return float_error_in_box(vec3_sub(s->placement->center, s->placement->half),
					  vec3_add(s->placement->center, s->placement->half));
	if (s->is_sphere)
		return float_error_in_box(vec3_sub(s->center, r), vec3_add(s->center, r));
	if (s->curves) {
		curves_bounds(s->curves, &low, &high);
		return float_error_in_box(low, high);
	}
	for (uint32_t k = 0; k < s->vertex_count; k++) {
		vec3 p = triangle_vertex(s->position, k);
		error = fmax(error, float_error_in_box(p, p));
	}
	return error;
}

/* Determines whether the scales are mixed, and the error bound of floats before anything is built. */
static void find_scales(struct accel *a, const struct accel_shape *shapes, uint32_t count)
{
	double smallest = INFINITY, error = 0;
	for (uint32_t i = 0; i < count; i++) {
		smallest = fmin(smallest, shape_extent(&shapes[i]));
		error = fmax(error, shape_float_error(&shapes[i]));
	}
	a->smallest_extent = MIXED_SCALES_RATIO * smallest < 0x1p21 * error ? smallest : 0;
	/* the bound of float_error_at */
	a->ray_error =
		a->smallest_extent == 0 ? error : 0x1p-21 * MIXED_SCALES_RATIO * a->smallest_extent + 0x1p-26 * error;
	a->ray_error_slope = a->smallest_extent == 0 ? 0 : 0x1p-21;
}

/* A sphere is either hidden entirely or not at all. */
static int attach_shape(struct accel *a, uint32_t count, uint32_t id)
{
	if (accel_is_instance(&a->shapes[id]))
		return 0;
	if (a->shapes[id].is_sphere && !a->shapes[id].placement &&
	    coincide_present_prim(a->coincidence, a->shapes, (struct prim_ref){id, 0, 0}, a->shapes[id].center).shape !=
		    id)
		return 0;
	struct accel_shape *s = &a->shapes[id];
	int rc = s->curves	? attach_curves(a, s, id)
		 : s->is_sphere ? attach_sphere(a, s, id)
				: attach_triangles(a, s, id);
	return rc || a->smallest_extent == 0 ? rc : attach_wide(a, count, id, MIXED_SCALES_RATIO * a->smallest_extent);
}

/* The ID of the geometry follows those of the shapes and of their user geometries. */
static int attach_instances(struct accel *a, uint32_t count)
{
	struct instances *s = &a->instances;
	int rc = instances_init(s, a->device, a->shapes, count);
	if (rc || s->count == 0)
		return rc;
	s->ray_error = a->ray_error;
	s->ray_error_slope = a->ray_error_slope;
	return attach_user_geometry(a, 2 * count, s->count, s, &instances_ops);
}

static int build(struct accel *a, const struct accel_shape *shapes, uint32_t count, struct error *e)
{
	a->device = rtcNewDevice(has_avx2() ? "threads=1,isa=avx2" : "threads=1");
	if (!a->device)
		return rtcGetDeviceError(NULL) == RTC_ERROR_UNSUPPORTED_CPU
			       ? error_set(e, ENOTSUP, "Embree does not support this processor")
			       : error_set(e, ENOMEM, "no memory for Embree's device");
	rtcSetDeviceMemoryMonitorFunction(a->device, memory_monitor, a);
	a->scene = embree_new_scene(a->device);
	if (!a->scene)
		return error_set(e, ENOMEM, "Embree's scene cannot be created");
	find_scales(a, shapes, count);
	for (uint32_t i = 0; i < count; i++)
		a->shapes[i] = shapes[i];
	for (uint32_t i = 0; i < count; i++) {
		int rc = attach_shape(a, count, i);
		if (rc)
			return error_set(e, -rc, "Embree's geometry cannot be created");
	}
	int rc = attach_instances(a, count);
	if (rc)
		return error_set(e, -rc, "Embree's tree of a mesh cannot be created");
	embree_build(a->scene);
	rc = embree_failure(a->device, e);
	if (rc || count == 0)
		return rc;
	embree_bounds(a->scene, &a->box_min, &a->box_max);
	a->side_sum = a->box_max.x - a->box_min.x + a->box_max.y - a->box_min.y + a->box_max.z - a->box_min.z;
	a->float_error = float_error_in_box(a->box_min, a->box_max);
	return 0;
}

int accel_new(struct accel **out, const struct accel_shape *shapes, uint32_t count, const struct coincidence *c,
	      struct error *e)
{
	*out = NULL;
	struct accel *a = mem_alloc(1, sizeof *a);
	if (!a)
		return error_set(e, ENOMEM, "out of memory");
	a->spheres = mem_alloc(count, sizeof *a->spheres);
	a->shapes = mem_alloc(count, sizeof *a->shapes);
	a->wide_prims = mem_alloc(count, sizeof *a->wide_prims);
	a->curves = mem_alloc(count, sizeof *a->curves);
	a->count = count;
	a->coincidence = c;
	unsigned flags = fptrap_enter_library();
	bool is_allocated = a->spheres && a->shapes && a->wide_prims && a->curves;
	int rc = is_allocated ? build(a, shapes, count, e) : error_set(e, ENOMEM, "out of memory");
	fptrap_leave_library(flags);
	if (rc)
		accel_free(a);
	else
		*out = a;
	return rc;
}

void accel_free(struct accel *a)
{
	if (!a)
		return;
	unsigned flags = fptrap_enter_library();
	if (a->scene)
		rtcReleaseScene(a->scene);
	instances_fini(&a->instances);
	if (a->device)
		rtcReleaseDevice(a->device);
	fptrap_leave_library(flags);
	for (uint32_t i = 0; a->wide_prims && i < a->count; i++)
		mem_free(a->wide_prims[i].prims);
	mem_free(a->wide_prims);
	mem_free(a->curves);
	mem_free(a->spheres);
	mem_free(a->shapes);
	mem_free(a);
}

size_t accel_bytes(const struct accel *a)
{
	return atomic_load(&a->bytes);
}

size_t accel_peak_bytes(const struct accel *a)
{
	return atomic_load(&a->peak_bytes);
}

/* Rays from far outside enter the scene's box in double, so that Embree's floats never have to represent the distance.
 * Returns the distance to the box in units of |d|. */
static double entry_distance(const struct accel *a, vec3 o, vec3 d)
{
	double size = a->side_sum;
	if (o.x >= a->box_min.x - size && o.y >= a->box_min.y - size && o.z >= a->box_min.z - size &&
	    o.x <= a->box_max.x + size && o.y <= a->box_max.y + size && o.z <= a->box_max.z + size)
		return 0;
	const double lo[3] = {a->box_min.x, a->box_min.y, a->box_min.z},
		     hi[3] = {a->box_max.x, a->box_max.y, a->box_max.z};
	const double p[3] = {o.x, o.y, o.z}, w[3] = {d.x, d.y, d.z};
	double enter = 0;
	for (int i = 0; i < 3; i++) {
		double outside = w[i] > 0 ? lo[i] - size - p[i] : p[i] - hi[i] - size;
		if (outside > 0 && fabs(w[i]) * 0x1p60 > outside)
			enter = fmax(enter, outside / fabs(w[i]));
	}
	return enter;
}

/* Returns the float error bound of a ray at p. With mixed scales it does not depend on the size of the scene but on p,
 * on the triangles that Embree intersects, and on the rounding of p itself on a triangle as large as the scene. */
static double float_error_at(const struct accel *a, vec3 p)
{
	if (a->smallest_extent == 0)
		return a->float_error;
	return 0x1p-21 * (triangle_norm_max(p) + MIXED_SCALES_RATIO * a->smallest_extent) + 0x1p-50 * a->side_sum;
}

/* Returns where the part of the ray that starts at o + t0 d ends, in units of d. A float ray deviates in
 * proportion to the distance of its start from the origin, which is too much for objects much closer to the
 * origin: a new ray starts there. */
static double ray_part_end(const struct accel *a, vec3 o, vec3 d, double t0, double t_max)
{
	if (a->smallest_extent == 0)
		return t_max;
	vec3 p = vec3_madd(o, t0, d);
	double from2 = vec3_dot(p, p), d2 = vec3_dot(d, d), to_nearest = -vec3_dot(p, d) / d2;
	double next2 = from2 * 0x1p-8, left2 = next2 - (from2 - to_nearest * to_nearest * d2);
	if (from2 <= 0x1p16 * a->smallest_extent * a->smallest_extent || to_nearest <= 0 || left2 <= 0)
		return t_max;
	return fmin(t0 + to_nearest - sqrt(left2 / d2), t_max);
}

/* Lifts p off its surface, to the side into which d leaves. */
static vec3 lift_off_surface(const struct accel *a, vec3 p, vec3 ng, vec3 d)
{
	return vec3_madd(p, copysign(float_error_at(a, p), vec3_dot(ng, d)), ng);
}

/* Traps if the ray is not finite or so long (about 1.8e18, FLT_LARGE) that Embree would abort. NaN fails the test,
 * too. */
static void check_ray(const struct RTCRay *r)
{
	float sum = fabsf(r->org_x) + fabsf(r->org_y) + fabsf(r->org_z) + fabsf(r->dir_x) + fabsf(r->dir_y) +
		    fabsf(r->dir_z);
	if (!(sum < 1e18f))
		fptrap_fault();
}

static struct ray_query make_query(const struct accel *a, vec3 o, vec3 d)
{
	return (struct ray_query){.o = o,
				  .d = d,
				  .start_prim = PRIM_NONE,
				  .end_prim = PRIM_NONE,
				  .start_grazing = 1,
				  .end_grazing = 1,
				  .min_wide_extent =
					  a->smallest_extent == 0 ? INFINITY : MIXED_SCALES_RATIO * a->smallest_extent,
				  .coincidence = a->coincidence,
				  .shapes = a->shapes,
				  .nearest_tfar = -1};
}

/* Whether the end is on a surface at a point where another surface hides it. */
static bool end_is_hidden(const struct accel *a, const struct ray_end *end)
{
	if (!a->coincidence || end->prim.shape == PRIM_NONE.shape)
		return false;
	struct prim_ref present = coincide_present_prim(a->coincidence, a->shapes, end->prim, end->p);
	return present.shape != end->prim.shape || present.prim != end->prim.prim;
}

/* Fills in Embree's ray for the part from t0 to t1. It runs beside the true ray, and starts earlier and ends later by
 * the error bound of floats: beside, so that a grazing ray does not slip past the edge of the triangle that it leaves,
 * which is filtered out; earlier and later, so that nothing near the ends is lost. The callbacks reject, in double,
 * everything that the true ray does not hit between its ends. */
static void fill_ray(const struct accel *a, struct RTCRay *ray, struct ray_query *q, double t_min, vec3 o, vec3 d,
		     double t0, double t1)
{
	q->float_error = float_error_at(a, vec3_madd(q->o, t0, q->d));
	/* A shorter segment cannot be represented as a float ray. */
	double unit = q->is_segment ? fmax(vec3_length(q->d), q->float_error * 0x1p-20) : 1;
	q->part_lead = q->float_error * q->start_grazing / unit;
	q->origin_lead = q->part_lead - t0;
	q->t_min = t0 > 0 ? fmax(t_min, -q->origin_lead) : t_min;
	o = vec3_madd(o, -q->origin_lead, d);
	*ray = (struct RTCRay){
		.org_x = (float)o.x,
		.org_y = (float)o.y,
		.org_z = (float)o.z,
		.tnear = q->t_min > 0 ? (float)(q->t_min + q->origin_lead) : 0,
		.dir_x = (float)d.x,
		.dir_y = (float)d.y,
		.dir_z = (float)d.z,
		.tfar = (float)fmin(t1 + q->part_lead + q->float_error * q->end_grazing / unit - t0, (double)FLT_MAX),
		.mask = 0xFFFFFFFFu};
	check_ray(ray);
}

static bool trace_closest(const struct accel *a, struct ray_query *q, struct RTCRayHit *rh, vec3 o, double t_min,
			  double t_max)
{
	double t0 = 0, t1 = 0;
	do {
		t0 = t1;
		t1 = ray_part_end(a, q->o, q->d, t0, t_max);
		fill_ray(a, &rh->ray, q, t_min, o, q->d, t0, t1);
		rh->hit.geomID = rh->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
		unsigned flags = fptrap_enter_library();
		EMBREE_INIT_CONTEXT(&q->context);
		embree_intersect(a->scene, &q->context, rh);
		fptrap_leave_library(flags);
	} while (t1 < t_max && rh->hit.geomID == RTC_INVALID_GEOMETRY_ID);
	return rh->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

bool accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max,
		   struct ray_hit *hit)
{
	double enter = entry_distance(a, from->p, d);
	if (enter >= t_max || end_is_hidden(a, from))
		return false;
	struct ray_query q = make_query(a, vec3_madd(from->p, enter, d), d);
	q.start_prim = from->prim;
	q.start_surface = enter > 0 ? NULL : from;
	q.start_grazing = enter > 0 ? 1 : query_grazing_factor(from->ng, d);
	struct RTCRayHit rh;
	if (!trace_closest(a, &q, &rh, lift_off_surface(a, q.o, from->ng, d), fmax(t_min - enter, 0), t_max - enter))
		return false;
	double t = enter + fmax((double)rh.ray.tfar - q.origin_lead, 0);
	*hit = (struct ray_hit){
		query_present_prim(&q, (struct prim_ref){rh.hit.geomID, rh.hit.primID, q.start_prim.time}), t,
		(double)rh.hit.u, (double)rh.hit.v};
	return true;
}

static bool trace_occluded(const struct accel *a, struct ray_query *q, vec3 o, vec3 d, double t_max)
{
	bool hit = false;
	double t0 = 0, t1 = 0;
	do {
		struct RTCRay ray;
		t0 = t1;
		t1 = ray_part_end(a, q->o, q->d, t0, t_max);
		fill_ray(a, &ray, q, 0, o, d, t0, t1);
		unsigned flags = fptrap_enter_library();
		EMBREE_INIT_CONTEXT(&q->context);
		embree_occluded(a->scene, &q->context, &ray);
		fptrap_leave_library(flags);
		hit = ray.tfar < 0;
	} while (t1 < t_max && !hit);
	return hit;
}

bool accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to)
{
	/* Trace from the end nearer to the origin, where floats are more precise. */
	if (a->smallest_extent > 0 && triangle_norm_max(to->p) < triangle_norm_max(from->p)) {
		const struct ray_end *other = from;
		from = to;
		to = other;
	}
	vec3 d = vec3_sub(to->p, from->p);
	double enter = entry_distance(a, from->p, d);
	if (end_is_hidden(a, from) || end_is_hidden(a, to))
		return true;
	if (enter >= 1)
		return false;
	struct ray_query q = make_query(a, vec3_madd(from->p, enter, d), vec3_scale(1 - enter, d));
	q.start_prim = from->prim;
	q.end_prim = to->prim;
	q.start_surface = enter > 0 ? NULL : from;
	q.end_surface = to;
	q.end = to->p;
	q.is_segment = true;
	q.start_grazing = enter > 0 ? 1 : query_grazing_factor(from->ng, d);
	q.end_grazing = query_grazing_factor(to->ng, d);
	if (!(vec3_length(q.d) > 0))
		return false;
	vec3 o = lift_off_surface(a, q.o, from->ng, d), end = lift_off_surface(a, to->p, to->ng, vec3_neg(d));
	return trace_occluded(a, &q, o, vec3_sub(end, o), 1);
}

bool accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d)
{
	if (end_is_hidden(a, from))
		return true;
	struct ray_query q = make_query(a, from->p, d);
	q.start_prim = from->prim;
	q.start_surface = from;
	q.start_grazing = query_grazing_factor(from->ng, d);
	return trace_occluded(a, &q, lift_off_surface(a, from->p, from->ng, d), d, INFINITY);
}
