/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the benchmarks measure (subject.h): a lease through the integrator's own function, and Embree alone with the
 * rays that the lease traced. The raw scene is built without the filters, exact hits and null faces of
 * worker/render/geom/accel.h, so the ratio of both is the cost of these.
 */
#include "tests/bench/subject.h"

#include "common/base/mem.h"
#include "common/plan/resample.h"
#include "tests/bench/bench.h"
#include "worker/render/render.h"
#include "worker/render/geom/embree.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/math/rng.h"
#include "worker/render/world/world.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

enum { RAYS_MAX = 1 << 19, CHAINS = 64, BOOTSTRAP = 4096 };

struct subject_embree {
	RTCDevice device;
	RTCScene scene;
	struct RTCRayHit ray[];
};

static void run_lease(const struct subject *s, const struct lease_key *k, struct batch *b)
{
	struct error e;
	enum lease_outcome end;
	if (render_lease(s->w, &s->plan, k, s->input.seeds ? &s->input : NULL, NULL, &end, b, &e))
		bench_die(&e);
}

void subject_run(const struct subject *s, struct batch *b)
{
	run_lease(s, &s->key, b);
}

uint64_t subject_render(const struct subject *s)
{
	struct batch b;
	subject_run(s, &b);
	uint64_t rays = batch_ray_count(b.counters);
	batch_fini(&b);
	return rays;
}

static void make_seeds(struct subject *s)
{
	struct lease_key k = {1, LEASE_BOOTSTRAP, 0, 0, 0};
	struct batch b;
	run_lease(s, &k, &b);
	if (!plan_resample(&s->plan, 0, b.weights, b.weight_count, 0.5, s->plan.chains, s->seeds)) {
		struct error e;
		error_set(&e, EINVAL, "the bootstrap is black");
		bench_die(&e);
	}
	batch_fini(&b);
}

void subject_reseed(struct subject *s, uint64_t seed)
{
	s->plan.seed = seed;
	if (s->seeds)
		make_seeds(s);
}

static void choose_mutations(struct subject *s, const char *mutations)
{
	struct render_summary summary;
	struct error e;
	world_summary(s->w, &summary);
	if (render_canonical_mutations(mutations, &summary, s->plan.mutations, &e))
		bench_die(&e);
}

void subject_init(struct subject *s, struct world *w, const char *integrator, const char *mutations)
{
	const struct integrator_properties *i = render_integrator_find(integrator);
	const struct scene_settings *set = &w->settings;
	*s = (struct subject){.w = w, .key = {1, LEASE_RENDER, 0, 0, 0}};
	s->plan = (struct plan){.kind = i->kind,
				.width = set->width,
				.height = set->height,
				.crop_width = set->width,
				.crop_height = set->height,
				.border = set->border,
				.groups = 1,
				.parts = 1,
				.rounds = 1,
				.bootstrap = BOOTSTRAP,
				.min_depth = 1,
				.max_depth = set->max_depth,
				.epoch = 1};
	snprintf(s->plan.integrator, sizeof s->plan.integrator, "%s", integrator);
	if (i->has_mutations)
		choose_mutations(s, mutations);
	if (i->kind == PLAN_CHAINS) {
		s->plan.chains = CHAINS;
		s->plan.epoch = 64;
		s->seeds = bench_alloc(CHAINS, sizeof *s->seeds);
		s->input = (struct lease_input){.chain_count = CHAINS, .seeds = s->seeds};
		make_seeds(s);
	}
	uint64_t rays = subject_render(s), factor = RAYS_MAX / (rays + rays / 50 + 1);
	s->plan.epoch *= factor > 0 ? factor : 1;
}

static RTCDevice new_device(void)
{
	return rtcNewDevice(strstr(accel_version(), "avx2") ? "threads=1,isa=avx2" : "threads=1");
}

static RTCScene new_scene(RTCDevice device)
{
	RTCScene scene = rtcNewScene(device);
	rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
	rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
	return scene;
}

static void attach_geometry(RTCScene scene, RTCGeometry g)
{
	rtcCommitGeometry(g);
	rtcAttachGeometry(scene, g);
	rtcReleaseGeometry(g);
}

static void add_sphere(RTCDevice device, RTCScene scene, vec3 center, double radius)
{
	RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
	float *v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof *v, 1);
	v[0] = (float)center.x;
	v[1] = (float)center.y;
	v[2] = (float)center.z;
	v[3] = (float)radius;
	attach_geometry(scene, g);
}

static void add_triangles(RTCDevice device, RTCScene scene, const struct geom_shape *s)
{
	RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
	rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, s->position, 0,
				   sizeof s->position[0], s->vertex_count);
	rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s->index, 0, sizeof s->index[0],
				   s->triangle_count);
	attach_geometry(scene, g);
}

static void make_embree_scene(const struct world *w, struct subject_embree *embree)
{
	embree->device = new_device();
	embree->scene = new_scene(embree->device);
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct geom_shape *g = &w->shapes[i];
		if (g->is_sphere)
			add_sphere(embree->device, embree->scene, g->center, g->radius);
		else
			add_triangles(embree->device, embree->scene, g);
	}
	rtcCommitScene(embree->scene);
}

double subject_build_embree(const struct world *w)
{
	struct subject_embree embree;
	double begin = bench_cpu_seconds();
	make_embree_scene(w, &embree);
	double seconds = bench_cpu_seconds() - begin;
	rtcReleaseScene(embree.scene);
	rtcReleaseDevice(embree.device);
	return seconds;
}

