/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/attribute_table.h"

#include "common/base/spelling.h"
#include "worker/render/image/srgb.h"

#include <stdio.h>
#include <string.h>

/* Describes a shape for messages: "the mesh of bunny.ply (room.xml:12)", "the rectangle in room.xml:3". */
static const char *describe_shape(const struct scene_node *shape, char *text, size_t size)
{
	const char *file = node_string(shape, "filename", NULL);
	char location[NODE_PLACE_MAX];
	node_place(shape, location);
	if (file)
		snprintf(text, size, "the mesh of %.80s (%s)", file, location);
	else
		snprintf(text, size, "the %.24s in %s", shape->type, location);
	return text;
}

static int refuse_attribute(const struct attribute_table *t, const char *name, const struct scene_node *n,
			    struct error *e)
{
	char mesh[160], hint[160] = "", known[160] = "";
	struct spelling s = {.wanted_name = name};
	for (uint32_t i = 0; i < t->count; i++) {
		spelling_offer(&s, t->attributes[i].name);
		spelling_append_to_list(known, sizeof known, t->attributes[i].name);
	}
	describe_shape(t->shape, mesh, sizeof mesh);
	if (t->count == 0)
		return node_error(n, e, EINVAL, "%s has no attribute `%s`, nor any other", mesh, name);
	return node_error(n, e, EINVAL, "%s has no attribute `%s`, only %s%s", mesh, name, known,
			  spelling_hint(&s, hint, sizeof hint));
}

const struct attribute *attribute_find(const struct attribute_table *t, const char *name, enum attribute_use use,
				       const struct scene_node *n, struct error *e)
{
	char mesh[160];
	uint32_t i = 0;
	while (i < t->count && strcmp(t->attributes[i].name, name) != 0)
		i++;
	if (i == t->count) {
		refuse_attribute(t, name, n, e);
		return NULL;
	}
	const struct attribute *a = &t->attributes[i];
	describe_shape(t->shape, mesh, sizeof mesh);
	if (use == ATTRIBUTE_COORDINATES && (a->channels != 2 || a->is_per_face)) {
		node_error(n, e, EINVAL, "`%s` of %s is not two numbers at each vertex", name, mesh);
		return NULL;
	}
	if (use == ATTRIBUTE_COLOR && a->channels == 2) {
		node_error(n, e, EINVAL, "`%s` of %s has two channels: neither a number nor a colour", name, mesh);
		return NULL;
	}
	if (a->has_invalid_value) {
		node_error(n, e, EINVAL, "`%s` of %s has a value that is not finite, or beyond 1e12", name, mesh);
		return NULL;
	}
	return a;
}

static vec3 vertex_position(const struct attribute_table *t, uint32_t i)
{
	if (t->unrounded)
		return (vec3){t->unrounded[i][0], t->unrounded[i][1], t->unrounded[i][2]};
	return (vec3){(double)t->position[i][0], (double)t->position[i][1], (double)t->position[i][2]};
}

void attribute_table_edges(const struct attribute_table *t, uint32_t triangle, vec3 edge[3])
{
	for (int k = 0; k < 3; k++) {
		uint32_t a = t->index[triangle][(k + 1) % 3], b = t->index[triangle][(k + 2) % 3];
		vec3 d = vec3_sub(vertex_position(t, b), vertex_position(t, a));
		edge[k] = vec3_madd(vec3_madd(vec3_scale(d.x, t->axis[0]), d.y, t->axis[1]), d.z, t->axis[2]);
	}
}

/* FNV-1a over 32-bit words; values with equal hashes are compared. */
static uint64_t hash_values(const float *value, size_t count)
{
	uint64_t h = 0xcbf29ce484222325;
	for (size_t i = 0; i < count; i++) {
		uint32_t bits;
		memcpy(&bits, &value[i], sizeof bits);
		h = (h ^ bits) * 0x100000001b3;
	}
	return h;
}

static void find_range(struct attribute_values *v)
{
	v->is_grey = true;
	v->min = INFINITY;
	v->max = -INFINITY;
	for (size_t i = 0; i + v->channels <= v->count; i += v->channels) {
		const float *x = v->value + i;
		for (uint32_t k = 0; k < v->channels && k < 3; k++) {
			v->min = fminf(v->min, x[k]);
			v->max = fmaxf(v->max, x[k]);
			v->is_grey = v->is_grey && x[k] == x[0];
		}
	}
}

const struct attribute_values *attribute_values_intern(struct attribute_table *t, const struct attribute *a,
						       bool decode, struct arena *arena)
{
	size_t count = (size_t)(a->is_per_face ? t->triangle_count : t->vertex_count) * a->channels;
	if (!t->probes_per_triangle)
		t->probes_per_triangle = TRIANGLE_PROBES_CORNERS;
	/* Decoding comes first, because the pool holds decoded values. */
	float *copy = NULL;
	if (decode) {
		copy = arena_alloc(arena, count, sizeof *copy);
		if (!copy)
			return NULL;
		for (size_t i = 0; i < count; i++)
			copy[i] = (float)srgb_to_linear((double)a->value[i]);
	}
	const float *source = copy ? copy : a->value;
	uint64_t hash = hash_values(source, count);
	struct attribute_values **bucket = &t->pool->bucket[hash % ATTRIBUTE_POOL_BUCKETS];
	for (struct attribute_values *v = *bucket; v; v = v->next)
		if (v->hash == hash && v->count == count && v->channels == a->channels &&
		    memcmp(v->value, source, count * sizeof *source) == 0)
			return v;
	struct attribute_values *v = arena_alloc(arena, 1, sizeof *v);
	if (v && !copy) {
		copy = arena_alloc(arena, count, sizeof *copy);
		if (copy)
			memcpy(copy, source, count * sizeof *copy);
	}
	if (!v || !copy)
		return NULL;
	*v = (struct attribute_values){*bucket, count, hash, a->channels, .value = copy};
	find_range(v);
	*bucket = v;
	return v;
}
