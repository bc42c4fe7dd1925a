/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes of a world: read in double, moved into the unit sphere with the camera, then rounded to float.
 *
 * Failures have the object's place. Triangles without an area and shapes too small beside others are counted and said,
 * not errors.
 */
#include "worker/render/world/geometry.h"

#include "common/base/crash.h"
#include "common/base/liveness.h"
#include "worker/render/shape/mesh.h"
#include "worker/render/world/displacement.h"
#include "worker/render/world/shared_mesh.h"

#include <stdio.h>

/* Of all shapes together: Embree takes about 150 bytes for each. */
enum { TRIANGLES_MAX = 1 << 28 };

struct box build_box_of(const struct shape_geometry *g)
{
	struct box b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
	if (g->kind == SHAPE_SPHERE) {
		vec3 r = {g->sphere.radius, g->sphere.radius, g->sphere.radius};
		return (struct box){vec3_sub(g->sphere.center, r), vec3_add(g->sphere.center, r)};
	}
	for (uint32_t i = 0; i < g->mesh.vertex_count; i++)
		box_grow(&b, (vec3){g->mesh.position[i][0], g->mesh.position[i][1], g->mesh.position[i][2]});
	return b;
}

bool build_is_displaced(const struct builder *b, const struct scene_node *shape)
{
	return b->forced.of[EFFECT_DISPLACEMENT] >= 0 && displacement_of(shape);
}

/* Triangles without an area: nothing meets them, and they are left out. */
struct flat {
	uint64_t triangles;
	uint32_t shapes, empty; /* that have some; that have nothing else */
	const struct scene_node *first;
};

static void count_flat(struct flat *f, const struct scene_node *n, uint64_t triangles, bool empty)
{
	if (triangles && !f->first)
		f->first = n;
	f->triangles += triangles;
	f->shapes += triangles > 0;
	f->empty += empty;
}

static void note_flat(struct world *w, const struct flat *f)
{
	if (f->first)
		snprintf(
			w->flat, sizeof w->flat,
			"%llu triangles without an area are left out, in %u shapes (first: the %.24s in line %d); %u of these "
			"shapes have no others",
			(unsigned long long)f->triangles, f->shapes, f->first->type, f->first->line, f->empty);
}

static int read_shape(struct builder *b, const struct scene_node *n, struct shape_geometry *g, uint64_t *dropped)
{
	tick();
	crash_place("building the scene", n->file, n->line);
	int rc = shape_build(n, b->assets, &b->scratch, g, dropped, b->e);
	if (rc || (g->kind == SHAPE_MESH && g->mesh.triangle_count == 0) || b->forced.of[EFFECT_DISPLACEMENT] < 0)
		return rc;
	return displacement_apply(g, n, b->assets, b->scene->dialect_3, b->w->accuracy.tessellation, &b->scratch, b->e);
}

/* Counts what was read. */
static int take_geometry(struct builder *b, const struct scene_node *n, const struct shape_geometry *g,
			 uint64_t dropped, struct flat *flat)
{
	count_flat(flat, n, dropped, g->kind == SHAPE_MESH && g->mesh.triangle_count == 0);
	b->triangles += g->mesh.triangle_count;
	return b->triangles <= TRIANGLES_MAX
		       ? 0
		       : node_error(n, b->e, E2BIG, "the scene has more than %d triangles with it", TRIANGLES_MAX);
}

/* The mesh that an instance shares, read when the first of them asks; NULL: it is built by itself. */
static int find_shared(struct builder *b, const struct listed_shape *l, struct shared_mesh **meshes, struct flat *flat,
		       struct shared_mesh **out)
{
	*out = NULL;
	if (!shared_mesh_may(b, l))
		return 0;
	struct shared_mesh *m = meshes[l->first];
	int rc = 0;
	if (!m) {
		uint64_t dropped = 0;
		m = meshes[l->first] = arena_alloc(&b->scratch, 1, sizeof *m);
		if (!m)
			return build_out_of_memory(b->e);
		rc = read_shape(b, l->node, &m->geometry, &dropped);
		if (!rc)
			shared_mesh_read(m);
		if (!rc && m->shared)
			rc = take_geometry(b, l->node, &m->geometry, dropped, flat);
	}
	*out = m->shared ? m : NULL;
	return rc;
}

