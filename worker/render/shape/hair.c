/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `hair` of Mitsuba 0.6: straight pieces of one radius, which to_world scales like its z axis. Joints are rounded,
 * where Mitsuba has mitres, and ends are closed. angle_threshold, by which Mitsuba merges almost straight pieces to
 * save time, has no effect.
 */
#include "worker/render/shape/curve_file.h"
#include "worker/render/shape/curve_shape.h"
#include "worker/render/shape/declare.h"

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct curve_points points;
	mat4 to_world = node_transform(n, "to_world");
	if (node_float(n, "reduction", 0) > 0)
		return node_error(n, e, ENOTSUP, "\"reduction\" is only supported as 0: all hair is rendered");
	double scale = vec3_length(mat4_vector(&to_world, (vec3){0, 0, 1}));
	int rc = curve_file_read_hair(n, assets, scale * node_float(n, "radius", 0.025), &points, e);
	return rc ? rc : curve_shape_build(n, &points, false, arena, out, e);
}

SHAPE_OPS(hair, {"filename", UNDERSTOOD(VALUE_STRING)},
	  {"radius", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, MESH_COORDINATE_MAX, NULL},
	  {"reduction", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, 1, NULL}, {"angle_threshold", IGNORED},
	  SHAPE_PARAMS);
