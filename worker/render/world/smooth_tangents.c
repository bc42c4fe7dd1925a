/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/smooth_tangents.h"

#include "worker/render/shape/mesh.h"
#include "worker/render/world/node_table.h"

#include <stdlib.h>
#include <string.h>

/* Vertices with equal keys are welded into one. */
struct weld {
	float key[8]; /* position, normal, texture coordinates */
	uint32_t vertex;
};

/* Sums at a vertex: [0] over triangles whose texture coordinates are not mirrored, as on a picture seen from
 * outside, [1] over mirrored ones. */
struct tangent_sums {
	vec3 tangent[2];
	double angle[2];
};

static vec3 load_float3(const float v[3])
{
	return (vec3){(double)v[0], (double)v[1], (double)v[2]};
}

static int compare_welds(const void *a, const void *b)
{
	const struct weld *x = a, *y = b;
	int order = memcmp(x->key, y->key, sizeof x->key);
	return order ? order : (x->vertex > y->vertex) - (x->vertex < y->vertex);
}

/* Gives equal vertices the same number. Returns how many different vertices there are, or 0 if out of memory. */
static uint32_t weld_vertices(const struct geom_shape *g, uint32_t **number, struct arena *scratch)
{
	struct weld *w = arena_alloc(scratch, g->vertex_count, sizeof *w);
	uint32_t count = 0;
	*number = arena_alloc(scratch, g->vertex_count, sizeof **number);
	if (!w || !*number)
		return 0;
	for (uint32_t i = 0; i < g->vertex_count; i++) {
		memcpy(w[i].key, g->position[i], sizeof g->position[i]);
		memcpy(w[i].key + 3, g->normal[i], sizeof g->normal[i]);
		memcpy(w[i].key + 6, g->uv[i], sizeof g->uv[i]);
		for (int k = 0; k < 8; k++)
			w[i].key[k] += 0.0f; /* turns -0 into 0 */
		w[i].vertex = i;
	}
	qsort(w, g->vertex_count, sizeof *w, compare_welds);
	for (uint32_t i = 0; i < g->vertex_count; i++) {
		count += i == 0 || memcmp(w[i].key, w[i - 1].key, sizeof w[i].key) != 0;
		(*number)[w[i].vertex] = count - 1;
	}
	return count;
}

/* Computes the direction of a triangle's dp/du, and whether its texture coordinates are mirrored.
 * Returns false if it has none. */
static bool triangle_tangent(const struct geom_shape *g, const uint32_t i[3], vec3 *tangent, bool *mirrored)
{
	const float *a = g->uv[i[0]], *b = g->uv[i[1]], *c = g->uv[i[2]];
	double du1 = (double)b[0] - (double)a[0], dv1 = (double)b[1] - (double)a[1], du2 = (double)c[0] - (double)a[0],
	       dv2 = (double)c[1] - (double)a[1], det = du1 * dv2 - dv1 * du2;
	vec3 p = load_float3(g->position[i[0]]), e1 = vec3_sub(load_float3(g->position[i[1]]), p),
	     e2 = vec3_sub(load_float3(g->position[i[2]]), p);
	*mirrored = det < 0;
	*tangent =
		vec3_unit_or_zero(vec3_scale(*mirrored ? -1 : 1, vec3_sub(vec3_scale(dv2, e1), vec3_scale(dv1, e2))));
	return det != 0 && vec3_dot(*tangent, *tangent) > 0;
}

static vec3 project_to_plane(vec3 v, vec3 n)
{
	return vec3_unit_or_zero(vec3_madd(v, -vec3_dot(v, n), n));
}