/* The next of the world's shapes; one with nothing to meet is none. */
static int read_listed(struct builder *b, const struct listed_shape *l, struct shared_mesh **meshes, struct flat *flat)
{
	uint32_t id = b->w->shape_count;
	struct shape_geometry *g = &b->geometry[id];
	const struct scene_node *n = l->node;
	int rc = find_shared(b, l, meshes, flat, &b->shared[id]);
	if (!rc && b->shared[id]) {
		*g = b->shared[id]->geometry;
		rc = shared_mesh_box(b->shared[id], l->instance, &b->boxes[id], b->e);
	} else if (!rc) {
		uint64_t dropped = 0;
		n = shape_placed(l, &b->scratch);
		rc = n ? read_shape(b, n, g, &dropped) : build_out_of_memory(b->e);
		if (!rc)
			rc = take_geometry(b, n, g, dropped, flat);
		if (rc || (g->kind == SHAPE_MESH && g->mesh.triangle_count == 0))
			return rc;
		b->boxes[id] = build_box_of(g);
	}
	if (rc)
		return rc;
	b->shape_nodes[id] = n;
	b->instances[id] = l->instance;
	box_grow(&b->all, b->boxes[id].low);
	box_grow(&b->all, b->boxes[id].high);
	b->w->shape_count++;
	return 0;
}

int build_read_shapes(struct builder *b)
{
	struct listed_shape *list;
	uint32_t listed;
	struct arena *a = &b->scratch;
	int rc = shape_list(b->scene, a, &list, &listed, b->e);
	if (rc)
		return rc;
	struct shared_mesh **meshes = arena_alloc(a, listed, sizeof(void *));
	b->geometry = arena_alloc(a, listed, sizeof *b->geometry);
	b->boxes = arena_alloc(a, listed, sizeof *b->boxes);
	b->shape_nodes = arena_alloc(a, listed, sizeof(void *));
	b->shared = arena_alloc(a, listed, sizeof(void *));
	b->instances = arena_alloc(a, listed, sizeof(void *));
	if (!meshes || !b->geometry || !b->boxes || !b->shape_nodes || !b->shared || !b->instances)
		return build_out_of_memory(b->e);
	b->all = (struct box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
	struct flat flat = {0};
	for (uint32_t i = 0; i < listed && !rc; i++)
		rc = read_listed(b, &list[i], meshes, &flat);
	if (rc)
		return rc;
	note_flat(b->w, &flat);
	crash_place("building the scene", NULL, 0);
	if (b->w->shape_count == 0)
		b->all.low = b->all.high = (vec3){0, 0, 0};
	return 0;
}

/* Points of a shape as large as the scene are off by a few 2^-53 of that. Where the smallest shape is a few thousand
 * times as large as these roundings integrators agree; at 2^-44 of the scene path and bdpt differed by 2 %. */
#define LEAST_SCALE 0x1p-42

static void note_scales(struct builder *b)
{
	uint32_t small = 0, large = 0;
	for (uint32_t i = 1; i < b->w->shape_count; i++) {
		if (box_extent(&b->boxes[i]) < box_extent(&b->boxes[small]))
			small = i;
		if (box_extent(&b->boxes[i]) > box_extent(&b->boxes[large]))
			large = i;
	}
	if (b->w->shape_count > 0 && box_extent(&b->boxes[small]) < LEAST_SCALE * box_extent(&b->all))
		snprintf(
			b->w->scales, sizeof b->w->scales,
			"the %.24s in line %d is so much smaller than the scene, with the %.24s in line %d, that numbers are too short for both: what is "
			"seen of it can be wrong",
			b->shape_nodes[small]->type, b->shape_nodes[small]->line, b->shape_nodes[large]->type,
			b->shape_nodes[large]->line);
}

int build_rescale(struct builder *b)
{
	struct world *w = b->w;
	struct weighed *room = arena_alloc(&b->scratch, w->shape_count, sizeof *room);
	if (!room)
		return build_out_of_memory(b->e);
	if (!isfinite(vec3_length(vec3_sub(b->all.high, b->all.low))))
		return error_set(b->e, EINVAL, "the scene's extent is not finite");
	note_scales(b);
	w->center = origin_choose(&b->all, b->boxes, w->shape_count, room);
	vec3 over = vec3_sub(b->all.high, w->center), under = vec3_sub(w->center, b->all.low);
	double r = vec3_length((vec3){fmax(over.x, under.x), fmax(over.y, under.y), fmax(over.z, under.z)});
	int exponent = 0;
	if (r > 0)
		frexp(r, &exponent);
	w->scale = ldexp(1, -exponent);
	/* Rounding to float moves vertices by parts in 2^24: the sphere is to hold them all the same. */
	w->radius = (r > 0 ? r * w->scale : 1) * (1 + 0x1p-20);
	int rc = camera_init(&w->camera, &w->settings, w->center, w->scale, b->e);
	for (uint32_t i = 0; rc && i < b->scene->object_count; i++) {
		const struct scene_node *n = b->scene->objects[i];
		if (n->cls == PLUGIN_SENSOR)
			return error_prefix(b->e, rc, "%s:%d: <sensor>", n->file, n->line);
	}
	return rc;
}

static vec3 float3(const float p[3])
{
	return (vec3){(double)p[0], (double)p[1], (double)p[2]};
}

static void put_float3(float out[3], vec3 v)
{
	out[0] = (float)v.x;
	out[1] = (float)v.y;
	out[2] = (float)v.z;
}

/* Keeps the triangles that still have an area in float, wound so that their normal agrees with the vertex normals.
 * Those of a displaced shape are left as they are: where one overhangs, its outside is still its neighbours'. */
static uint32_t take_triangles(struct geom_shape *g, struct mesh *m, bool displaced)
{
	uint32_t kept = 0;
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		const uint32_t *t = m->index[i];
		vec3 v0 = float3(g->position[t[0]]);
		vec3 n = vec3_cross(vec3_sub(float3(g->position[t[1]]), v0), vec3_sub(float3(g->position[t[2]]), v0));
		if (!(vec3_dot(n, n) > 0))
			continue;
		bool turn = false;
		if (g->normal && !displaced) {
			vec3 sum = vec3_add(float3(g->normal[t[0]]),
					    vec3_add(float3(g->normal[t[1]]), float3(g->normal[t[2]])));
			turn = vec3_dot(sum, n) < 0;
		}
		mesh_move_face(m, i, kept);
		g->index[kept][0] = t[0];
		g->index[kept][1] = t[turn ? 2 : 1];
		g->index[kept++][2] = t[turn ? 1 : 2];
	}
	return kept;
}

