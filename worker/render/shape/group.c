/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes that contain others: `merge` stands for its contents; a `shapegroup` is not rendered itself, but referred to
 * by `instance`, which places its contents elsewhere. All of them are resolved before shapes are built (group.h).
 */
#include "worker/render/shape/group.h"

#include "worker/render/scene/report.h"

#include <stdlib.h>
#include <string.h>

const struct shape_ops shape_ops_merge = {{PLUGIN_SHAPE, "merge", NULL, 1u << PLUGIN_SHAPE, PARAM_UNDERSTOOD}, NULL};
const struct shape_ops shape_ops_shapegroup = {{PLUGIN_SHAPE, "shapegroup", NULL, 1u << PLUGIN_SHAPE, PARAM_UNDERSTOOD},
					       NULL};
const struct shape_ops shape_ops_instance = {{PLUGIN_SHAPE, "instance",
					      PARAMS({.name = "to_world", .types = VALUE_PLACE}), 1u << PLUGIN_SHAPE,
					      PARAM_UNDERSTOOD},
					     NULL};

struct listing {
	struct arena *arena;
	struct listed_shape *shapes;
	uint32_t count, room;
	double open, close;	       /* times of the shutter */
	const struct animation *moves; /* motion of the instance that is being listed */
	struct report *found;
	struct error *e;
};

static int out_of_memory(struct listing *l)
{
	return error_set(l->e, ENOMEM, "out of memory while listing shapes");
}

static const struct scene_node *placed_at(const struct scene_node *n, mat4 place, struct arena *arena)
{
	return node_with(n, "to_world", (struct value){.type = VALUE_TRANSFORM, .as.transform = place}, arena);
}

/* Replaces a moving node by a still one at its position when the shutter opens. *moves: its motion while the shutter is
 * open; NULL if it does not move then. */
static int stop(struct listing *l, const struct scene_node **n, const struct animation **moves)
{
	const struct animation *a = node_animation(*n);
	struct motion m;
	*moves = NULL;
	if (!a)
		return 0;
	struct motion_key *room = arena_alloc(l->arena, a->count, sizeof *room);
	if (!room)
		return out_of_memory(l);
	if (motion_make(&m, a, l->open, l->close, room))
		*moves = a;
	*n = placed_at(*n, motion_at(&m, 0), l->arena);
	return *n ? 0 : out_of_memory(l);
}

static int append(struct listing *l, const struct scene_node *n, const struct scene_node *instance)
{
	const struct animation *moves = l->moves;
	if (instance && node_animation(n))
		return node_error(n, l->e, ENOTSUP, "motion of a shape in a shapegroup is not supported");
	int rc = instance ? 0 : stop(l, &n, &moves);
	if (rc)
		return rc;
	if (l->count == SHAPES_MAX)
		return node_error(n, l->e, E2BIG, "the scene, including its instances, has more than %d shapes",
				  SHAPES_MAX);
	if (l->count == l->room) {
		uint32_t room = l->room ? 2 * l->room : 64;
		struct listed_shape *more = arena_alloc(l->arena, room, sizeof *more);
		if (!more)
			return out_of_memory(l);
		if (l->count)
			memcpy(more, l->shapes, l->count * sizeof *more);
		l->shapes = more;
		l->room = room;
	}
	l->shapes[l->count] = (struct listed_shape){n, instance, moves, l->count, 1};
	l->count++;
	return 0;
}

static int list(struct listing *l, const struct scene_node *n, const struct scene_node *instance);

/* Handles the result of listing one object: reports an error if problems are collected. Returns 0 to continue with the
 * next object, or the code. */
static int go_on(struct listing *l, int code)
{
	return l->found && code != -E2BIG ? report_problem_once(l->found, code, l->e) : code;
}

static int list_inside(struct listing *l, const struct scene_node *n, const struct scene_node *instance)
{
	int rc = 0;
	for (uint32_t i = 0; i < n->child_count && !rc; i++)
		rc = go_on(l, list(l, n->children[i], instance));
	return rc;
}

static int list_instance(struct listing *l, const struct scene_node *n, const struct scene_node *outer)
{
	const struct scene_node *group = node_child(n, PLUGIN_SHAPE, 0);
	if (!group || node_child(n, PLUGIN_SHAPE, 1) || strcmp(group->type, "shapegroup") != 0)
		return node_error(n, l->e, EINVAL, "needs exactly one shapegroup");
	if (outer)
		return node_error(n, l->e, ENOTSUP, "an instance in a shapegroup is not supported");
	mat4 inverse;
	if (!mat4_invert(node_transform(n, "to_world"), &inverse))
		return node_error(n, l->e, EINVAL, "to_world flattens the shapegroup (it has no inverse)");
	int rc = stop(l, &n, &l->moves);
	if (!rc)
		rc = list_inside(l, group, n);
	l->moves = NULL;
	return rc;
}

static int list(struct listing *l, const struct scene_node *n, const struct scene_node *instance)
{
	if (strcmp(n->type, "instance") == 0)
		return list_instance(l, n, instance);
	if (strcmp(n->type, "merge") == 0)
		return list_inside(l, n, instance);
	if (strcmp(n->type, "shapegroup") == 0)
		return node_error(n, l->e, EINVAL, "a shapegroup may stand directly in <scene> or in an instance only");
	return append(l, n, instance);
}

/* A node, and its position in the list. */
struct node_use {
	uintptr_t node;
	uint32_t at;
};

static int compare_uses(const void *x, const void *y)
{
	const struct node_use *a = x, *b = y;
	if (a->node != b->node)
		return a->node < b->node ? -1 : 1;
	return a->at < b->at ? -1 : a->at > b->at;
}

/* Finds the shapes that instantiate the same node. Addresses do not affect the result, since of equal nodes the first
 * in the list is recorded. */
static int find_uses(struct listing *l)
{
	uint32_t n = 0;
	struct node_use *uses = arena_alloc(l->arena, l->count, sizeof *uses);
	if (!uses)
		return out_of_memory(l);
	for (uint32_t i = 0; i < l->count; i++)
		if (l->shapes[i].instance)
			uses[n++] = (struct node_use){(uintptr_t)l->shapes[i].node, i};
	if (n > 0)
		qsort(uses, n, sizeof *uses, compare_uses);
	for (uint32_t i = 0, end; i < n; i = end) {
		for (end = i + 1; end < n && uses[end].node == uses[i].node;)
			end++;
		for (uint32_t k = i; k < end; k++) {
			l->shapes[uses[k].at].first = uses[i].at;
			l->shapes[uses[k].at].uses = end - i;
		}
	}
	return 0;
}

int shape_list(const struct scene *s, double open, double close, struct arena *arena, struct report *found,
	       struct listed_shape **shapes, uint32_t *count, struct error *e)
{
	struct listing l = {.arena = arena, .open = open, .close = close, .found = found, .e = e};
	int rc = 0;
	for (uint32_t i = 0; i < s->object_count && !rc; i++)
		if (s->objects[i]->cls == PLUGIN_SHAPE && strcmp(s->objects[i]->type, "shapegroup") != 0)
			rc = go_on(&l, list(&l, s->objects[i], NULL));
	if (!rc)
		rc = find_uses(&l);
	*shapes = l.shapes;
	*count = l.count;
	return rc;
}

const struct scene_node *shape_placed(const struct listed_shape *s, struct arena *arena)
{
	const struct scene_node *n = s->node;
	if (!s->instance)
		return n;
	mat4 place = node_transform(s->instance, "to_world");
	return placed_at(n, mat4_mul(place, node_transform(n, "to_world")), arena);
}
