/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/curve_shape.h"

int curve_shape_finish(const struct scene_node *n, struct curve_points *points, struct list *rings, int rc,
		       struct arena *arena, struct shape_geometry *out, struct error *e)
{
	out->placed = out->made_here = true;
	if (!rc)
		rc = tube_mesh(rings, arena, &out->mesh);
	list_free(rings);
	curve_points_free(points);
	if (rc == -EFBIG)
		return node_error(n, e, EFBIG, "its curves make more than %d triangles", MESH_TRIANGLES_MAX);
	return rc ? node_error(n, e, -rc, "out of memory") : 0;
}

int curve_shape_chains(const struct scene_node *n, struct curve_points *points, struct arena *arena,
		       struct shape_geometry *out, struct error *e)
{
	struct list rings = {.size = sizeof(struct tube_ring)};
	double step = 1.0 / (points->count - points->curves); /* pieces */
	int rc = 0;
	for (uint32_t i = 0; i < points->curves && !rc; i++) {
		uint32_t first = points->first[i];
		rc = tube_add_chain(&rings, points->point + first, points->first[i + 1] - first, step * (first - i),
				    step);
	}
	return curve_shape_finish(n, points, &rings, rc, arena, out, e);
}
