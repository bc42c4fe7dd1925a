/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Instances of meshes. instances_init builds a tree for each mesh. Embree's callbacks transform a query from world
 * space into a segment in the mesh's frame. The segment ends where the query does, or where it leaves the mesh's box,
 * so all its numbers are of the order of the mesh's size.
 *
 * Only building fails, if out of memory. A query that does not meet the mesh's box meets nothing.
 */
#include "worker/render/geom/instances.h"

#include "common/base/mem.h"

/* ---- building */

/* A query within one instance. */
struct instance_query {
	embree_context context;
	const struct ray_query *q;
	uint32_t shape;
	const struct placement *placement; /* placement at the query's time */
	struct placement storage;	   /* room for the placement of an instance that moves */
	vec3 start, d;			   /* start and unit direction of the segment */
	/* Length of the segment, which is the part of the query from t0 to t1. */
	double length, t0, t1;
	double float_error; /* error bound of Embree's floats */
	double lead, trail; /* Embree's ray is longer by this at its ends, see query_grazing_factor */
};

/* As in accel.c: whether both ends are so high over the triangle's plane that rounding cannot change their sides. */
static bool clearly_crosses(const struct instance_query *w, const struct RTCHit *hit, const struct RTCRay *ray)
{
	vec3 n = {(double)hit->Ng_x, (double)hit->Ng_y, (double)hit->Ng_z};
	double t = (double)ray->tfar - w->lead, nearer = w->q->is_segment ? fmin(t, w->length - t) : t;
	return fabs(vec3_dot(n, w->d)) * nearer > 0x1p10 * w->float_error * triangle_norm1(n);
}

static void filter_hit(const struct RTCFilterFunctionNArguments *args)
{
	const struct instance_query *w = (const struct instance_query *)(const void *)args->context;
	const struct RTCHit *hit = (const struct RTCHit *)(const void *)args->hit;
	const struct ray_query *q = w->q;
	const struct prim_ref prim = {w->shape, hit->primID, q->start_prim.time};
	if (query_is_end(q, prim))
		args->valid[0] = 0;
	else if (query_may_be_hidden(q, prim.shape)) {
		if (!query_crosses_present(q, prim))
			args->valid[0] = 0;
	} else if (!clearly_crosses(w, hit, (const struct RTCRay *)(const void *)args->ray) &&
		   !query_crosses(q, &q->shapes[prim.shape], prim.prim))
		args->valid[0] = 0;
}

static int build_tree(struct instance_tree *t, RTCDevice device, const struct accel_shape *s)
{
	t->is_mirrored = s->placement->is_mirrored;
	t->scene = embree_new_scene(device);
	RTCGeometry g = t->scene ? embree_new_triangles(device, s) : NULL;
	if (!g)
		return -ENOMEM;
	rtcSetGeometryIntersectFilterFunction(g, filter_hit);
	rtcSetGeometryOccludedFilterFunction(g, filter_hit);
	embree_attach(t->scene, g, 0);
	embree_build(t->scene);
	embree_bounds(t->scene, &t->box_min, &t->box_max);
	t->float_error = 0x1p-21 * fmax(triangle_norm_max(t->box_min), triangle_norm_max(t->box_max));
	return 0;
}

int instances_init(struct instances *s, RTCDevice device, const struct accel_shape *shapes, uint32_t count)
{
	*s = (struct instances){.shapes = shapes};
	uint32_t trees = 0;
	for (uint32_t i = 0; i < count; i++) {
		s->count += accel_is_instance(&shapes[i]);
		trees += accel_is_instance(&shapes[i]) && shapes[i].placement->first_shape == i;
	}
	if (s->count == 0)
		return 0;
	uint32_t *tree_of = mem_alloc(count, sizeof *tree_of);
	s->trees = mem_alloc(trees, sizeof *s->trees);
	s->items = mem_alloc(s->count, sizeof *s->items);
	int rc = tree_of && s->trees && s->items ? 0 : -ENOMEM;
	s->count = 0;
	for (uint32_t i = 0; i < count && !rc; i++) {
		if (!accel_is_instance(&shapes[i]))
			continue;
		uint32_t first = shapes[i].placement->first_shape;
		if (first == i) {
			tree_of[i] = s->tree_count++;
			rc = build_tree(&s->trees[tree_of[i]], device, &shapes[i]);
		}
		s->items[s->count++] = (struct instance){i, tree_of[first]};
	}
	mem_free(tree_of);
	return rc;
}