int build_place_mesh(struct builder *b, struct geom_shape *g, struct mesh *m, const struct scene_node *n, vec3 center,
		     double scale)
{
	struct arena *arena = &b->w->arena;
	uint32_t vertices = m->vertex_count;
	g->vertex_count = vertices;
	/* One vertex more than there are: Embree reads 16 bytes from the start of each. */
	g->position = arena_alloc(arena, (size_t)vertices + 1, sizeof *g->position);
	g->index = arena_alloc(arena, m->triangle_count, sizeof *g->index);
	g->normal = m->normal ? arena_alloc(arena, vertices, sizeof *g->normal) : NULL;
	g->uv = m->uv ? arena_alloc(arena, vertices, sizeof *g->uv) : NULL;
	if (!g->position || !g->index || (m->normal && !g->normal) || (m->uv && !g->uv))
		return build_out_of_memory(b->e);
	for (uint32_t i = 0; i < vertices; i++) {
		const double *p = m->position[i];
		put_float3(g->position[i], vec3_scale(scale, vec3_sub((vec3){p[0], p[1], p[2]}, center)));
		if (g->normal)
			put_float3(g->normal[i], (vec3){m->normal[i][0], m->normal[i][1], m->normal[i][2]});
		if (g->uv) {
			g->uv[i][0] = (float)m->uv[i][0];
			g->uv[i][1] = (float)m->uv[i][1];
		}
	}
	g->triangle_count = take_triangles(g, m, build_is_displaced(b, n));
	if (g->triangle_count == 0)
		return node_error(n, b->e, EINVAL, "no triangle of this shape has an area at the scene's scale");
	return 0;
}

int build_place_shapes(struct builder *b)
{
	struct world *w = b->w;
	w->shapes = arena_alloc(&w->arena, w->shape_count, sizeof *w->shapes);
	w->parts = arena_alloc(&w->arena, w->shape_count, sizeof *w->parts);
	if (!w->shapes || !w->parts)
		return build_out_of_memory(b->e);
	for (uint32_t i = 0; i < w->shape_count; i++) {
		struct shape_geometry *from = &b->geometry[i];
		struct geom_shape *g = &w->shapes[i];
		tick();
		if (b->shared[i]) {
			int rc = shared_mesh_place(b, b->shared[i], b->instances[i], i);
			if (rc)
				return rc;
			continue;
		}
		g->unit = w->scale;
		if (from->kind == SHAPE_SPHERE) {
			const struct sphere *s = &from->sphere;
			g->is_sphere = true;
			g->center = vec3_scale(w->scale, vec3_sub(s->center, w->center));
			g->radius = w->scale * s->radius;
			g->normal_sign = s->flip_normals ? -1 : 1;
			g->sphere_axes.s = vec3_normalize(mat4_vector(&s->to_world, (vec3){1, 0, 0}));
			g->sphere_axes.t = vec3_normalize(mat4_vector(&s->to_world, (vec3){0, 1, 0}));
			g->sphere_axes.n = vec3_normalize(mat4_vector(&s->to_world, (vec3){0, 0, 1}));
			continue;
		}
		int rc = build_place_mesh(b, g, &from->mesh, b->shape_nodes[i], w->center, w->scale);
		if (rc)
			return rc;
	}
	return 0;
}
