/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/mesh.h"

#include <stdio.h>
#include <string.h>

vec3 vec3_unit_or_zero(vec3 v)
{
	if (!vec3_is_finite(v))
		return (vec3){0, 0, 0};
	double largest = fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
	return largest > 0 ? vec3_normalize((vec3){v.x / largest, v.y / largest, v.z / largest}) : v;
}

void mesh_set_normal(struct mesh *m, uint32_t i, vec3 normal)
{
	m->invalid_normal_count += !vec3_is_finite(normal);
	vec3_store(m->normal[i], vec3_unit_or_zero(normal));
}

int mesh_open_file(const struct scene_node *n, const struct asset_source *assets, struct asset *a, struct error *e)
{
	const char *name = node_string(n, "filename", NULL);
	if (!name)
		return node_error(n, e, EINVAL, "needs a filename");
	struct error inner;
	int r = assets->open(assets->user, name, a, &inner);
	return r ? node_error(n, e, -r, "%s", inner.text) : 0;
}

bool mesh_alloc(struct mesh *m, uint32_t vertices, uint32_t triangles, bool normals, bool uv, struct arena *arena)
{
	*m = (struct mesh){.vertex_count = vertices, .triangle_count = triangles};
	m->position = arena_alloc(arena, vertices, sizeof *m->position);
	m->index = arena_alloc(arena, triangles, sizeof *m->index);
	m->normal = normals ? arena_alloc(arena, vertices, sizeof *m->normal) : NULL;
	m->uv = uv ? arena_alloc(arena, vertices, sizeof *m->uv) : NULL;
	return m->position && m->index && (m->normal || !normals) && (m->uv || !uv);
}

struct attribute *mesh_add_attribute(struct mesh *m, const char *name, bool per_face, uint32_t channels,
				     uint32_t capacity, struct arena *arena)
{
	size_t items = per_face ? m->triangle_count : m->vertex_count;
	if (!m->attributes)
		m->attributes = arena_alloc(arena, capacity, sizeof *m->attributes);
	float *value = arena_alloc(arena, items * channels, sizeof *value);
	if (!m->attributes || !value)
		return NULL;
	struct attribute *a = &m->attributes[m->attribute_count++];
	*a = (struct attribute){.is_per_face = per_face, .channels = channels, .value = value};
	snprintf(a->name, sizeof a->name, "%s", name);
	return a;
}

void mesh_set_attribute(struct attribute *a, size_t item, uint32_t channel, double x)
{
	bool in_range = isfinite(x) && fabs(x) <= MESH_ATTRIBUTE_MAX;
	a->has_invalid_value |= !in_range;
	a->value[item * a->channels + channel] = in_range ? (float)x : 0;
}

void mesh_copy_face_attributes(struct mesh *m, uint32_t source, uint32_t target)
{
	for (uint32_t i = 0; i < m->attribute_count && source != target; i++) {
		const struct attribute *a = &m->attributes[i];
		if (a->is_per_face)
			memcpy(a->value + (size_t)target * a->channels, a->value + (size_t)source * a->channels,
			       a->channels * sizeof *a->value);
	}
}

void mesh_set_vertex(struct mesh *m, uint32_t i, vec3 p, vec3 n, double u, double v)
{
	vec3_store(m->position[i], p);
	vec3_store(m->normal[i], n);
	m->uv[i][0] = u;
	m->uv[i][1] = v;
}

const double mesh_quad_corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

void mesh_set_quad(struct mesh *m, uint32_t triangle, uint32_t first)
{
	memcpy(m->index[triangle], (uint32_t[3]){first, first + 1, first + 2}, sizeof m->index[0]);
	memcpy(m->index[triangle + 1], (uint32_t[3]){first, first + 2, first + 3}, sizeof m->index[0]);
}
