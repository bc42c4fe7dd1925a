/* SPDX-License-Identifier: Apache-2.0 */
/* The unit disk in x and y, facing +z. As in Mitsuba, u is the distance from the centre, and v the angle over 2 pi. */
#include "worker/render/shape/declare.h"
#include "worker/render/shape/round.h"

/* Each triangle has its own vertex at the centre, because v there differs between triangles. */
static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	(void)assets;
	enum { RIM_VERTICES = ROUND_SEGMENTS + 1 };
	struct mesh *m = &out->mesh;
	if (!mesh_alloc(m, RIM_VERTICES + ROUND_SEGMENTS, ROUND_SEGMENTS, true, true, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	const vec3 up = {0, 0, 1};
	double radius = round_radius();
	for (uint32_t i = 0; i < RIM_VERTICES; i++)
		mesh_set_vertex(m, i, vec3_scale(radius, round_direction(i)), up, 1, (double)i / ROUND_SEGMENTS);
	for (uint32_t i = 0; i < ROUND_SEGMENTS; i++) {
		mesh_set_vertex(m, RIM_VERTICES + i, (vec3){0, 0, 0}, up, 0, (i + 0.5) / ROUND_SEGMENTS);
		m->index[i][0] = RIM_VERTICES + i;
		m->index[i][1] = i;
		m->index[i][2] = i + 1;
	}
	return 0;
}

SHAPE_OPS(disk, SHAPE_PARAMS);