static void add_triangle(const struct geom_shape *g, const uint32_t i[3], const uint32_t *number,
			 struct tangent_sums *sums)
{
	vec3 tangent;
	bool mirrored;
	if (!triangle_tangent(g, i, &tangent, &mirrored))
		return;
	for (int k = 0; k < 3; k++) {
		vec3 n = vec3_unit_or_zero(load_float3(g->normal[i[k]])), p = load_float3(g->position[i[k]]);
		vec3 next = project_to_plane(vec3_sub(load_float3(g->position[i[(k + 1) % 3]]), p), n),
		     before = project_to_plane(vec3_sub(load_float3(g->position[i[(k + 2) % 3]]), p), n);
		struct tangent_sums *s = &sums[number[i[k]]];
		double angle = vec3_angle(next, before);
		s->tangent[mirrored] = vec3_madd(s->tangent[mirrored], angle, project_to_plane(tangent, n));
		s->angle[mirrored] += angle;
	}
}

/* Returns the tangent at a vertex; 0 where tangents cancel, as around the middle of a fan, so that only
 * rounding errors would be left. */
static vec3 vertex_tangent(const struct tangent_sums *s, int mirrored)
{
	bool is_significant = vec3_length(s->tangent[mirrored]) > 0x1p-10 * s->angle[mirrored];
	return is_significant ? vec3_unit_or_zero(s->tangent[mirrored]) : (vec3){0, 0, 0};
}

/* Computes the tangents at a triangle's corners. A triangle without a tangent of its own takes its neighbours', if all
 * three corners have a tangent of the same orientation. Returns false if there are none. */
static bool corner_tangents(const struct geom_shape *g, const uint32_t i[3], const uint32_t *number,
			    const struct tangent_sums *sums, vec3 out[3])
{
	vec3 unused;
	bool mirrored, has_own = triangle_tangent(g, i, &unused, &mirrored);
	for (int side = 0; side < 2; side++) {
		bool all = !has_own || mirrored == (side == 1);
		for (int k = 0; k < 3; k++) {
			out[k] = vertex_tangent(&sums[number[i[k]]], side);
			all = all && vec3_dot(out[k], out[k]) > 0;
		}
		if (all)
			return true;
	}
	return false;
}

static int make_tangents(struct world *w, struct geom_shape *g, struct arena *scratch)
{
	uint32_t *number, count = weld_vertices(g, &number, scratch);
	struct tangent_sums *sums = count ? arena_alloc(scratch, count, sizeof *sums) : NULL;
	g->tangent = sums ? arena_alloc(&w->arena, g->triangle_count, sizeof *g->tangent) : NULL;
	if (!g->tangent)
		return -ENOMEM;
	for (uint32_t i = 0; i < g->triangle_count; i++)
		add_triangle(g, g->index[i], number, sums);
	for (uint32_t i = 0; i < g->triangle_count; i++) {
		vec3 t[3];
		if (!corner_tangents(g, g->index[i], number, sums, t))
			continue;
		for (int k = 0; k < 3; k++) {
			g->tangent[i][k][0] = (float)t[k].x;
			g->tangent[i][k][1] = (float)t[k].y;
			g->tangent[i][k][2] = (float)t[k].z;
		}
	}
	return 0;
}

int smooth_tangents_make(struct world *w, struct arena *scratch, struct error *e)
{
	struct node_table finished; /* keyed by index array: mirrored instances have another order */
	bool begun = false;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		struct geom_shape *g = &w->shapes[i];
		uint32_t same_mesh;
		if (g->is_sphere || !g->normal || !g->uv || !w->bsdfs[w->shape_bindings[i].bsdf].uses_tangents)
			continue;
		if (!begun && node_table_init(&finished, w->shape_count, scratch))
			return error_set(e, ENOMEM, "out of memory");
		begun = true;
		if (node_table_find(&finished, g->index, NULL, &same_mesh)) {
			g->tangent = w->shapes[same_mesh].tangent;
			continue;
		}
		if (make_tangents(w, g, scratch))
			return error_set(e, ENOMEM, "out of memory for the tangents of %u triangles",
					 g->triangle_count);
		node_table_add(&finished, g->index, NULL, i);
	}
	return 0;
}
