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
	struct wide_prims *wide;    /* one entry per shape */
	struct curve_prims *curves; /* one entry per shape */
	struct instances instances;
	atomic_size_t bytes, peak;
	vec3 low, high;
	double size;  /* sum of the sides of the bounding box */
	double reach; /* error bound of Embree's floats, see rounding_reach */
	/* The same bound before the size of the scene is known: off + off_far |p| at p. */
	double off, off_far;
	double detail; /* in a scene of mixed scales, the extent of its smallest shape; otherwise 0 */
};

static bool memory_monitor(void *user, ssize_t bytes, bool post)
{
	(void)post;
	struct accel *a = user;
	size_t now = atomic_fetch_add(&a->bytes, (size_t)bytes) + (size_t)bytes;
	if (now > atomic_load(&a->peak))
		atomic_store(&a->peak, now); /* no race: only one thread builds */
	return true;
}

/* Whether both ends are so high over the triangle's plane that not even Embree's float normal of a tiny distant
 * triangle can be wrong about their sides. For most hits this avoids loading the vertices. */
static bool clearly_crosses(const struct query *q, const struct RTCHit *hit, const struct RTCRay *ray)
{
	vec3 n = {(double)hit->Ng_x, (double)hit->Ng_y, (double)hit->Ng_z};
	double t = (double)ray->tfar - q->back, nearer = q->segment ? fmin(t, 1 - t) : t;
	return fabs(vec3_dot(n, q->d)) * nearer > 0x1p10 * q->reach * triangle_norm1(n);
}

/* Whether a triangle is intersected in double by a user geometry instead (solved.c). */
static bool is_wide(const struct query *q, const struct accel_shape *s, uint32_t prim)
{
	return isfinite(q->wide_from) && (double)triangle_extent(s->position, s->index[prim]) >= q->wide_from;
}

static void filter_triangle(const struct RTCFilterFunctionNArguments *args)
{
	const struct query *q = (const struct query *)(const void *)args->context;
	/* Single rays only (N = 1): accessors of packets exist only in C++. */
	const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
	if (query_is_end(q, (struct prim_ref){hit->geomID, hit->primID, q->from.time}))
		args->valid[0] = 0;
	else if (is_wide(q, args->geometryUserPtr, hit->primID))
		args->valid[0] = 0;
	else if (query_hides(q, hit->geomID)) {
		if (!query_crosses_there(q, (struct prim_ref){hit->geomID, hit->primID, q->from.time}))
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
	RTCGeometry g = embree_triangles(a->device, s);
	if (!g)
		return -ENOMEM;
	rtcSetGeometryUserData(g, s);
	rtcSetGeometryIntersectFilterFunction(g, filter_closest);
	rtcSetGeometryOccludedFilterFunction(g, filter_triangle);
	embree_attach(a->scene, g, id);
	return 0;
}

/* Attaches primitives that we intersect ourselves. */
static int attach_own(struct accel *a, uint32_t id, uint32_t count, void *data, const struct embree_ops *ops)
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
	*prim = (struct sphere_prim){s->center, s->radius, s->place, id};
	return attach_own(a, id, 1, prim, &solved_sphere);
}

static int attach_curves(struct accel *a, const struct accel_shape *s, uint32_t id)
{
	a->curves[id] = (struct curve_prims){s->curves, s->culled, id, a->off, a->off_far};
	return attach_own(a, id, s->curves->count, &a->curves[id], &solved_curves);
}

/* Attaches the shape's triangles with an extent of at least `least`, as a user geometry whose ID
 * follows those of the shapes. */