void instances_fini(struct instances *s)
{
	for (uint32_t i = 0; i < s->tree_count; i++)
		if (s->trees[i].scene)
			rtcReleaseScene(s->trees[i].scene);
	mem_free(s->trees);
	mem_free(s->items);
	*s = (struct instances){.count = 0};
}

/* ---- Embree's callbacks */

/* The bounds allow for the deviation of Embree's ray from the true one. */
static void instance_bounds(const struct RTCBoundsFunctionArguments *args)
{
	const struct instances *s = args->geometryUserPtr;
	const struct placement *m = s->shapes[s->items[args->primID].shape].placement;
	double r = 2 * (s->ray_error + s->ray_error_slope * triangle_norm_max(m->center)) +
		   0x1p-20 * (triangle_norm_max(m->half) + triangle_norm_max(m->center)) + m->vertex_error;
	struct RTCBounds *b = args->bounds_o;
	b->lower_x = (float)(m->center.x - m->half.x - r);
	b->lower_y = (float)(m->center.y - m->half.y - r);
	b->lower_z = (float)(m->center.z - m->half.z - r);
	b->upper_x = (float)(m->center.x + m->half.x + r);
	b->upper_y = (float)(m->center.y + m->half.y + r);
	b->upper_z = (float)(m->center.z + m->half.z + r);
}

/* Clips [t0, t1] to the range between low and high along one axis. Returns false if nothing is left. */
static bool clip_range(double o, double d, double low, double high, double *t0, double *t1)
{
	if (d == 0)
		return o >= low && o <= high;
	double a = (low - o) / d, b = (high - o) / d;
	*t0 = fmax(*t0, fmin(a, b));
	*t1 = fmin(*t1, fmax(a, b));
	return *t0 <= *t1;
}

/* Returns the unit normal, in the mesh's frame, of the surface on which an end is; 0 if it is on none. */
static vec3 end_normal(const struct placement *m, const struct ray_end *end)
{
	vec3 n = end ? placement_normal_to_mesh(m, end->ng) : (vec3){0, 0, 0};
	double length = vec3_length(n);
	return length > 0 ? vec3_scale(1 / length, n) : n;
}

/* Lifts p off a surface with normal n, to the side into which d leaves; *extension: the extra length by
 * query_grazing_factor. */
static vec3 lift_off_surface(vec3 p, vec3 n, vec3 d, double distance, double *extension)
{
	*extension = distance * query_grazing_factor(n, d);
	return vec3_madd(p, copysign(distance, vec3_dot(n, d)), n);
}

/* Computes the part of the query up to t_max that is inside the instance's box. Returns false if there is none. */
static bool enter_instance(struct instance_query *w, const struct instances *s, const struct instance *it,
			   const struct ray_query *q, double t_max)
{
	const struct placement *m = placement_at(s->shapes[it->shape].placement, q->start_prim.time, &w->storage);
	const struct instance_tree *tree = &s->trees[it->tree];
	vec3 o = placement_point_to_mesh(m, q->o), d = placement_vector_to_mesh(m, q->d);
	w->q = q;
	w->shape = it->shape;
	w->placement = m;
	w->float_error = tree->float_error + m->rounding + 0x1p-50 * triangle_norm1(o);
	w->t0 = q->t_min;
	w->t1 = t_max;
	double r = 2 * w->float_error;
	if (!clip_range(o.x, d.x, tree->box_min.x - r, tree->box_max.x + r, &w->t0, &w->t1) ||
	    !clip_range(o.y, d.y, tree->box_min.y - r, tree->box_max.y + r, &w->t0, &w->t1) ||
	    !clip_range(o.z, d.z, tree->box_min.z - r, tree->box_max.z + r, &w->t0, &w->t1))
		return false;
	w->start = vec3_madd(o, w->t0, d);
	w->lead = w->trail = w->float_error;
	vec3 end = vec3_madd(o, w->t1, d);
	if (w->t0 == 0)
		w->start = lift_off_surface(w->start, end_normal(m, q->start_surface), d, w->float_error, &w->lead);
	if (q->is_segment && w->t1 == 1)
		end = lift_off_surface(placement_point_to_mesh(m, q->end), end_normal(m, q->end_surface), vec3_neg(d),
				       w->float_error, &w->trail);
	vec3 segment = vec3_sub(end, w->start);
	w->length = vec3_length(segment);
	w->d = vec3_scale(1 / w->length, segment);
	return w->length > 0 && vec3_is_finite(w->d);
}

