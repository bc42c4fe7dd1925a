#include "worker/geom/accel.h"

#include "common/base/mem.h"
#include "common/base/tick.h"
#include "worker/geom/embree.h"
#include "worker/math/fptrap.h"

#include <float.h>
#include <stdatomic.h>
#include <stdio.h>
#include <sys/types.h>

struct sphere_prim {
	vec3 center;
	double radius;
	uint32_t shape;
};

struct accel {
	RTCDevice device;
	RTCScene scene;
	uint32_t sphere_count;
	struct sphere_prim *spheres;
	struct accel_shape *shapes;
	atomic_size_t bytes, peak;
	vec3 low, high;
	double size; /* sum of the sides */
	double reach; /* how far Embree's floats can be off, see below */
};

/* What a query carries into Embree's callbacks. */
struct query {
	embree_context context;
	vec3 o, d, end; /* in double: what Embree proposes is judged by these; end: o + d for a segment */
	bool segment;
	double t_min;
	double reach; /* of the accel */
	double back;  /* Embree's ray begins that much before o, in units of d */
	struct prim_ref from, to;
};

static bool memory_monitor(void *user, ssize_t bytes, bool post)
{
	(void)post;
	struct accel *a = user;
	size_t now = atomic_fetch_add(&a->bytes, (size_t)bytes) + (size_t)bytes;
	if (now > atomic_load(&a->peak))
		atomic_store(&a->peak, now); /* one thread builds */
	return true;
}

/* Once in about a thousand primitives, on whatever thread Embree likes. */
static bool progress_monitor(void *counter, double done)
{
	(void)done;
	tick_on(counter);
	return true;
}

static vec3 vertex(const struct accel_shape *s, uint32_t i)
{
	return (vec3){(double)s->position[i][0], (double)s->position[i][1], (double)s->position[i][2]};
}

static double norm1(vec3 v)
{
	return fabs(v.x) + fabs(v.y) + fabs(v.z);
}

/* Height of the plane through v0 over p, times |n|; 0 when p lies in the plane as far as double can tell: p and n carry the
 * rounding of a few operations, of which `edges` bounds the terms. */
static double height(vec3 p, vec3 v0, vec3 n, double edges)
{
	vec3 to = vec3_sub(v0, p);
	double h = vec3_dot(n, to);
	return fabs(h) <= 0x1p-49 * edges * (norm1(p) + norm1(to)) ? 0 : h;
}

/* The plane of the triangle is crossed after the start, and before the end of a segment. A ray that starts in the plane,
 * on a coplanar neighbour, does not cross it again. */
static bool crosses(const struct query *q, const struct accel_shape *s, uint32_t prim)
{
	const uint32_t *i = s->index[prim];
	vec3 v0 = vertex(s, i[0]), e1 = vec3_sub(vertex(s, i[1]), v0), e2 = vec3_sub(vertex(s, i[2]), v0);
	vec3 n = vec3_cross(e1, e2);
	double edges = norm1(e1) * norm1(e2), start = height(q->o, v0, n, edges);
	double beyond = q->segment ? -height(q->end, v0, n, edges) : vec3_dot(n, q->d);
	return (start > 0 && beyond > 0) || (start < 0 && beyond < 0);
}

/* So high over the triangle's plane at both ends that not even the normal that Embree makes of tiny triangles far away can
 * be wrong about the side: spares most hits the way to their vertices. */
static bool clearly_crosses(const struct query *q, const struct RTCHit *hit, const struct RTCRay *ray)
{
	vec3 n = {(double)hit->Ng_x, (double)hit->Ng_y, (double)hit->Ng_z};
	double t = (double)ray->tfar - q->back, nearer = q->segment ? fmin(t, 1 - t) : t;
	return fabs(vec3_dot(n, q->d)) * nearer > 0x1p10 * q->reach * norm1(n);
}

static void filter_triangle(const struct RTCFilterFunctionNArguments *args)
{
	const struct query *q = (const struct query *)(const void *)args->context;
	/* Single rays only (N = 1): the accessors of packets exist in C++ alone. */
	const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
	if ((hit->geomID == q->from.shape && hit->primID == q->from.prim) ||
	    (hit->geomID == q->to.shape && hit->primID == q->to.prim))
		args->valid[0] = 0;
	else if (!clearly_crosses(q, hit, (const struct RTCRay *)(const void *)args->ray) &&
		 !crosses(q, args->geometryUserPtr, hit->primID))
		args->valid[0] = 0;
}