static int attach_wide(struct accel *a, uint32_t shape_count, uint32_t id, double least)
{
	struct wide_prims *w = &a->wide[id];
	*w = (struct wide_prims){&a->shapes[id], id, 0, NULL};
	if (a->shapes[id].is_sphere || a->shapes[id].place || a->shapes[id].curves)
		return 0;
	for (int pass = 0; pass < 2; pass++) {
		w->count = 0;
		for (uint32_t i = 0; i < w->shape->triangle_count; i++) {
			if (triangle_extent(w->shape->position, w->shape->index[i]) < least)
				continue;
			if (pass)
				w->prim[w->count] = i;
			w->count++;
		}
		if (w->count == 0)
			return 0;
		if (!pass && !(w->prim = mem_alloc(w->count, sizeof *w->prim)))
			return -ENOMEM;
	}
	return attach_own(a, shape_count + id, w->count, w, &solved_triangles);
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
static double rounding_reach(vec3 low, vec3 high)
{
	vec3 m = {fmax(fabs(low.x), fabs(high.x)), fmax(fabs(low.y), fabs(high.y)), fmax(fabs(low.z), fabs(high.z))};
	return 0x1p-21 * fmax(m.x, fmax(m.y, m.z));
}

/* A scene has mixed scales if its smallest shape is so small that float errors of the scene exceed a thousandth of it.
 * Triangles that exceed the smallest shape by this factor are intersected in double. */
#define MIXED 0x1p11

static double extent_of(const struct accel_shape *s)
{
	if (s->is_sphere)
		return 2 * s->radius;
	struct placement room;
	if (accel_is_instance(s))
		return 2 * triangle_norm_max(placement_at(s->place, 0, &room)->half);
	if (s->curves) {
		vec3 low, high;
		curves_box_of_all(s->curves, &low, &high);
		return triangle_norm_max(vec3_sub(high, low));
	}
	float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, most = 0;
	for (uint32_t i = 0; i < s->triangle_count; i++)
		for (int j = 0; j < 3; j++)
			for (int k = 0; k < 3; k++) {
				low[k] = fminf(low[k], s->position[s->index[i][j]][k]);
				high[k] = fmaxf(high[k], s->position[s->index[i][j]][k]);
			}
	for (int k = 0; k < 3; k++)
		most = fmaxf(most, high[k] - low[k]);
	return (double)most;
}

/* Returns rounding_reach of a shape's bounding box. */
static double reach_of(const struct accel_shape *s)
{
	double reach = 0;
	vec3 low, high, r = {s->radius, s->radius, s->radius};
	if (s->place)
		return rounding_reach(vec3_sub(s->place->center, s->place->half),
				      vec3_add(s->place->center, s->place->half));
	if (s->is_sphere)
		return rounding_reach(vec3_sub(s->center, r), vec3_add(s->center, r));
	if (s->curves) {
		curves_box_of_all(s->curves, &low, &high);
		return rounding_reach(low, high);
	}
	for (uint32_t k = 0; k < s->vertex_count; k++) {
		vec3 p = triangle_vertex(s->position, k);
		reach = fmax(reach, rounding_reach(p, p));
	}
	return reach;
}

/* Determines whether the scales are mixed, and the error bound of floats before anything is built. */
static void find_detail(struct accel *a, const struct accel_shape *shapes, uint32_t count)
{
	double least = INFINITY, reach = 0;
	for (uint32_t i = 0; i < count; i++) {
		least = fmin(least, extent_of(&shapes[i]));
		reach = fmax(reach, reach_of(&shapes[i]));
	}
	a->detail = MIXED * least < 0x1p21 * reach ? least : 0;
	/* the bound of reach_at */
	a->off = a->detail == 0 ? reach : 0x1p-21 * MIXED * a->detail + 0x1p-26 * reach;
	a->off_far = a->detail == 0 ? 0 : 0x1p-21;
}

/* A sphere is either hidden entirely or not at all. */
static int attach_shape(struct accel *a, uint32_t count, uint32_t id)
{
	if (accel_is_instance(&a->shapes[id]))
		return 0;
	if (a->shapes[id].is_sphere && !a->shapes[id].place &&
	    coincide_there(a->coincidence, a->shapes, (struct prim_ref){id, 0, 0}, a->shapes[id].center).shape != id)
		return 0;
	struct accel_shape *s = &a->shapes[id];
	int rc = s->curves	? attach_curves(a, s, id)
		 : s->is_sphere ? attach_sphere(a, s, id)
				: attach_triangles(a, s, id);
	return rc || a->detail == 0 ? rc : attach_wide(a, count, id, MIXED * a->detail);
}

/* The ID of the geometry follows those of the shapes and of their user geometries. */
static int attach_instances(struct accel *a, uint32_t count)
{
	struct instances *s = &a->instances;
	int rc = instances_init(s, a->device, a->shapes, count);
	if (rc || s->count == 0)
		return rc;
	s->off = a->off;
	s->off_far = a->off_far;
	return attach_own(a, 2 * count, s->count, s, &instances_ops);
}

static int build(struct accel *a, const struct accel_shape *shapes, uint32_t count, struct error *e)
{
	a->device = rtcNewDevice(has_avx2() ? "threads=1,isa=avx2" : "threads=1");
	if (!a->device)
		return rtcGetDeviceError(NULL) == RTC_ERROR_UNSUPPORTED_CPU
			       ? error_set(e, ENOTSUP, "Embree does not support this processor")
			       : error_set(e, ENOMEM, "no memory for Embree's device");
	rtcSetDeviceMemoryMonitorFunction(a->device, memory_monitor, a);
	a->scene = embree_scene(a->device);
	if (!a->scene)
		return error_set(e, ENOMEM, "Embree's scene cannot be created");
	find_detail(a, shapes, count);
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
	embree_bounds(a->scene, &a->low, &a->high);
	a->size = a->high.x - a->low.x + a->high.y - a->low.y + a->high.z - a->low.z;
	a->reach = rounding_reach(a->low, a->high);
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
	a->wide = mem_alloc(count, sizeof *a->wide);
	a->curves = mem_alloc(count, sizeof *a->curves);
	a->count = count;
	a->coincidence = c;
	unsigned trap = fptrap_leave();
	bool room = a->spheres && a->shapes && a->wide && a->curves;
	int rc = room ? build(a, shapes, count, e) : error_set(e, ENOMEM, "out of memory");
	fptrap_return(trap);
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
	unsigned trap = fptrap_leave();
	if (a->scene)
		rtcReleaseScene(a->scene);
	instances_fini(&a->instances);
	if (a->device)
		rtcReleaseDevice(a->device);
	fptrap_return(trap);
	for (uint32_t i = 0; a->wide && i < a->count; i++)
		mem_free(a->wide[i].prim);
	mem_free(a->wide);
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
	return atomic_load(&a->peak);
}

/* Rays from far outside enter the scene's box in double, so that Embree's floats never have to represent the distance.
 * Returns the distance to the box in units of |d|. */
static double entry_distance(const struct accel *a, vec3 o, vec3 d)
{
	double size = a->size;
	if (o.x >= a->low.x - size && o.y >= a->low.y - size && o.z >= a->low.z - size && o.x <= a->high.x + size &&
	    o.y <= a->high.y + size && o.z <= a->high.z + size)
		return 0;
	const double lo[3] = {a->low.x, a->low.y, a->low.z}, hi[3] = {a->high.x, a->high.y, a->high.z};
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
static double reach_at(const struct accel *a, vec3 p)
{
	if (a->detail == 0)
		return a->reach;
	return 0x1p-21 * (triangle_norm_max(p) + MIXED * a->detail) + 0x1p-50 * a->size;
}

/* Returns where the part of the ray that starts at o + t0 d ends, in units of d. A float ray deviates in
 * proportion to the distance of its start from the origin, which is too much for objects much closer to the
 * origin: a new ray starts there. */
static double part_end(const struct accel *a, vec3 o, vec3 d, double t0, double t_max)
{
	if (a->detail == 0)
		return t_max;
	vec3 p = vec3_madd(o, t0, d);
	double from2 = vec3_dot(p, p), d2 = vec3_dot(d, d), to_nearest = -vec3_dot(p, d) / d2;
	double next2 = from2 * 0x1p-8, left2 = next2 - (from2 - to_nearest * to_nearest * d2);
	if (from2 <= 0x1p16 * a->detail * a->detail || to_nearest <= 0 || left2 <= 0)
		return t_max;
	return fmin(t0 + to_nearest - sqrt(left2 / d2), t_max);
}

/* Lifts p off its surface, to the side into which d leaves. */
static vec3 lift_off_surface(const struct accel *a, vec3 p, vec3 ng, vec3 d)
{
	return vec3_madd(p, copysign(reach_at(a, p), vec3_dot(ng, d)), ng);
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

static struct query query_of(const struct accel *a, vec3 o, vec3 d)
{
	return (struct query){.o = o,
			      .d = d,
			      .from = PRIM_NONE,
			      .to = PRIM_NONE,
			      .low = 1,
			      .beyond = 1,
			      .wide_from = a->detail == 0 ? INFINITY : MIXED * a->detail,
			      .coincidence = a->coincidence,
			      .shapes = a->shapes,
			      .nearest_far = -1};
}

/* Whether the end is on a surface at a point where another surface hides it. */
static bool is_hidden(const struct accel *a, const struct ray_end *end)
{
	if (!a->coincidence || end->prim.shape == PRIM_NONE.shape)
		return false;
	struct prim_ref there = coincide_there(a->coincidence, a->shapes, end->prim, end->p);
	return there.shape != end->prim.shape || there.prim != end->prim.prim;
}

/* Fills in Embree's ray for the part from t0 to t1. It runs beside the true ray, and starts earlier and ends later by
 * the error bound of floats: beside, so that a grazing ray does not slip past the edge of the triangle that it leaves,
 * which is filtered out; earlier and later, so that nothing near the ends is lost. The callbacks reject, in double,
 * everything that the true ray does not hit between its ends. */
static void fill_ray(const struct accel *a, struct RTCRay *ray, struct query *q, double t_min, vec3 o, vec3 d,
		     double t0, double t1)
{
	q->reach = reach_at(a, vec3_madd(q->o, t0, q->d));
	/* A shorter segment cannot be represented as a float ray. */
	double unit = q->segment ? fmax(vec3_length(q->d), q->reach * 0x1p-20) : 1;
	q->before = q->reach * q->low / unit;
	q->back = q->before - t0;
	q->t_min = t0 > 0 ? fmax(t_min, -q->back) : t_min;
	o = vec3_madd(o, -q->back, d);
	*ray = (struct RTCRay){.org_x = (float)o.x,
			       .org_y = (float)o.y,
			       .org_z = (float)o.z,
			       .tnear = q->t_min > 0 ? (float)(q->t_min + q->back) : 0,
			       .dir_x = (float)d.x,
			       .dir_y = (float)d.y,
			       .dir_z = (float)d.z,
			       .tfar = (float)fmin(t1 + q->before + q->reach * q->beyond / unit - t0, (double)FLT_MAX),
			       .mask = 0xFFFFFFFFu};
	check_ray(ray);
}

static bool trace_closest(const struct accel *a, struct query *q, struct RTCRayHit *rh, vec3 o, double t_min,
			  double t_max)
{
	double t0 = 0, t1 = 0;
	do {
		t0 = t1;
		t1 = part_end(a, q->o, q->d, t0, t_max);
		fill_ray(a, &rh->ray, q, t_min, o, q->d, t0, t1);
		rh->hit.geomID = rh->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
		unsigned trap = fptrap_leave();
		EMBREE_INIT_CONTEXT(&q->context);
		embree_intersect(a->scene, &q->context, rh);
		fptrap_return(trap);
	} while (t1 < t_max && rh->hit.geomID == RTC_INVALID_GEOMETRY_ID);
	return rh->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

bool accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max,
		   struct ray_hit *hit)
{
	double enter = entry_distance(a, from->p, d);
	if (enter >= t_max || is_hidden(a, from))
		return false;
	struct query q = query_of(a, vec3_madd(from->p, enter, d), d);
	q.from = from->prim;
	q.start = enter > 0 ? NULL : from;
	q.low = enter > 0 ? 1 : query_lowness(from->ng, d);
	struct RTCRayHit rh;
	if (!trace_closest(a, &q, &rh, lift_off_surface(a, q.o, from->ng, d), fmax(t_min - enter, 0), t_max - enter))
		return false;
	double t = enter + fmax((double)rh.ray.tfar - q.back, 0);
	*hit = (struct ray_hit){query_there(&q, (struct prim_ref){rh.hit.geomID, rh.hit.primID, q.from.time}), t,
				(double)rh.hit.u, (double)rh.hit.v};
	return true;
}

static bool occluded(const struct accel *a, struct query *q, vec3 o, vec3 d, double t_max)
{
	bool met = false;
	double t0 = 0, t1 = 0;
	do {
		struct RTCRay ray;
		t0 = t1;
		t1 = part_end(a, q->o, q->d, t0, t_max);
		fill_ray(a, &ray, q, 0, o, d, t0, t1);
		unsigned trap = fptrap_leave();
		EMBREE_INIT_CONTEXT(&q->context);
		embree_occluded(a->scene, &q->context, &ray);
		fptrap_return(trap);
		met = ray.tfar < 0;
	} while (t1 < t_max && !met);
	return met;
}

bool accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to)
{
	/* Trace from the end nearer to the origin, where floats are more precise. */
	if (a->detail > 0 && triangle_norm_max(to->p) < triangle_norm_max(from->p)) {
		const struct ray_end *other = from;
		from = to;
		to = other;
	}
	vec3 d = vec3_sub(to->p, from->p);
	double enter = entry_distance(a, from->p, d);
	if (is_hidden(a, from) || is_hidden(a, to))
		return true;
	if (enter >= 1)
		return false;
	struct query q = query_of(a, vec3_madd(from->p, enter, d), vec3_scale(1 - enter, d));
	q.from = from->prim;
	q.to = to->prim;
	q.start = enter > 0 ? NULL : from;
	q.finish = to;
	q.end = to->p;
	q.segment = true;
	q.low = enter > 0 ? 1 : query_lowness(from->ng, d);
	q.beyond = query_lowness(to->ng, d);
	if (!(vec3_length(q.d) > 0))
		return false;
	vec3 o = lift_off_surface(a, q.o, from->ng, d), end = lift_off_surface(a, to->p, to->ng, vec3_neg(d));
	return occluded(a, &q, o, vec3_sub(end, o), 1);
}

bool accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d)
{
	if (is_hidden(a, from))
		return true;
	struct query q = query_of(a, from->p, d);
	q.from = from->prim;
	q.start = from;
	q.low = query_lowness(from->ng, d);
	return occluded(a, &q, lift_off_surface(a, from->p, from->ng, d), d, INFINITY);
}
