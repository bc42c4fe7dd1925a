/* SPDX-License-Identifier: Apache-2.0 */
/* An open cylinder from p0 to p1, facing outwards. u is the angle over 2 pi, v the position between p0 and p1. */
#include "worker/render/shape/declare.h"
#include "worker/render/shape/round.h"

#include "worker/render/math/frame.h"

#include <float.h>

static vec3 point_param(const struct scene_node *n, const char *name, vec3 fallback)
{
	const struct property *p = node_find_property(n, name);
	return p ? p->value.as.point : fallback;
}

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	(void)assets;
	struct mesh *m = &out->mesh;
	vec3 p0 = point_param(n, "p0", (vec3){0, 0, 0}), p1 = point_param(n, "p1", (vec3){0, 0, 1}),
	     axis = vec3_sub(p1, p0);
	double length = vec3_length(axis), radius = node_float(n, "radius", 1) * round_radius();
	if (!(length > 0) || !(length <= MESH_COORDINATE_MAX))
		return node_error(n, e, EINVAL, "a cylinder from (%g, %g, %g) to (%g, %g, %g)", p0.x, p0.y, p0.z, p1.x,
				  p1.y, p1.z);
	if (!mesh_alloc(m, 2 * (ROUND_SEGMENTS + 1), 2 * ROUND_SEGMENTS, true, true, arena))
		return node_error(n, e, ENOMEM, "out of memory");
	struct frame f = frame_around(vec3_scale(1 / length, axis));
	for (uint32_t i = 0; i <= ROUND_SEGMENTS; i++) {
		vec3 d = frame_to_world(&f, round_direction(i));
		double u = (double)i / ROUND_SEGMENTS;
		mesh_set_vertex(m, 2 * i, vec3_madd(p0, radius, d), d, u, 0);
		mesh_set_vertex(m, 2 * i + 1, vec3_madd(p1, radius, d), d, u, 1);
	}
	for (uint32_t i = 0; i < ROUND_SEGMENTS; i++) {
		const uint32_t a = 2 * i, t[2][3] = {{a, a + 2, a + 3}, {a, a + 3, a + 1}};
		for (int k = 0; k < 6; k++)
			m->index[2 * i + (uint32_t)k / 3][k % 3] = t[k / 3][k % 3];
	}
	return 0;
}

SHAPE_OPS(cylinder, {"p0", VALUE_POINT, PARAM_UNDERSTOOD, -MESH_COORDINATE_MAX, MESH_COORDINATE_MAX, NULL},
	  {"p1", VALUE_POINT, PARAM_UNDERSTOOD, -MESH_COORDINATE_MAX, MESH_COORDINATE_MAX, NULL},
	  {"radius", VALUE_FLOAT, PARAM_UNDERSTOOD, DBL_MIN, MESH_COORDINATE_MAX, NULL}, SHAPE_PARAMS);