/* The final hit is among those that pass here: its vertices, far apart in memory, come while Embree goes on searching. */
static void filter_closest(const struct RTCFilterFunctionNArguments *args)
{
	const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
	const struct accel_shape *s = args->geometryUserPtr;
	const uint32_t *i = s->index[hit->primID];
	for (int k = 0; k < 3; k++)
		__builtin_prefetch(s->position[i[k]]);
	filter_triangle(args);
}

static void sphere_bounds(const struct RTCBoundsFunctionArguments *args)
{
	const struct sphere_prim *s = args->geometryUserPtr;
	/* One part in 2^20 outwards: more than float rounding of the box and of Embree's slab test can take away. */
	double r = s->radius * (1 + 0x1p-20) + 0x1p-20 * (fabs(s->center.x) + fabs(s->center.y) + fabs(s->center.z));
	struct RTCBounds *b = args->bounds_o;
	b->lower_x = (float)(s->center.x - r);
	b->lower_y = (float)(s->center.y - r);
	b->lower_z = (float)(s->center.z - r);
	b->upper_x = (float)(s->center.x + r);
	b->upper_y = (float)(s->center.y + r);
	b->upper_z = (float)(s->center.z + r);
}

/* The nearest admissible root of |o + t d - c|^2 = r^2 in (t_min, t_max). Where the ray starts on the sphere one root is 0,
 * where a segment ends on it one root is 1: the other follows from Vieta without cancellation. Else the discriminant comes
 * from the distance of the line to the centre (Haines et al. 2019, Ray Tracing Gems ch. 7). */
static bool sphere_root(const struct sphere_prim *s, const struct query *q, double t_max, double *t)
{
	vec3 oc = vec3_sub(q->o, s->center);
	double a = vec3_dot(q->d, q->d), b = vec3_dot(oc, q->d);
	double length = vec3_length(oc), c = (length - s->radius) * (length + s->radius);
	bool starts = q->from.shape == s->shape, ends = q->to.shape == s->shape;
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
	const struct query *q = (const struct query *)(const void *)args->context;
	const struct sphere_prim *s = args->geometryUserPtr;
	struct RTCRayHit *rh = (struct RTCRayHit *)(void *)args->rayhit;
	double t;
	if (!sphere_root(s, q, (double)rh->ray.tfar - q->back, &t))
		return;
	rh->ray.tfar = (float)(t + q->back);
	rh->hit.geomID = s->shape;
	rh->hit.primID = 0;
	rh->hit.u = rh->hit.v = 0;
}

static void sphere_occluded(const struct RTCOccludedFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	const struct query *q = (const struct query *)(const void *)args->context;
	struct RTCRay *ray = (struct RTCRay *)(void *)args->ray;
	double t;
	if (sphere_root(args->geometryUserPtr, q, q->segment ? 1 : INFINITY, &t))
		ray->tfar = -INFINITY;
}

static void attach(struct accel *a, RTCGeometry g, uint32_t id)
{
	rtcSetGeometryMask(g, 0xFFFFFFFFu);
	rtcCommitGeometry(g);
	rtcAttachGeometryByID(a->scene, g, id);
	rtcReleaseGeometry(g);
}

static int attach_triangles(struct accel *a, struct accel_shape *s, uint32_t id)
{
	RTCGeometry g = rtcNewGeometry(a->device, RTC_GEOMETRY_TYPE_TRIANGLE);
	if (!g)
		return -ENOMEM;
	rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, s->position, 0, sizeof s->position[0],
				   s->vertex_count);
	rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s->index, 0, sizeof s->index[0],
				   s->triangle_count);
	rtcSetGeometryUserData(g, s);
	rtcSetGeometryIntersectFilterFunction(g, filter_closest);
	rtcSetGeometryOccludedFilterFunction(g, filter_triangle);
	attach(a, g, id);
	return 0;
}

