/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/smooth.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"

#include <stdlib.h>
#include <string.h>

/* Limit of the comparisons between corners: 2^28, plus the number needed if 64 triangles with different directions meet
 * at every place. */
#define COMPARISONS_MAX(corners) (((uint64_t)1 << 28) + 64 * (uint64_t)(corners))
enum { TICK_INTERVAL = 1 << 16 };

struct corner {
	double key[5];	/* position, texture coordinates */
	uint32_t index; /* 3 times the triangle, plus the corner */
};

struct smoothing {
	struct mesh *mesh;
	struct corner *corners; /* sorted; those without a new vertex come first in their place */
	double (*normal)[3];	/* unit normal of each triangle */
	double min_cosine;	/* cosine of the largest angle between normals that share a vertex */
	struct mesh out;
	uint32_t *source_vertex; /* for each vertex of `out`, the vertex of `mesh` with its attributes */
	uint64_t comparison_count;
};

static int compare_corners(const void *a, const void *b)
{
	const struct corner *x = a, *y = b;
	for (int i = 0; i < 5; i++)
		if (x->key[i] != y->key[i])
			return x->key[i] < y->key[i] ? -1 : 1;
	return x->index < y->index ? -1 : x->index > y->index;
}

static bool have_same_key(const struct corner *a, const struct corner *b)
{
	return memcmp(a->key, b->key, sizeof a->key) == 0;
}

static void gather_normals(struct smoothing *s)
{
	const struct mesh *m = s->mesh;
	for (uint32_t i = 0; i < m->triangle_count; i++) {
		const uint32_t *t = m->index[i];
		vec3 p = vec3_load(m->position[t[0]]);
		vec3_store(s->normal[i], vec3_unit_or_zero(vec3_cross(vec3_sub(vec3_load(m->position[t[1]]), p),
								      vec3_sub(vec3_load(m->position[t[2]]), p))));
		for (uint32_t k = 0; k < 3; k++) {
			struct corner *c = &s->corners[3 * (size_t)i + k];
			for (int x = 0; x < 3; x++)
				c->key[x] = m->position[t[k]][x] + 0.0; /* turns -0 into 0 */
			for (int x = 0; x < 2; x++)
				c->key[3 + x] = m->uv ? m->uv[t[k]][x] + 0.0 : 0;
			c->index = 3 * i + k;
		}
	}
	qsort(s->corners, 3 * (size_t)m->triangle_count, sizeof *s->corners, compare_corners);
}

static uint32_t original_vertex(const struct smoothing *s, const struct corner *c)
{
	return s->mesh->index[c->index / 3][c->index % 3];
}

static uint32_t add_vertex(struct smoothing *s, const struct corner *c)
{
	uint32_t v = s->out.vertex_count++;
	s->source_vertex[v] = original_vertex(s, c);
	memcpy(s->out.position[v], c->key, sizeof s->out.position[v]);
	if (s->out.uv)
		memcpy(s->out.uv[v], c->key + 3, sizeof s->out.uv[v]);
	return v;
}

static bool same_attributes(const struct mesh *m, uint32_t v, uint32_t w)
{
	for (uint32_t i = 0; i < m->attribute_count && v != w; i++) {
		const struct attribute *a = &m->attributes[i];
		if (!a->is_per_face && memcmp(a->value + (size_t)v * a->channels, a->value + (size_t)w * a->channels,
					      a->channels * sizeof *a->value) != 0)
			return false;
	}
	return true;
}

/* Copies the attributes of vertices. Those of faces stay, since triangles keep their numbers. */
static bool copy_vertex_attributes(struct smoothing *s, struct arena *arena)
{
	s->out.attribute_count = s->mesh->attribute_count;
	s->out.attributes = s->mesh->attributes;
	for (uint32_t i = 0; i < s->out.attribute_count; i++) {
		struct attribute *a = &s->out.attributes[i];
		float *value = a->is_per_face
				       ? a->value
				       : arena_alloc(arena, (size_t)s->out.vertex_count * a->channels, sizeof *value);
		if (!value)
			return false;
		for (uint32_t v = 0; !a->is_per_face && v < s->out.vertex_count; v++)
			memcpy(value + (size_t)v * a->channels, a->value + (size_t)s->source_vertex[v] * a->channels,
			       a->channels * sizeof *value);
		a->value = value;
	}
	return true;
}

static bool can_share_vertex(const struct smoothing *s, const struct corner *a, const struct corner *b)
{
	const double *x = s->normal[a->index / 3], *y = s->normal[b->index / 3];
	return (memcmp(x, y, sizeof *s->normal) == 0 || vec3_dot(vec3_load(x), vec3_load(y)) > s->min_cosine) &&
	       same_attributes(s->mesh, original_vertex(s, a), original_vertex(s, b));
}

/* Assigns vertices to the corners of one place. Returns false if there are too many comparisons. */
static bool share_vertices(struct smoothing *s, struct corner *c, size_t count)
{
	while (count > 0) {
		uint32_t v = add_vertex(s, c);
		size_t remaining = 0;
		struct corner first = *c;
		for (size_t i = 0; i < count; i++) {
			if (++s->comparison_count % TICK_INTERVAL == 0)
				liveness_tick();
			if (can_share_vertex(s, &first, &c[i]))
				s->out.index[c[i].index / 3][c[i].index % 3] = v;
			else
				c[remaining++] = c[i];
		}
		count = remaining;
		if (s->comparison_count > COMPARISONS_MAX(3 * (size_t)s->mesh->triangle_count))
			return false;
	}
	return true;
}

static bool share_all_vertices(struct smoothing *s)
{
	size_t corners = 3 * (size_t)s->mesh->triangle_count, end;
	for (size_t begin = 0; begin < corners; begin = end) {
		for (end = begin + 1; end < corners && have_same_key(&s->corners[begin], &s->corners[end]); end++)
			;
		if (!share_vertices(s, s->corners + begin, end - begin))
			return false;
	}
	return true;
}

int mesh_smooth(struct mesh *m, double degrees, struct arena *arena, const struct scene_node *n, struct error *e)
{
	uint32_t triangles = m->triangle_count;
	size_t corners = 3 * (size_t)triangles;
	struct smoothing s = {.mesh = m, .min_cosine = cos(degrees * (M_PI / 180))};
	s.corners = mem_alloc(corners, sizeof *s.corners);
	s.normal = mem_alloc(triangles, sizeof *s.normal);
	s.source_vertex = mem_alloc(corners, sizeof *s.source_vertex);
	int r = 0;
	if (!s.corners || !s.normal || !s.source_vertex ||
	    !mesh_alloc(&s.out, (uint32_t)corners, triangles, false, m->uv != NULL, arena)) {
		r = node_error(n, e, ENOMEM, "out of memory");
	} else {
		gather_normals(&s);
		s.out.vertex_count = 0;
		if (!share_all_vertices(&s))
			r = node_error(
				n, e, E2BIG,
				"max_smooth_angle: too many triangles with different directions meet at one point");
		else if (!copy_vertex_attributes(&s, arena))
			r = node_error(n, e, ENOMEM, "out of memory");
		else
			*m = s.out;
	}
	mem_free(s.corners);
	mem_free(s.normal);
	mem_free(s.source_vertex);
	return r;
}
