/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes that hold others: `merge` is all that are in it, `shapegroup` is there for `instance` to refer to, which is a
 * copy of it somewhere else. They are resolved before anything is built (group.h).
 */
#include "worker/render/shape/group.h"

#include <string.h>

static const struct param none[] = {{.name = NULL}};
static const struct param instance_params[] = {{.name = "to_world", .types = VALUE_TRANSFORM}, {.name = NULL}};

const struct shape_ops shape_ops_merge = {"merge", none, NULL, 1u << PLUGIN_SHAPE};
const struct shape_ops shape_ops_shapegroup = {"shapegroup", none, NULL, 1u << PLUGIN_SHAPE};
const struct shape_ops shape_ops_instance = {"instance", instance_params, NULL, 1u << PLUGIN_SHAPE};

struct listing {
	struct arena *arena;
	const struct scene_node **nodes;
	uint32_t count, room;
	struct error *e;
};

static int out_of_memory(struct listing *l)
{
	return error_set(l->e, ENOMEM, "out of memory while listing shapes");
}

static int append(struct listing *l, const struct scene_node *n)
{
	if (l->count == SHAPES_MAX)
		return node_error(n, l->e, E2BIG, "instances make more than %d shapes of the scene", SHAPES_MAX);
	if (l->count == l->room) {
		uint32_t room = l->room ? 2 * l->room : 64;
		const struct scene_node **more = arena_alloc(l->arena, room, sizeof *more);
		if (!more)
			return out_of_memory(l);
		if (l->count)
			memcpy(more, l->nodes, l->count * sizeof *more);
		l->nodes = more;
		l->room = room;
	}
	l->nodes[l->count++] = n;
	return 0;
}

/* The shape with another to_world before its own. */
static const struct scene_node *placed(struct listing *l, const struct scene_node *n, const mat4 *place)
{
	struct scene_node *copy = arena_alloc(l->arena, 1, sizeof *copy);
	struct property *properties = arena_alloc(l->arena, (size_t)n->property_count + 1, sizeof *properties);
	if (!copy || !properties)
		return NULL;
	*copy = *n;
	copy->properties = properties;
	copy->property_count = 0;
	for (uint32_t i = 0; i < n->property_count; i++)
		if (strcmp(n->properties[i].name, "to_world") != 0)
			properties[copy->property_count++] = n->properties[i];
	properties[copy->property_count++] = (struct property){
		"to_world",
		n->line,
		{.type = VALUE_TRANSFORM, .as.transform = mat4_mul(*place, node_transform(n, "to_world"))}};
	return copy;
}

static int list(struct listing *l, const struct scene_node *n, const mat4 *place);

static int list_inside(struct listing *l, const struct scene_node *n, const mat4 *place)
{
	int rc = 0;
	for (uint32_t i = 0; i < n->child_count && !rc; i++)
		rc = list(l, n->children[i], place);
	return rc;
}

static int list_instance(struct listing *l, const struct scene_node *n, const mat4 *place)
{
	const struct scene_node *group = node_child(n, PLUGIN_SHAPE, 0);
	if (!group || node_child(n, PLUGIN_SHAPE, 1) || strcmp(group->type, "shapegroup") != 0)
		return node_error(n, l->e, EINVAL, "needs exactly one shapegroup");
	if (place)
		return node_error(n, l->e, ENOTSUP, "an instance in a shapegroup is not supported");
	mat4 m = node_transform(n, "to_world");
	return list_inside(l, group, &m);
}

static int list(struct listing *l, const struct scene_node *n, const mat4 *place)
{
	if (strcmp(n->type, "instance") == 0)
		return list_instance(l, n, place);
	if (strcmp(n->type, "merge") == 0)
		return list_inside(l, n, place);
	if (strcmp(n->type, "shapegroup") == 0)
		return node_error(n, l->e, EINVAL, "a shapegroup stands by itself or in an instance");
	const struct scene_node *it = place ? placed(l, n, place) : n;
	return it ? append(l, it) : out_of_memory(l);
}

int shape_list(const struct scene *s, struct arena *arena, const struct scene_node ***nodes, uint32_t *count,
	       struct error *e)
{
	struct listing l = {.arena = arena, .e = e};
	int rc = 0;
	for (uint32_t i = 0; i < s->object_count && !rc; i++)
		if (s->objects[i]->cls == PLUGIN_SHAPE && strcmp(s->objects[i]->type, "shapegroup") != 0)
			rc = list(&l, s->objects[i], NULL);
	*nodes = l.nodes;
	*count = l.count;
	return rc;
}