static int attach_sphere(struct accel *a, const struct accel_shape *s, uint32_t id)
{
	struct sphere_prim *prim = &a->spheres[a->sphere_count++];
	*prim = (struct sphere_prim){s->center, s->radius, id};
	RTCGeometry g = rtcNewGeometry(a->device, RTC_GEOMETRY_TYPE_USER);
	if (!g)
		return -ENOMEM;
	rtcSetGeometryUserPrimitiveCount(g, 1);
	rtcSetGeometryUserData(g, prim);
	rtcSetGeometryBoundsFunction(g, sphere_bounds, NULL);
	rtcSetGeometryIntersectFunction(g, sphere_intersect);
	rtcSetGeometryOccludedFunction(g, sphere_occluded);
	attach(a, g, id);
	return 0;
}

/* One instruction set for all machines that have it, so that farms of mixed processors agree on bits. */
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
	return error_set(e, code == RTC_ERROR_OUT_OF_MEMORY ? ENOMEM : EIO, "Embree reports error %d while building", (int)code);
}

/* How far a point in float, and what Embree's robust test makes of it with vertices anywhere in the scene, can be off: half
 * a unit in the last place of each coordinate for the point, as much again for the differences, times four. */
static double rounding_reach(vec3 low, vec3 high)
{
	vec3 m = {fmax(fabs(low.x), fabs(high.x)), fmax(fabs(low.y), fabs(high.y)), fmax(fabs(low.z), fabs(high.z))};
	return 0x1p-21 * fmax(m.x, fmax(m.y, m.z));
}

static int build(struct accel *a, const struct accel_shape *shapes, uint32_t count, struct error *e)
{
	a->device = rtcNewDevice(has_avx2() ? "threads=1,isa=avx2" : "threads=1");
	if (!a->device)
		return error_set(e, EIO, "Embree's device cannot be created");
	rtcSetDeviceMemoryMonitorFunction(a->device, memory_monitor, a);
	a->scene = rtcNewScene(a->device);
	if (!a->scene)
		return error_set(e, ENOMEM, "Embree's scene cannot be created");
	rtcSetSceneFlags(a->scene, RTC_SCENE_FLAG_ROBUST);
	rtcSetSceneBuildQuality(a->scene, RTC_BUILD_QUALITY_MEDIUM);
	for (uint32_t i = 0; i < count; i++) {
		a->shapes[i] = shapes[i];
		int rc = shapes[i].is_sphere ? attach_sphere(a, &shapes[i], i) : attach_triangles(a, &a->shapes[i], i);
		if (rc)
			return error_set(e, -rc, "Embree's geometry cannot be created");
	}
	rtcSetSceneProgressMonitorFunction(a->scene, progress_monitor, tick_counter);
	rtcCommitScene(a->scene);
	int rc = embree_failure(a->device, e);
	if (rc || count == 0)
		return rc;
	struct RTCBounds b;
	rtcGetSceneBounds(a->scene, &b);
	a->low = (vec3){(double)b.lower_x, (double)b.lower_y, (double)b.lower_z};
	a->high = (vec3){(double)b.upper_x, (double)b.upper_y, (double)b.upper_z};
	a->size = a->high.x - a->low.x + a->high.y - a->low.y + a->high.z - a->low.z;
	a->reach = rounding_reach(a->low, a->high);
	return 0;
}

