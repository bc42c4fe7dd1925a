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
					      PARAMS({.name = "to_world", .types = VALUE_TRANSFORM_OR_ANIMATION}),
					      1u << PLUGIN_SHAPE, PARAM_UNDERSTOOD},
					     NULL};

struct shape_listing {
	struct arena *arena;
	struct listed_shape *shapes;
	uint32_t count, capacity;
	double open, close;		   /* times of the shutter */
	const struct animation *animation; /* motion of the instance that is being listed */
	struct report *report;
	struct error *e;
};

static int out_of_memory(struct shape_listing *l)
{
	return error_set(l->e, ENOMEM, "out of memory while listing shapes");
}

static const struct scene_node *node_placed_at(const struct scene_node *n, mat4 to_world, struct arena *arena)
{
	return node_copy_with_property(n, "to_world", (struct value){.type = VALUE_TRANSFORM, .as.transform = to_world},
				       arena);
}

/* Replaces a moving node by a still one at its position when the shutter opens. *animation: its motion while the
 * shutter is open; NULL if it does not move then. */
static int freeze_motion(struct shape_listing *l, const struct scene_node **n, const struct animation **animation)
{
	const struct animation *a = node_animation(*n);
	struct motion m;
	*animation = NULL;
	if (!a)
		return 0;
	struct motion_key *keys = arena_alloc(l->arena, a->count, sizeof *keys);
	if (!keys)
		return out_of_memory(l);
	if (motion_make(&m, a, l->open, l->close, keys))
		*animation = a;
	*n = node_placed_at(*n, motion_transform_at(&m, 0), l->arena);
	return *n ? 0 : out_of_memory(l);
}

static int append_shape(struct shape_listing *l, const struct scene_node *n, const struct scene_node *instance)
{
	const struct animation *animation = l->animation;
	if (instance && node_animation(n))
		return node_error(n, l->e, ENOTSUP, "motion of a shape in a shapegroup is not supported");
	int rc = instance ? 0 : freeze_motion(l, &n, &animation);
	if (rc)
		return rc;
	if (l->count == SHAPES_MAX)
		return node_error(n, l->e, E2BIG, "the scene, including its instances, has more than %d shapes",
				  SHAPES_MAX);
	if (l->count == l->capacity) {
		uint32_t capacity = l->capacity ? 2 * l->capacity : 64;
		struct listed_shape *grown = arena_alloc(l->arena, capacity, sizeof *grown);
		if (!grown)
			return out_of_memory(l);
		if (l->count)
			memcpy(grown, l->shapes, l->count * sizeof *grown);
		l->shapes = grown;
		l->capacity = capacity;
	}
	l->shapes[l->count] = (struct listed_shape){n, instance, animation, l->count, 1};
	l->count++;
	return 0;
}

static int list_node(struct shape_listing *l, const struct scene_node *n, const struct scene_node *instance);

/* Handles the result of listing one object: reports an error if problems are collected. Returns 0 to continue with the
 * next object, or the code. */
static int handle_result(struct shape_listing *l, int code)
{
	return l->report && code != -E2BIG ? report_problem_once(l->report, code, l->e) : code;
}

static int list_children(struct shape_listing *l, const struct scene_node *n, const struct scene_node *instance)
{
	int rc = 0;
	for (uint32_t i = 0; i < n->child_count && !rc; i++)
		rc = handle_result(l, list_node(l, n->children[i], instance));
	return rc;
}

static int list_instance(struct shape_listing *l, const struct scene_node *n, const struct scene_node *outer)
{
	const struct scene_node *group = node_child(n, PLUGIN_SHAPE, 0);
	if (!group || node_child(n, PLUGIN_SHAPE, 1) || strcmp(group->type, "shapegroup") != 0)
		return node_error(n, l->e, EINVAL, "needs exactly one shapegroup");
	if (outer)
		return node_error(n, l->e, ENOTSUP, "an instance in a shapegroup is not supported");
	mat4 inverse;
	if (!mat4_invert(node_transform(n, "to_world"), &inverse))
		return node_error(n, l->e, EINVAL, "to_world flattens the shapegroup (it has no inverse)");
	int rc = freeze_motion(l, &n, &l->animation);
	if (!rc)
		rc = list_children(l, group, n);
	l->animation = NULL;
	return rc;
}

static int list_node(struct shape_listing *l, const struct scene_node *n, const struct scene_node *instance)
{
	if (strcmp(n->type, "instance") == 0)
		return list_instance(l, n, instance);
	if (strcmp(n->type, "merge") == 0)
		return list_children(l, n, instance);
	if (strcmp(n->type, "shapegroup") == 0)
		return node_error(n, l->e, EINVAL, "a shapegroup may stand directly in <scene> or in an instance only");
	return append_shape(l, n, instance);
}

/* A node, and its position in the list. */
struct node_use {
	uintptr_t node;
	uint32_t index;
};

static int compare_uses(const void *x, const void *y)
{
	const struct node_use *a = x, *b = y;
	if (a->node != b->node)
		return a->node < b->node ? -1 : 1;
	return a->index < b->index ? -1 : a->index > b->index;
}

/* Finds the shapes that instantiate the same node. Addresses do not affect the result, since of equal nodes the first
 * in the list is recorded. */
static int find_uses(struct shape_listing *l)
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
			l->shapes[uses[k].index].first_use = uses[i].index;
			l->shapes[uses[k].index].use_count = end - i;
		}
	}
	return 0;
}

int shape_list_make(const struct scene *s, double open, double close, struct arena *arena, struct report *report,
		    struct listed_shape **shapes, uint32_t *count, struct error *e)
{
	struct shape_listing l = {.arena = arena, .open = open, .close = close, .report = report, .e = e};
	int rc = 0;
	for (uint32_t i = 0; i < s->object_count && !rc; i++)
		if (s->objects[i]->cls == PLUGIN_SHAPE && strcmp(s->objects[i]->type, "shapegroup") != 0)
			rc = handle_result(&l, list_node(&l, s->objects[i], NULL));
	if (!rc)
		rc = find_uses(&l);
	*shapes = l.shapes;
	*count = l.count;
	return rc;
}

const struct scene_node *shape_placed_node(const struct listed_shape *s, struct arena *arena)
{
	const struct scene_node *n = s->node;
	if (!s->instance)
		return n;
	mat4 instance_to_world = node_transform(s->instance, "to_world");
	return node_placed_at(n, mat4_mul(instance_to_world, node_transform(n, "to_world")), arena);
}
