/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/place_mesh.h"

#include "worker/render/world/displacement.h"

struct box build_bounding_box(const struct shape_geometry *g)
{
	struct box b = box_empty();
	if (g->kind == SHAPE_SPHERE) {
		vec3 r = {g->sphere.radius, g->sphere.radius, g->sphere.radius};
		return (struct box){vec3_sub(g->sphere.center, r), vec3_add(g->sphere.center, r)};
	}
	if (g->kind == SHAPE_CURVE)
		return (struct box){g->curve.box_min, g->curve.box_max};
	for (uint32_t i = 0; i < g->mesh.vertex_count; i++)
		box_grow(&b, (vec3){g->mesh.position[i][0], g->mesh.position[i][1], g->mesh.position[i][2]});
	return b;
}

bool build_is_displaced(const struct builder *b, const struct scene_node *shape)
{
	return b->forced_effects.states[EFFECT_DISPLACEMENT] >= 0 && displacement_property(shape);
}

static vec3 load_float3(const float p[3])
{
	return (vec3){(double)p[0], (double)p[1], (double)p[2]};
}

static void store_float3(float out[3], vec3 v)
{
	out[0] = (float)v.x;
	out[1] = (float)v.y;
	out[2] = (float)v.z;
}

/* Keeps the triangles that still have an area in float, wound such that their normal agrees with the
 * vertex normals. The triangles of a displaced shape keep their winding: where one overhangs, its outside
 * is still that of its neighbours. */
static uint32_t keep_triangles(struct geom_shape *g, struct mesh *m, bool displaced)
{
	uint32_t kept = 0;
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		const uint32_t *t = m->index[i];
		vec3 v0 = load_float3(g->position[t[0]]);
		vec3 n = vec3_cross(vec3_sub(load_float3(g->position[t[1]]), v0),
				    vec3_sub(load_float3(g->position[t[2]]), v0));
		if (!(vec3_dot(n, n) > 0))
			continue;
		bool reverse = false;
		if (g->normal && !displaced) {
			vec3 sum = vec3_add(load_float3(g->normal[t[0]]),
					    vec3_add(load_float3(g->normal[t[1]]), load_float3(g->normal[t[2]])));
			reverse = vec3_dot(sum, n) < 0;
		}
		mesh_copy_face_attributes(m, i, kept);
		g->index[kept][0] = t[0];
		g->index[kept][1] = t[reverse ? 2 : 1];
		g->index[kept++][2] = t[reverse ? 1 : 2];
	}
	return kept;
}

static vec3 rescaled(const struct mesh *m, uint32_t i, vec3 center, double scale)
{
	return vec3_scale(scale, vec3_sub(vec3_load(m->position[i]), center));
}

int build_place_mesh(struct builder *b, struct geom_shape *g, struct mesh *m, const struct scene_node *n, vec3 center,
		     double scale)
{
	struct arena *arena = &b->w->arena;
	uint32_t vertices = m->vertex_count;
	g->vertex_count = vertices;
	/* Allocates one extra vertex, because Embree reads 16 bytes from the start of each. */
	g->position = arena_alloc(arena, (size_t)vertices + 1, sizeof *g->position);
	g->index = arena_alloc(arena, m->triangle_count, sizeof *g->index);
	g->normal = m->normal ? arena_alloc(arena, vertices, sizeof *g->normal) : NULL;
	g->uv = m->uv ? arena_alloc(arena, vertices, sizeof *g->uv) : NULL;
	if (!g->position || !g->index || (m->normal && !g->normal) || (m->uv && !g->uv))
		return build_out_of_memory(b->e);
	for (uint32_t i = 0; i < vertices; i++) {
		store_float3(g->position[i], rescaled(m, i, center, scale));
		if (g->normal)
			store_float3(g->normal[i], (vec3){m->normal[i][0], m->normal[i][1], m->normal[i][2]});
		if (g->uv) {
			g->uv[i][0] = (float)m->uv[i][0];
			g->uv[i][1] = (float)m->uv[i][1];
		}
	}
	g->triangle_count = keep_triangles(g, m, build_is_displaced(b, n));
	return 0;
}

int build_keep_unrounded(struct builder *b, struct geom_shape *g, const struct mesh *m, double min_extent)
{
	float max_extent = 0;
	for (uint32_t i = 0; i < g->triangle_count; i++)
		max_extent = fmaxf(max_extent, triangle_extent((const float(*)[3])g->position, g->index[i]));
	if (!((double)max_extent >= min_extent))
		return 0;
	g->unrounded = arena_alloc(&b->w->arena, g->vertex_count, sizeof *g->unrounded);
	if (!g->unrounded)
		return build_out_of_memory(b->e);
	for (uint32_t i = 0; i < g->vertex_count; i++)
		vec3_store(g->unrounded[i], rescaled(m, i, b->w->center, b->w->scale));
	return 0;
}