int accel_new(struct accel **out, const struct accel_shape *shapes, uint32_t count, struct error *e)
{
	*out = NULL;
	struct accel *a = mem_alloc(1, sizeof *a);
	if (!a)
		return error_set(e, ENOMEM, "out of memory");
	a->spheres = mem_alloc(count, sizeof *a->spheres);
	a->shapes = mem_alloc(count, sizeof *a->shapes);
	unsigned trap = fptrap_leave();
	int rc = a->spheres && a->shapes ? build(a, shapes, count, e) : error_set(e, ENOMEM, "out of memory");
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
	if (a->device)
		rtcReleaseDevice(a->device);
	fptrap_return(trap);
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

/* Rays from far outside enter the scene's box in double: Embree's floats never see the distance. In units of |d|. */
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

/* To the side that d leaves for. */
static vec3 lifted(const struct accel *a, vec3 p, vec3 ng, vec3 d)
{
	return vec3_madd(p, copysign(a->reach, vec3_dot(ng, d)), ng);
}

/* Embree ends the program on rays beyond about 1.8e18 (FLT_LARGE). A number that is none fails, too. */
static void check_ray(const struct RTCRay *r)
{
	float sum = fabsf(r->org_x) + fabsf(r->org_y) + fabsf(r->org_z) + fabsf(r->dir_x) + fabsf(r->dir_y) + fabsf(r->dir_z);
	if (!(sum < 1e18f))
		fptrap_fault();
}

/* Embree's ray runs beside the true one and begins before it, by as much as floats may be off: beside, so that a low ray does
 * not slip out along the edge of the triangle that it leaves and that is filtered; before, and beyond the end, so that
 * nothing near them is lost. What it does not meet in double between the ends is turned down by the callbacks. */
static void fill_ray(struct RTCRay *ray, const struct query *q, vec3 o, vec3 d, double t_max)
{
	o = vec3_madd(o, -q->back, d);
	*ray = (struct RTCRay){.org_x = (float)o.x,
			       .org_y = (float)o.y,
			       .org_z = (float)o.z,
			       .tnear = q->t_min > 0 ? (float)(q->t_min + q->back) : 0,
			       .dir_x = (float)d.x,
			       .dir_y = (float)d.y,
			       .dir_z = (float)d.z,
			       .tfar = (float)fmin(t_max + 2 * q->back, (double)FLT_MAX),
			       .mask = 0xFFFFFFFFu};
	check_ray(ray);
}

bool accel_closest(const struct accel *a, const struct ray_end *from, vec3 d, double t_min, double t_max, struct ray_hit *hit)
{
	double enter = entry_distance(a, from->p, d);
	if (enter >= t_max)
		return false;
	struct query q = {.o = vec3_madd(from->p, enter, d), .d = d, .t_min = fmax(t_min - enter, 0), .reach = a->reach,
			  .back = a->reach, .from = from->prim, .to = PRIM_NONE};
	struct RTCRayHit rh;
	fill_ray(&rh.ray, &q, lifted(a, q.o, from->ng, d), d, t_max - enter);
	rh.hit.geomID = rh.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
	unsigned trap = fptrap_leave();
	EMBREE_INIT_CONTEXT(&q.context);
	embree_intersect(a->scene, &q.context, &rh);
	fptrap_return(trap);
	if (rh.hit.geomID == RTC_INVALID_GEOMETRY_ID)
		return false;
	double t = enter + fmax((double)rh.ray.tfar - q.back, 0);
	*hit = (struct ray_hit){{rh.hit.geomID, rh.hit.primID}, t, (double)rh.hit.u, (double)rh.hit.v};
	return true;
}

static bool occluded(const struct accel *a, struct query *q, vec3 o, vec3 d, double t_max)
{
	struct RTCRay ray;
	fill_ray(&ray, q, o, d, t_max);
	unsigned trap = fptrap_leave();
	EMBREE_INIT_CONTEXT(&q->context);
	embree_occluded(a->scene, &q->context, &ray);
	fptrap_return(trap);
	return ray.tfar < 0;
}

bool accel_occluded(const struct accel *a, const struct ray_end *from, const struct ray_end *to)
{
	vec3 d = vec3_sub(to->p, from->p);
	double enter = entry_distance(a, from->p, d);
	if (enter >= 1)
		return false;
	struct query q = {.o = vec3_madd(from->p, enter, d), .d = vec3_scale(1 - enter, d), .end = to->p, .segment = true,
			  .reach = a->reach, .from = from->prim, .to = to->prim};
	double length = vec3_length(q.d);
	if (!(length > 0))
		return false;
	q.back = a->reach / fmax(length, a->reach * 0x1p-20); /* a segment that is shorter leaves Embree's floats no ray */
	vec3 o = lifted(a, q.o, from->ng, d), end = lifted(a, to->p, to->ng, vec3_neg(d));
	return occluded(a, &q, o, vec3_sub(end, o), 1);
}

bool accel_occluded_to_infinity(const struct accel *a, const struct ray_end *from, vec3 d)
{
	struct query q = {.o = from->p, .d = d, .reach = a->reach, .back = a->reach, .from = from->prim, .to = PRIM_NONE};
	return occluded(a, &q, lifted(a, from->p, from->ng, d), d, INFINITY);
}
