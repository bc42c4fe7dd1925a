/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/mesh_finish.h"

#include "worker/render/shape/smooth.h"

#include <string.h>

static bool is_in_range(vec3 p)
{
	return fabs(p.x) <= MESH_COORDINATE_MAX && fabs(p.y) <= MESH_COORDINATE_MAX && fabs(p.z) <= MESH_COORDINATE_MAX;
}

static vec3 area_normal(const struct mesh *m, const uint32_t t[3])
{
	vec3 a = vec3_load(m->position[t[0]]), b = vec3_load(m->position[t[1]]), c = vec3_load(m->position[t[2]]);
	return vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
}

static void reverse_winding(uint32_t t[3])
{
	uint32_t k = t[1];
	t[1] = t[2];
	t[2] = k;
}

static int transform_vertices(struct mesh *m, const struct mesh_finish_options *f, const struct scene_node *n,
			      struct error *e)
{
	mat4 inverse;
	if (!mat4_invert(f->to_world, &inverse))
		return node_error(n, e, EINVAL, "to_world flattens the shape (it has no inverse)");
	for (uint32_t i = 0; i < m->vertex_count; i++) {
		vec3 p = mat4_point(&f->to_world, vec3_load(m->position[i]));
		if (!is_in_range(p))
			return node_error(n, e, ERANGE, "a vertex lies beyond %g", MESH_COORDINATE_MAX);
		vec3_store(m->position[i], p);
		if (m->uv && !(fabs(m->uv[i][0]) <= MESH_UV_MAX && fabs(m->uv[i][1]) <= MESH_UV_MAX))
			return node_error(n, e, ERANGE, "a texture coordinate lies beyond %g", MESH_UV_MAX);
		if (!m->normal)
			continue;
		/* Normals become unit vectors, or 0 if missing; scaling first keeps those of tiny and huge transforms
		 * in range. */
		vec3 normal = mat4_normal(&inverse, vec3_load(m->normal[i]));
		double largest = fmax(fabs(normal.x), fmax(fabs(normal.y), fabs(normal.z)));
		normal = largest > 0 && isfinite(largest) ? vec3_normalize(vec3_scale(1 / largest, normal))
							  : (vec3){0, 0, 0};
		vec3_store(m->normal[i], vec3_is_finite(normal) ? normal : (vec3){0, 0, 0});
	}
	if (mat4_det3(f->to_world) < 0)
		for (uint32_t i = 0; i < m->triangle_count; i++)
			reverse_winding(m->index[i]);
	return 0;
}

static uint64_t drop_degenerate(struct mesh *m)
{
	uint32_t kept = 0;
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		if (vec3_length(area_normal(m, m->index[i])) > 0) {
			uint32_t t[3] = {m->index[i][0], m->index[i][1], m->index[i][2]};
			mesh_copy_face_attributes(m, i, kept);
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
		int opposed = 0;
		for (int k = 0; k < 3; k++)
			opposed += vec3_dot(g, vec3_load(m->normal[m->index[i][k]])) < 0;
		if (opposed == 3)
			reverse_winding(m->index[i]);
	}
}

static void add_corner_normals(struct mesh *m, const uint32_t t[3], const double (*file_normals)[3])
{
	vec3 g = vec3_normalize(area_normal(m, t));
	for (int k = 0; k < 3; k++) {
		uint32_t v = t[k];
		if (file_normals && vec3_length(vec3_load(file_normals[v])) > 0)
			continue;
		vec3 p = vec3_load(m->position[v]);
		double angle = vec3_angle(vec3_sub(vec3_load(m->position[t[(k + 1) % 3]]), p),
					  vec3_sub(vec3_load(m->position[t[(k + 2) % 3]]), p));
		vec3_store(m->normal[v], vec3_madd(vec3_load(m->normal[v]), angle, g));
	}
}

/* Normalises sums of normals. Those of opposite triangles may cancel; then the normal of one of these triangles is
 * used. */
static void normalize_normals(struct mesh *m)
{
	for (uint32_t i = 0; i < m->triangle_count; i++)
		for (int k = 0; k < 3; k++) {
			double *normal = m->normal[m->index[i][k]];
			vec3 v = vec3_load(normal);
			if (!(vec3_length(v) > 1e-12))
				v = vec3_normalize(area_normal(m, m->index[i]));
			vec3_store(normal, vec3_normalize(v));
		}
}

static int compute_normals(struct mesh *m, struct arena *arena, const struct scene_node *n, struct error *e)
{
	double(*file_normals)[3] = m->normal;
	m->normal = arena_alloc(arena, m->vertex_count, sizeof *m->normal);
	if (!m->normal)
		return node_error(n, e, ENOMEM, "out of memory");
	if (file_normals)
		memcpy(m->normal, file_normals, m->vertex_count * sizeof *m->normal);
	for (uint32_t i = 0; i < m->triangle_count; i++)
		add_corner_normals(m, m->index[i], (const double(*)[3])file_normals);
	normalize_normals(m);
	return 0;
}

static bool lacks_normals(const struct mesh *m)
{
	for (uint32_t i = 0; i < m->triangle_count && m->normal; i++)
		for (int k = 0; k < 3; k++)
			if (!(vec3_length(vec3_load(m->normal[m->index[i][k]])) > 0))
				return true;
	return !m->normal;
}

int mesh_finish(struct mesh *m, const struct mesh_finish_options *f, struct arena *arena, uint64_t *dropped,
		const struct scene_node *n, struct error *e)
{
	int r = transform_vertices(m, f, n, e);
	if (r)
		return r;
	*dropped = drop_degenerate(m);
	if (f->max_smooth_angle >= 0 && f->has_face_normals)
		return node_error(n, e, EINVAL, "max_smooth_angle and face_normals contradict each other");
	if (f->max_smooth_angle >= 0 && (r = mesh_smooth(m, f->max_smooth_angle, arena, n, e)))
		return r;
	if (m->normal)
		wind_by_normals(m);
	if (f->has_face_normals)
		m->normal = NULL;
	else if (lacks_normals(m) && (r = compute_normals(m, arena, n, e)))
		return r;
	if (f->flips_normals) {
		for (uint32_t i = 0; i < m->triangle_count; i++)
			reverse_winding(m->index[i]);
		for (uint32_t i = 0; i < m->vertex_count && m->normal; i++)
			vec3_store(m->normal[i], vec3_neg(vec3_load(m->normal[i])));
	}
	return 0;
}