static struct RTCRayHit make_embree_ray(vec3 o, vec3 d, double t_min, double t_max)
{
	struct RTCRayHit h = {.ray = {.org_x = (float)o.x,
				      .org_y = (float)o.y,
				      .org_z = (float)o.z,
				      .dir_x = (float)d.x,
				      .dir_y = (float)d.y,
				      .dir_z = (float)d.z,
				      .tnear = (float)t_min,
				      .tfar = (float)t_max,
				      .mask = 0xFFFFFFFFu}};
	h.hit.geomID = h.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
	return h;
}

static struct RTCRayHit embree_ray_from_recorded(const struct recorded_ray *r)
{
	vec3 o = r->from.p, d = r->kind == RAY_SEGMENT ? vec3_sub(r->to.p, o) : r->d;
	double start = 0x1p-20, reach = r->kind == RAY_SEGMENT ? 1 - 0x1p-16 : (double)FLT_MAX;
	return make_embree_ray(o, d, fmax(r->t_min, start), r->kind == RAY_CLOSEST ? fmin(r->t_max, reach) : reach);
}

void subject_record(struct subject *s)
{
	s->rays = bench_alloc(RAYS_MAX, sizeof *s->rays);
	record_start(s->rays, RAYS_MAX);
	subject_render(s);
	s->ray_count = record_stop();
	s->embree = bench_alloc(1, sizeof *s->embree + s->ray_count * sizeof s->embree->ray[0]);
	make_embree_scene(s->w, s->embree);
	for (size_t i = 0; i < s->ray_count; i++)
		s->embree->ray[i] = embree_ray_from_recorded(&s->rays[i]);
}

double subject_replay_embree(const struct subject *s)
{
	embree_context context;
	EMBREE_INIT_CONTEXT(&context);
	size_t hits = 0;
	double begin = bench_cpu_seconds();
	for (size_t i = 0; i < s->ray_count; i++) {
		struct RTCRayHit h = s->embree->ray[i];
		if (s->rays[i].kind == RAY_CLOSEST) {
			embree_intersect(s->embree->scene, &context, &h);
			hits += h.hit.geomID != RTC_INVALID_GEOMETRY_ID;
		} else {
			embree_occluded(s->embree->scene, &context, &h.ray);
			hits += h.ray.tfar < 0;
		}
	}
	double seconds = bench_cpu_seconds() - begin;
	bench_sink += (double)hits;
	return seconds;
}

double subject_replay_accel(const struct subject *s)
{
	const struct accel *a = s->w->accel;
	struct ray_hit hit;
	size_t hits = 0;
	double begin = bench_cpu_seconds();
	bool watched = fptrap_watch();
	for (size_t i = 0; i < s->ray_count; i++) {
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

void subject_fini(struct subject *s)
{
	if (s->embree) {
		rtcReleaseScene(s->embree->scene);
		rtcReleaseDevice(s->embree->device);
	}
	mem_free(s->embree);
	mem_free(s->rays);
	mem_free(s->seeds);
}

/* The plane and the spheres of three-spheres.xml; rays start anywhere between them, in any direction. */
struct small_scene {
	RTCDevice device;
	RTCScene scene;
	struct RTCRayHit ray[1 << 16];
};

static struct small_scene *make_small_scene(void)
{
	struct small_scene *s = bench_alloc(1, sizeof *s);
	s->device = new_device();
	s->scene = new_scene(s->device);
	static float corner[5][3] = {{-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}};
	static uint32_t index[2][3] = {{0, 1, 2}, {0, 2, 3}};
	const struct geom_shape floor = {.position = corner, .index = index, .vertex_count = 4, .triangle_count = 2};
	add_triangles(s->device, s->scene, &floor);
	for (int i = -1; i <= 1; i++)
		add_sphere(s->device, s->scene, (vec3){2.2 * i, 0, 1}, 1);
	rtcCommitScene(s->scene);
	for (uint64_t i = 0; i < sizeof s->ray / sizeof s->ray[0]; i++) {
		double u[4], v[4];
		rng_uniform4(0, RNG_TEST, i, 0, 0, u);
		rng_uniform4(0, RNG_TEST, i, 1, 0, v);
		double z = 2 * v[0] - 1, r = sqrt(1 - z * z), phi = 2 * M_PI * v[1];
		s->ray[i] = make_embree_ray((vec3){8 * u[0] - 4, 4 * u[1] - 2, 0.05 + 4 * u[2]},
					    (vec3){r * cos(phi), r * sin(phi), z}, 0, (double)FLT_MAX);
	}
	return s;
}

double subject_million_rays(void)
{
	static struct small_scene *s;
	if (!s)
		s = make_small_scene();
	embree_context context;
	EMBREE_INIT_CONTEXT(&context);
	size_t hits = 0;
	double begin = bench_cpu_seconds();
	for (size_t i = 0; i < 1000000; i++) {
		struct RTCRayHit h = s->ray[i % (sizeof s->ray / sizeof s->ray[0])];
		embree_intersect(s->scene, &context, &h);
		hits += h.hit.geomID != RTC_INVALID_GEOMETRY_ID;
	}
	double seconds = bench_cpu_seconds() - begin;
	bench_sink += (double)hits;
	return seconds;
}
