/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A node's matrix is given, or is the product of its translation, rotation and scale. Nodes name only their children,
 * so the parents of all nodes are found at once, when first needed. Failures: rotations that are not quaternions, nodes
 * with two parents, nodes that are their own ancestors.
 */
#include "worker/render/gltf/gltf_node.h"

mat4 gltf_compose_transform(const double t[3], const double r[4], const double s[3], bool *valid)
{
	mat4 out = mat4_identity();
	double norm = r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3];
	*valid = norm > 0 && isfinite(norm);
	if (!*valid)
		return out;
	double x = r[0], y = r[1], z = r[2], w = r[3], k = 2 / norm;
	const double rotation[3][3] = {{1 - k * (y * y + z * z), k * (x * y - z * w), k * (x * z + y * w)},
				       {k * (x * y + z * w), 1 - k * (x * x + z * z), k * (y * z - x * w)},
				       {k * (x * z - y * w), k * (y * z + x * w), 1 - k * (x * x + y * y)}};
	for (int i = 0; i < 3; i++) {
		for (int j = 0; j < 3; j++)
			out.m[i][j] = rotation[i][j] * s[j];
		out.m[i][3] = t[i];
	}
	return out;
}

mat4 gltf_matrix_from_columns(const double m[16])
{
	mat4 out;
	for (int i = 0; i < 16; i++)
		out.m[i % 4][i / 4] = m[i];
	return out;
}

mat4 gltf_node_matrix(struct gltf *g, const struct gltf_entry *node)
{
	double m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, t[3] = {0}, r[4] = {0, 0, 0, 1},
	       s[3] = {1, 1, 1};
	bool valid;
	gltf_numbers(g, node, node->json, "matrix", m, 16);
	gltf_numbers(g, node, node->json, "translation", t, 3);
	gltf_numbers(g, node, node->json, "rotation", r, 4);
	gltf_numbers(g, node, node->json, "scale", s, 3);
	if (json_object_get(node->json, "matrix"))
		return gltf_matrix_from_columns(m);
	mat4 out = gltf_compose_transform(t, r, s, &valid);
	if (!valid)
		gltf_fail(g, node, EINVAL, "its rotation is not a quaternion");
	return out;
}

/* Fills g->parents. */
static bool find_parents(struct gltf *g)
{
	const json_t *nodes = json_object_get(g->root, "nodes");
	size_t count = json_array_size(nodes);
	g->parents = arena_alloc(g->arena, count + 1, sizeof *g->parents);
	if (!g->parents) {
		gltf_fail(g, NULL, ENOMEM, "out of memory");
		return false;
	}
	for (size_t i = 0; i < count; i++)
		g->parents[i] = SIZE_MAX;
	for (size_t i = 0; i < count; i++) {
		const json_t *children = json_object_get(json_array_get(nodes, i), "children");
		for (size_t k = 0; k < json_array_size(children); k++) {
			json_int_t child = json_integer_value(json_array_get(children, k));
			if (child < 0 || (size_t)child >= count)
				continue; /* reported where the node is visited */
			if (g->parents[child] != SIZE_MAX && g->parents[child] != i) {
				gltf_fail(g, &(struct gltf_entry){GLTF_NODES, (size_t)child, NULL}, EINVAL,
					  "it has two parents, and is a joint of a skin or above one");
				return false;
			}
			g->parents[child] = i;
		}
	}
	return true;
}

bool gltf_node_is_root(struct gltf *g, size_t index)
{
	return (g->parents || find_parents(g)) && g->parents[index] == SIZE_MAX;
}

bool gltf_node_to_world(struct gltf *g, uint64_t index, mat4 *to_world)
{
	struct gltf_entry node;
	*to_world = mat4_identity();
	if (!g->parents && !find_parents(g))
		return false;
	for (int depth = 0; index != SIZE_MAX; depth++) {
		if (!gltf_find_entry(g, GLTF_NODES, index, &node))
			return false;
		if (depth > GLTF_NODE_DEPTH_MAX) {
			gltf_fail(g, &node, ELOOP, "nodes are more than %d deep", GLTF_NODE_DEPTH_MAX);
			return false;
		}
		*to_world = mat4_mul(gltf_node_matrix(g, &node), *to_world);
		index = g->parents[index];
	}
	return !g->error_code;
}
