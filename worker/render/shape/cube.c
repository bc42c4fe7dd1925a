/* SPDX-License-Identifier: Apache-2.0 */
/* A cube from -1 to 1 in each direction. */
#include "worker/render/shape/declare.h"
#include "worker/render/shape/mesh.h"

/* The normal of each face, and its directions of u and v, as on Mitsuba's cube. Some faces are left-handed: mesh_finish
 * winds triangles by their normals. */
static const struct face {
	vec3 n, u, v;
} faces[6] = {
	{{0, -1, 0}, {0, 0, 1}, {1, 0, 0}}, {{0, 1, 0}, {-1, 0, 0}, {0, 0, -1}}, {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
	{{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},  {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},	 {{0, 0, -1}, {0, -1, 0}, {1, 0, 0}},
};

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	(void)assets;
	struct mesh *m = &out->mesh;
	if (!mesh_alloc(m, 24, 12, true, true, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	for (uint32_t f = 0; f < 6; f++) {
		const struct face *face = &faces[f];
		for (uint32_t i = 0; i < 4; i++) {
			const double *c = mesh_quad_corners[i];
			vec3 p = vec3_madd(vec3_madd(face->n, 2 * c[0] - 1, face->u), 2 * c[1] - 1, face->v);
			mesh_set_vertex(m, 4 * f + i, p, face->n, c[0], c[1]);
		}
		mesh_set_quad(m, 2 * f, 4 * f);
	}
	return 0;
}

SHAPE_OPS(cube, {"face_normals", IGNORED}, SHAPE_PARAMS);
