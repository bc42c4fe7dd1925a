/* SPDX-License-Identifier: Apache-2.0 */
/* A square from -1 to 1 in x and y, facing +z. */
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	(void)assets;
	struct mesh *m = &out->mesh;
	if (!mesh_alloc(m, 4, 2, true, true, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	for (uint32_t i = 0; i < 4; i++) {
		double u = mesh_quad_corners[i][0], v = mesh_quad_corners[i][1];
		mesh_set_vertex(m, i, (vec3){2 * u - 1, 2 * v - 1, 0}, (vec3){0, 0, 1}, u, v);
	}
	mesh_set_quad(m, 0, 0);
	return 0;
}

SHAPE_OPS(rectangle, {"face_normals", IGNORED}, SHAPE_PARAMS);
