/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/math/point_tree.h"

typedef struct point_tree_node node;

static void swap_nodes(node *a, node *b)
{
	node t = *a;
	*a = *b;
	*b = t;
}

/* Quickselect (Hoare 1961, Algorithm 65). */
void point_tree_partition(node *nodes, size_t count, size_t middle, unsigned axis)
{
	size_t low = 0, high = count - 1;
	while (low < high) {
		double pivot = vec3_component(nodes[low + (high - low) / 2].p, axis);
		size_t i = low, j = high;
		for (;;) {
			while (vec3_component(nodes[i].p, axis) < pivot)
				i++;
			while (vec3_component(nodes[j].p, axis) > pivot)
				j--;
			if (i >= j)
				break;
			swap_nodes(&nodes[i++], &nodes[j--]);
		}
		if (middle <= j)
			high = j;
		else
			low = j + 1;
	}
}

/* Builds a subtree. The axis changes from level to level; the middle node of a range divides it. */
static void build_subtree(node *nodes, size_t count, unsigned axis)
{
	while (count > 1) {
		size_t middle = count / 2;
		point_tree_partition(nodes, count, middle, axis);
		axis = (axis + 1) % 3;
		build_subtree(nodes, middle, axis);
		nodes += middle + 1;
		count -= middle + 1;
	}
}

void point_tree_build(struct point_tree *t)
{
	build_subtree(t->nodes, t->count, 0);
}

struct range_search {
	vec3 center;
	double radius;
	void (*visit)(void *user, uint32_t id);
	void *user;
};

static void search_subtree(const struct range_search *s, const node *nodes, size_t count, unsigned axis)
{
	while (count > 0) {
		size_t middle = count / 2;
		const node *m = &nodes[middle];
		vec3 d = vec3_sub(m->p, s->center);
		double across = vec3_component(d, axis);
		if (vec3_dot(d, d) <= s->radius * s->radius)
			s->visit(s->user, m->id);
		axis = (axis + 1) % 3;
		if (across >= -s->radius)
			search_subtree(s, nodes, middle, axis);
		if (across > s->radius)
			return;
		nodes += middle + 1;
		count -= middle + 1;
	}
}

void point_tree_visit_within(const struct point_tree *t, vec3 center, double radius,
			     void (*visit)(void *user, uint32_t id), void *user)
{
	const struct range_search s = {center, radius, visit, user};
	search_subtree(&s, t->nodes, t->count, 0);
}
