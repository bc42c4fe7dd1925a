/*
 * What the renderer makes of Embree's rays: an integrator's rate against the same rays sent through the door alone, and
 * against Embree itself with a scene of its own (robust, no filters, the same triangles).
 */
#include "common/base/mem.h"
#include "tests/bench/bench.h"
#include "tests/bench/record.h"
#include "tests/bench/scenes.h"
#include "worker/geom/embree.h"
#include "worker/math/fptrap.h"
#include "worker/world/world.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

enum { RAYS_MAX = 1 << 19 };

/* One lease that can be run again and again. */
struct subject {
	struct world *w;
	struct plan plan;
	struct lease_key key;
	struct lease_input in;
	uint64_t *seeds;
	struct recorded_ray *rays;
	struct RTCRayHit *raw;
	size_t count;
	RTCDevice device;
	RTCScene scene;
};

static uint64_t run_lease(const struct subject *s, const struct lease_key *k, struct batch *b)
{
	struct error e;
	enum lease_end end;
	if (render_lease(s->w, &s->plan, k, s->in.seeds ? &s->in : NULL, NULL, &end, b, &e))
		bench_die(&e);
	return b->counters[COUNT_RAYS_CLOSEST] + b->counters[COUNT_RAYS_SHADOW];
}

static uint64_t render(const struct subject *s)
{
	struct batch b;
	uint64_t rays = run_lease(s, &s->key, &b);
	batch_fini(&b);
	return rays;
}

static void *room(size_t count, size_t size)
{
	struct error e;
	void *p = mem_alloc(count, size);
	if (!p) {
		error_set(&e, ENOMEM, "out of memory");
		bench_die(&e);
	}
	return p;
}

static void make_seeds(struct subject *s)
{
	struct lease_key k = {1, LEASE_BOOTSTRAP, 0, 0, 0};
	struct batch b;
	run_lease(s, &k, &b);
	s->seeds = room(s->plan.chains, sizeof *s->seeds);
	if (!plan_resample(&s->plan, 0, b.weights, b.weight_count, 0.5, s->plan.chains, s->seeds)) {
		struct error e;
		error_set(&e, EINVAL, "the bootstrap is black");
		bench_die(&e);
	}
	batch_fini(&b);
	s->in = (struct lease_input){.chain_count = s->plan.chains, .seeds = s->seeds};
}

/* Samples a pixel such that about RAYS_MAX rays are traced, all in one lease. */
static void make_plan(struct subject *s, const char *integrator)
{
	const struct render_integrator *i = render_integrator_find(integrator);
	const struct scene_settings *set = &s->w->settings;
	s->plan = (struct plan){.kind = i->kind, .width = set->width, .height = set->height, .crop_width = set->width,
				.crop_height = set->height, .border = set->border, .groups = 1, .parts = 1, .rounds = 1,
				.bootstrap = 4096, .min_depth = 1, .max_depth = set->max_depth, .epoch = 1};
	snprintf(s->plan.integrator, sizeof s->plan.integrator, "%s", integrator);
	s->key = (struct lease_key){1, LEASE_RENDER, 0, 0, 0};
	if (i->kind == PLAN_CHAINS) {
		s->plan.chains = 16;
		s->plan.epoch = 64;
		make_seeds(s);
	}
	uint64_t rays = render(s), factor = RAYS_MAX / (rays + rays / 50 + 1);
	s->plan.epoch *= factor > 0 ? factor : 1;
}

static RTCGeometry raw_geometry(RTCDevice device, const struct geom_shape *g)
{
	RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
	rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, g->position, 0, sizeof g->position[0],
				   g->vertex_count);
	rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, g->index, 0, sizeof g->index[0],
				   g->triangle_count);
	rtcCommitGeometry(geometry);
	return geometry;
}

static void make_raw_scene(struct subject *s)
{
	s->device = rtcNewDevice(strstr(accel_version(), "avx2") ? "threads=1,isa=avx2" : "threads=1");
	s->scene = rtcNewScene(s->device);
	rtcSetSceneFlags(s->scene, RTC_SCENE_FLAG_ROBUST);
	rtcSetSceneBuildQuality(s->scene, RTC_BUILD_QUALITY_MEDIUM);
	for (uint32_t i = 0; i < s->w->shape_count; i++) {
		if (s->w->shapes[i].is_sphere) {
			struct error e;
			error_set(&e, EINVAL, "a scene with spheres: the raw scene has triangles only");
			bench_die(&e);
		}
		RTCGeometry g = raw_geometry(s->device, &s->w->shapes[i]);
		rtcAttachGeometry(s->scene, g);
		rtcReleaseGeometry(g);
	}
	rtcCommitScene(s->scene);
}

static struct RTCRayHit raw_ray(const struct recorded_ray *r)
{
	vec3 o = r->from.p, d = r->kind == RAY_SEGMENT ? vec3_sub(r->to.p, o) : r->d;
	double start = 0x1p-20, reach = r->kind == RAY_SEGMENT ? 1 - 0x1p-16 : (double)FLT_MAX;
	struct RTCRayHit h = {.ray = {.org_x = (float)o.x,
				      .org_y = (float)o.y,
				      .org_z = (float)o.z,
				      .dir_x = (float)d.x,
				      .dir_y = (float)d.y,
				      .dir_z = (float)d.z,
				      .tnear = (float)fmax(r->t_min, start),
				      .tfar = (float)(r->kind == RAY_CLOSEST ? fmin(r->t_max, reach) : reach),
				      .mask = 0xFFFFFFFFu}};
	h.hit.geomID = h.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
	return h;
}

