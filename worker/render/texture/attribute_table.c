/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/texture/attribute_table.h"

#include "common/base/spelling.h"
#include "worker/render/image/srgb.h"

#include <stdio.h>
#include <string.h>

/* Describes a shape for messages: "the mesh of bunny.ply (room.xml:12)", "the rectangle in room.xml:3". */
static const char *describe(const struct scene_node *shape, char *text, size_t size)
{
	const char *file = node_string(shape, "filename", NULL);
	char place[NODE_PLACE_MAX];
	node_place(shape, place);
	if (file)
		snprintf(text, size, "the mesh of %.80s (%s)", file, place);
	else
		snprintf(text, size, "the %.24s in %s", shape->type, place);
	return text;
}

static int none_such(const struct attribute_table *t, const char *name, const struct scene_node *n, struct error *e)
{
	char mesh[160], hint[160] = "", all[160] = "";
	struct spelling s = {.wanted = name};
	for (uint32_t i = 0; i < t->count; i++) {
		spelling_offer(&s, t->attributes[i].name);
		spelling_list(all, sizeof all, t->attributes[i].name);
	}
	describe(t->shape, mesh, sizeof mesh);
	if (t->count == 0)
		return node_error(n, e, EINVAL, "%s has no attribute `%s`, nor any other", mesh, name);
	return node_error(n, e, EINVAL, "%s has no attribute `%s`, only %s%s", mesh, name, all,
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
		none_such(t, name, n, e);
		return NULL;
	}
	const struct attribute *a = &t->attributes[i];
	describe(t->shape, mesh, sizeof mesh);
	if (use == ATTRIBUTE_COORDINATES && (a->channels != 2 || a->per_face)) {
		node_error(n, e, EINVAL, "`%s` of %s is not two numbers at each vertex", name, mesh);
		return NULL;
	}
	if (use == ATTRIBUTE_COLOR && a->channels == 2) {
		node_error(n, e, EINVAL, "`%s` of %s has two channels: neither a number nor a colour", name, mesh);
		return NULL;
	}
	if (a->damaged) {
		node_error(n, e, EINVAL, "`%s` of %s has a value that is not finite, or beyond 1e12", name, mesh);
		return NULL;
	}
	return a;
}

static vec3 vertex(const struct attribute_table *t, uint32_t i)
{
	if (t->unrounded)
		return (vec3){t->unrounded[i][0], t->unrounded[i][1], t->unrounded[i][2]};
	return (vec3){(double)t->position[i][0], (double)t->position[i][1], (double)t->position[i][2]};
}

void attribute_table_sides(const struct attribute_table *t, uint32_t triangle, vec3 side[3])
{
	for (int k = 0; k < 3; k++) {
		uint32_t a = t->index[triangle][(k + 1) % 3], b = t->index[triangle][(k + 2) % 3];
		vec3 d = vec3_sub(vertex(t, b), vertex(t, a));
		side[k] = vec3_madd(vec3_madd(vec3_scale(d.x, t->axis[0]), d.y, t->axis[1]), d.z, t->axis[2]);
	}
}

/* FNV-1a over 32-bit words; values with equal hashes are compared. */
static uint64_t hash_of(const float *value, size_t count)
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
	v->grey = true;
	v->least = INFINITY;
	v->most = -INFINITY;
	for (size_t i = 0; i + v->channels <= v->count; i += v->channels) {
		const float *x = v->value + i;
		for (uint32_t k = 0; k < v->channels && k < 3; k++) {
			v->least = fminf(v->least, x[k]);
			v->most = fmaxf(v->most, x[k]);
			v->grey = v->grey && x[k] == x[0];
		}
	}
}

const struct attribute_values *attribute_keep(struct attribute_table *t, const struct attribute *a, bool decode,
					      struct arena *arena)
{
	size_t count = (size_t)(a->per_face ? t->triangle_count : t->vertex_count) * a->channels;
	if (!t->asked)
		t->asked = ASKED_ATTRIBUTES;
	/* Decoding comes first, because the pool holds decoded values. */
	float *own = NULL;
	if (decode) {
		own = arena_alloc(arena, count, sizeof *own);
		if (!own)
			return NULL;
		for (size_t i = 0; i < count; i++)
			own[i] = (float)srgb_to_linear((double)a->value[i]);
	}
	const float *from = own ? own : a->value;
	uint64_t hash = hash_of(from, count);
	struct attribute_values **first = &t->pool->first[hash % ATTRIBUTE_POOL_LISTS];
	for (struct attribute_values *v = *first; v; v = v->next)
		if (v->hash == hash && v->count == count && v->channels == a->channels &&
		    memcmp(v->value, from, count * sizeof *from) == 0)
			return v;
	struct attribute_values *v = arena_alloc(arena, 1, sizeof *v);
	if (v && !own) {
		own = arena_alloc(arena, count, sizeof *own);
		if (own)
			memcpy(own, from, count * sizeof *own);
	}
	if (!v || !own)
		return NULL;
	*v = (struct attribute_values){*first, count, hash, a->channels, .value = own};
	find_range(v);
	*first = v;
	return v;
}
