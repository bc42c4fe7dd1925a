/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/mesh_finish.h"

#include "worker/render/shape/smooth.h"

#include <string.h>

static bool in_range(vec3 p)
{
	return fabs(p.x) <= MESH_COORDINATE_MAX && fabs(p.y) <= MESH_COORDINATE_MAX && fabs(p.z) <= MESH_COORDINATE_MAX;
}

static vec3 area_normal(const struct mesh *m, const uint32_t t[3])
{
	vec3 a = mesh_load(m->position[t[0]]), b = mesh_load(m->position[t[1]]), c = mesh_load(m->position[t[2]]);
	return vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
}

static void turn_round(uint32_t t[3])
{
	uint32_t k = t[1];
	t[1] = t[2];
	t[2] = k;
}

static int place_vertices(struct mesh *m, const struct mesh_finish *f, const struct scene_node *n, struct error *e)
{
	mat4 inverse;
	if (!mat4_invert(f->to_world, &inverse))
		return node_error(n, e, EINVAL, "to_world flattens the shape (it has no inverse)");
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		vec3 p = mat4_point(&f->to_world, mesh_load(m->position[i]));
		if (!in_range(p))
			return node_error(n, e, ERANGE, "a vertex lies beyond %g", MESH_COORDINATE_MAX);
		mesh_store(m->position[i], p);
		if (m->uv && !(fabs(m->uv[i][0]) <= MESH_UV_MAX && fabs(m->uv[i][1]) <= MESH_UV_MAX))
			return node_error(n, e, ERANGE, "a texture coordinate lies beyond %g", MESH_UV_MAX);
		if (!m->normal)
			continue;
		/* Normals become unit vectors, or 0 if missing; scaling first keeps those of tiny and huge transforms
		 * in range. */
		vec3 normal = mat4_normal(&inverse, mesh_load(m->normal[i]));
		double largest = fmax(fabs(normal.x), fmax(fabs(normal.y), fabs(normal.z)));
		normal = largest > 0 && isfinite(largest) ? vec3_normalize(vec3_scale(1 / largest, normal))
							  : (vec3){0, 0, 0};
		mesh_store(m->normal[i], vec3_is_finite(normal) ? normal : (vec3){0, 0, 0});
	}
	if (mat4_det3(f->to_world) < 0)
		for (uint32_t i = 0; i < m->triangle_count; i++)
			turn_round(m->index[i]);
	return 0;
}

static uint64_t drop_flat(struct mesh *m)
{
	uint32_t kept = 0;
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		if (vec3_length(area_normal(m, m->index[i])) > 0) {
			uint32_t t[3] = {m->index[i][0], m->index[i][1], m->index[i][2]};
			mesh_move_face(m, i, kept);
			memcpy(m->index[kept++], t, sizeof t);
		}
	}
	uint64_t dropped = m->triangle_count - kept;
	m->triangle_count = kept;
	return dropped;
}

/* Reverses triangles whose winding contradicts their normals. The normals take precedence, as for Mitsuba's emitters
 * and materials. */
static void wind_by_normals(struct mesh *m)
{
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		vec3 g = area_normal(m, m->index[i]);
		int against = 0;
		for (int k = 0; k < 3; k++)
			against += vec3_dot(g, mesh_load(m->normal[m->index[i][k]])) < 0;
		if (against == 3)
			turn_round(m->index[i]);
	}
}

static void add_corner_normals(struct mesh *m, const uint32_t t[3], const double (*given)[3])
{
	vec3 g = vec3_normalize(area_normal(m, t));
	for (int k = 0; k < 3; k++) {
		uint32_t v = t[k];
		if (given && vec3_length(mesh_load(given[v])) > 0)
			continue;
		vec3 p = mesh_load(m->position[v]);
		double angle = vec3_angle(vec3_sub(mesh_load(m->position[t[(k + 1) % 3]]), p),
					  vec3_sub(mesh_load(m->position[t[(k + 2) % 3]]), p));
		mesh_store(m->normal[v], vec3_madd(mesh_load(m->normal[v]), angle, g));
	}
}

/* Normalises sums of normals. Those of opposite triangles may cancel; then the normal of one of these triangles is
 * used. */
static void fill_cancelled(struct mesh *m)
{
	for (uint32_t i = 0; i < m->triangle_count; i++)
		for (int k = 0; k < 3; k++) {
			double *normal = m->normal[m->index[i][k]];
			vec3 v = mesh_load(normal);
			if (!(vec3_length(v) > 1e-12))
				v = vec3_normalize(area_normal(m, m->index[i]));
			mesh_store(normal, vec3_normalize(v));
		}
}

static int compute_normals(struct mesh *m, struct arena *arena, const struct scene_node *n, struct error *e)
{
	double(*given)[3] = m->normal;
	m->normal = arena_alloc(arena, m->vertex_count, sizeof *m->normal);
	if (!m->normal)
		return node_error(n, e, ENOMEM, "out of memory");
	if (given)
		memcpy(m->normal, given, m->vertex_count * sizeof *m->normal);
	for (uint32_t i = 0; i < m->triangle_count; i++)
		add_corner_normals(m, m->index[i], (const double(*)[3])given);
	fill_cancelled(m);
	return 0;
}

static bool lacks_normals(const struct mesh *m)
{
	for (uint32_t i = 0; i < m->triangle_count && m->normal; i++)
		for (int k = 0; k < 3; k++)
			if (!(vec3_length(mesh_load(m->normal[m->index[i][k]])) > 0))
				return true;
	return !m->normal;
}

int mesh_finish(struct mesh *m, const struct mesh_finish *f, struct arena *arena, uint64_t *dropped,
		const struct scene_node *n, struct error *e)
{
	int r = place_vertices(m, f, n, e);
	if (r)
		return r;
	*dropped = drop_flat(m);
	if (f->smooth_angle >= 0 && f->face_normals)
		return node_error(n, e, EINVAL, "max_smooth_angle and face_normals contradict each other");
	if (f->smooth_angle >= 0 && (r = mesh_smooth(m, f->smooth_angle, arena, n, e)))
		return r;
	if (m->normal)
		wind_by_normals(m);
	if (f->face_normals)
		m->normal = NULL;
	else if (lacks_normals(m) && (r = compute_normals(m, arena, n, e)))
		return r;
	if (f->flip_normals) {
		for (uint32_t i = 0; i < m->triangle_count; i++)
			turn_round(m->index[i]);
		for (uint32_t i = 0; i < m->vertex_count && m->normal; i++)
			mesh_store(m->normal[i], vec3_neg(mesh_load(m->normal[i])));
	}
	return 0;
}