static void record(struct subject *s)
{
	s->rays = room(RAYS_MAX, sizeof *s->rays);
	record_start(s->rays, RAYS_MAX);
	render(s);
	s->count = record_stop();
	s->raw = room(s->count, sizeof *s->raw);
	for (size_t i = 0; i < s->count; i++)
		s->raw[i] = raw_ray(&s->rays[i]);
}

static double replay_raw(const struct subject *s)
{
	embree_context context;
	EMBREE_INIT_CONTEXT(&context);
	size_t hits = 0;
	double begin = bench_cpu_seconds();
	for (size_t i = 0; i < s->count; i++) {
		struct RTCRayHit h = s->raw[i];
		if (s->rays[i].kind == RAY_CLOSEST) {
			embree_intersect(s->scene, &context, &h);
			hits += h.hit.geomID != RTC_INVALID_GEOMETRY_ID;
		} else {
			embree_occluded(s->scene, &context, &h.ray);
			hits += h.ray.tfar < 0;
		}
	}
	double seconds = bench_cpu_seconds() - begin;
	bench_sink += (double)hits;
	return seconds;
}

static double replay_door(const struct subject *s)
{
	const struct accel *a = s->w->accel;
	struct ray_hit hit;
	size_t hits = 0;
	double begin = bench_cpu_seconds();
	bool watched = fptrap_watch();
	for (size_t i = 0; i < s->count; i++) {
		const struct recorded_ray *r = &s->rays[i];
		if (r->kind == RAY_CLOSEST)
			hits += accel_closest(a, &r->from, r->d, r->t_min, r->t_max, &hit);
		else if (r->kind == RAY_SEGMENT)
			hits += accel_occluded(a, &r->from, &r->to);
		else
			hits += accel_occluded_to_infinity(a, &r->from, r->d);
	}
	fptrap_unwatch(watched);
	double seconds = bench_cpu_seconds() - begin;
	bench_sink += (double)hits;
	return seconds;
}

static void release(struct subject *s)
{
	rtcReleaseScene(s->scene);
	rtcReleaseDevice(s->device);
	mem_free(s->rays);
	mem_free(s->raw);
	mem_free(s->seeds);
}

/* The world stays the caller's. ratio: the least share of Embree's rate, 0: none is asked for. */
static void measure(struct world *w, const char *integrator, double least_share)
{
	struct subject s = {.w = w};
	struct series share = {0}, rate = {0}, door = {0}, raw = {0}, door_cost = {0}, outside = {0};
	make_plan(&s, integrator);
	make_raw_scene(&s);
	record(&s);
	double n = (double)s.count;
	for (int i = 0; i < BENCH_REPEATS; i++) {
		double begin = bench_cpu_seconds();
		uint64_t traced = render(&s);
		double whole = (bench_cpu_seconds() - begin) * n / (double)traced, through = replay_door(&s), alone = replay_raw(&s);
		series_add(&rate, 1e-6 * n / whole);
		series_add(&door, 1e-6 * n / through);
		series_add(&raw, 1e-6 * n / alone);
		series_add(&share, alone / whole);
		series_add(&door_cost, 1e9 * (through - alone) / n);
		series_add(&outside, 1e9 * (whole - alone) / n);
	}
	char name[64];
	snprintf(name, sizeof name, "%s", integrator);
	bench_row(name, &rate, "million rays/s", BENCH_INFORMS, 0);
	snprintf(name, sizeof name, "%s: its rays through the door alone", integrator);
	bench_row(name, &door, "million rays/s", BENCH_INFORMS, 0);
	snprintf(name, sizeof name, "%s: its rays by Embree alone", integrator);
	bench_row(name, &raw, "million rays/s", BENCH_INFORMS, 0);
	snprintf(name, sizeof name, "%s: share of Embree's rate", integrator);
	bench_row(name, &share, "", least_share > 0 ? BENCH_AT_LEAST : BENCH_INFORMS, least_share);
	snprintf(name, sizeof name, "%s: the door's own cost", integrator);
	bench_row(name, &door_cost, "ns/ray", BENCH_INFORMS, 0);
	snprintf(name, sizeof name, "%s: outside Embree", integrator);
	bench_row(name, &outside, "ns/ray", BENCH_INFORMS, 0);
	release(&s);
}

void bench_rays(const char *bin)
{
	(void)bin;
	struct render_summary summary;
	struct world *w = bench_world_million();
	world_summary(w, &summary);
	char says[96];
	snprintf(says, sizeof says, "%.2f million triangles, diffuse and glossy, area lights", 1e-6 * (double)summary.triangles);
	bench_group("million", says);
	measure(w, "path", 0.6);
	world_free(w);

	const char *name;
	w = bench_world_box(&name);
	bench_group("box", name);
	measure(w, "path", 0);
	measure(w, "bdpt", 0);
	measure(w, "pssmlt", 0);
	world_free(w);
}
