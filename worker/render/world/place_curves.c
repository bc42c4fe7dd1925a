/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Points are rounded to float, as vertices of meshes are, and shared by the cones on both sides, so a chain has no
 * gaps; cones are computed from them whenever they are asked for.
 *
 * Failures: no memory, curves whose radii are 0 at the scale of the scene.
 */
#include "worker/render/world/place_curves.h"

#include "common/base/liveness.h"
#include "worker/render/geom/curves.h"

static bool alloc(struct curves *out, const struct curve *c, struct arena *a)
{
	uint32_t points = c->chain_points, cones = points - c->curves;
	out->open = c->spline;
	out->point = arena_alloc(a, points, sizeof *out->point);
	out->v = arena_alloc(a, points, sizeof *out->v);
	out->cone = arena_alloc(a, cones, sizeof *out->cone);
	out->start = arena_alloc(a, cones, sizeof *out->start);
	out->tangent = c->spline ? arena_alloc(a, points, sizeof *out->tangent) : NULL;
	return out->point && out->v && out->cone && out->start && (out->tangent || !c->spline);
}

static void put_point(struct curves *out, const struct world *w, const struct chain_point *p)
{
	uint32_t i = out->point_count++;
	vec3 at = vec3_scale(w->scale, vec3_sub(p->center, w->center));
	float radius = (float)(w->scale * p->radius);
	out->point[i][0] = (float)at.x;
	out->point[i][1] = (float)at.y;
	out->point[i][2] = (float)at.z;
	out->point[i][3] = radius;
	out->v[i] = (float)p->v;
	out->thickest = radius > out->thickest ? radius : out->thickest;
	if (!out->tangent)
		return;
	out->tangent[i][0] = (float)p->tangent.x;
	out->tangent[i][1] = (float)p->tangent.y;
	out->tangent[i][2] = (float)p->tangent.z;
}

static void put_chain(struct curves *out, const struct world *w, const struct chain_point *p, size_t count)
{
	for (size_t k = 0; k < count; k++) {
		put_point(out, w, &p[k]);
		if (k > 0)
			out->cone[out->count++] = (out->point_count - 2) << CURVE_SHIFT |
						  (k == 1 ? (uint32_t)CURVE_BEGINS : 0) |
						  (k == count - 1 ? (uint32_t)CURVE_ENDS : 0);
	}
}

int build_place_curves(struct builder *b, struct geom_shape *g, const struct curve *c, const struct scene_node *n)
{
	struct curves *out = arena_alloc(&b->w->arena, 1, sizeof *out);
	struct list points = {.size = sizeof(struct chain_point)};
	int rc = out && alloc(out, c, &b->w->arena) ? 0 : -ENOMEM;
	for (uint32_t i = 0; i < c->curves && !rc; i++) {
		rc = curve_chain(c, i, &points);
		if (!rc)
			put_chain(out, b->w, points.items, points.count);
		tick();
	}
	list_free(&points);
	if (rc)
		return build_out_of_memory(b->e);
	if (!(out->thickest > 0))
		return node_error(n, b->e, EINVAL, "no piece of this shape has a radius at the scale of the scene");
	curves_lay(out);
	g->curves = out;
	g->normal_sign = node_bool(n, "flip_normals", false) ? -1 : 1;
	return 0;
}