/* Fills in the float ray, which starts before the segment and ends after it by the error bound of floats, except where
 * the query's t_min clips it. */
static void fill_ray(const struct instance_query *w, struct RTCRay *ray)
{
	vec3 o = vec3_madd(w->start, -w->lead, w->d);
	bool clipped = w->q->t_min > 0 && w->t0 == w->q->t_min;
	*ray = (struct RTCRay){.org_x = (float)o.x,
			       .org_y = (float)o.y,
			       .org_z = (float)o.z,
			       .tnear = clipped ? (float)w->lead : 0,
			       .dir_x = (float)w->d.x,
			       .dir_y = (float)w->d.y,
			       .dir_z = (float)w->d.z,
			       .tfar = (float)(w->length + w->lead + w->trail),
			       .mask = 0xFFFFFFFFu};
}

/* Returns the distance of a hit in units of q->d: that of the triangle's plane if it agrees with Embree's within the
 * precision of floats, otherwise Embree's. */
static double hit_distance(const struct instance_query *w, const struct RTCRayHit *rh)
{
	double ratio = (w->t1 - w->t0) / w->length, t = w->t0 + ((double)rh->ray.tfar - w->lead) * ratio;
	const struct accel_shape *s = &w->q->shapes[w->shape];
	const struct triangle k = placement_triangle(w->placement, s->position, s->index[rh->hit.primID]);
	double exact = vec3_dot(k.n, vec3_sub(k.v[0], w->q->o)) / vec3_dot(k.n, w->q->d);
	return fmax(fabs(exact - t) <= 4 * w->lead * ratio ? exact : t, w->q->t_min);
}

static void instance_intersect(const struct RTCIntersectFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	const struct instances *s = args->geometryUserPtr;
	const struct instance *it = &s->items[args->primID];
	const struct ray_query *q = (const struct ray_query *)(const void *)args->context;
	struct RTCRayHit *rh = (struct RTCRayHit *)(void *)args->rayhit, inner;
	struct instance_query w;
	double t_max = (double)rh->ray.tfar - q->origin_lead;
	if (!enter_instance(&w, s, it, q, t_max))
		return;
	fill_ray(&w, &inner.ray);
	inner.hit.geomID = inner.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
	EMBREE_INIT_CONTEXT(&w.context);
	embree_intersect(s->trees[it->tree].scene, &w.context, &inner);
	if (inner.hit.geomID == RTC_INVALID_GEOMETRY_ID)
		return;
	double t = hit_distance(&w, &inner);
	if (!(t < t_max))
		return;
	bool is_reversed = s->shapes[it->shape].placement->is_mirrored != s->trees[it->tree].is_mirrored;
	rh->ray.tfar = (float)(t + q->origin_lead);
	rh->hit.geomID = it->shape;
	rh->hit.primID = inner.hit.primID;
	rh->hit.u = is_reversed ? inner.hit.v : inner.hit.u;
	rh->hit.v = is_reversed ? inner.hit.u : inner.hit.v;
}

static void instance_occluded(const struct RTCOccludedFunctionNArguments *args)
{
	if (!args->valid[0])
		return;
	const struct instances *s = args->geometryUserPtr;
	const struct instance *it = &s->items[args->primID];
	const struct ray_query *q = (const struct ray_query *)(const void *)args->context;
	struct instance_query w;
	struct RTCRay inner;
	if (!enter_instance(&w, s, it, q, q->is_segment ? 1 : INFINITY))
		return;
	fill_ray(&w, &inner);
	EMBREE_INIT_CONTEXT(&w.context);
	embree_occluded(s->trees[it->tree].scene, &w.context, &inner);
	if (inner.tfar < 0)
		((struct RTCRay *)(void *)args->ray)->tfar = -INFINITY;
}

const struct embree_ops instances_ops = {instance_bounds, instance_intersect, instance_occluded};
