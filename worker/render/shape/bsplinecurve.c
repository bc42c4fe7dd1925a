/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Circles swept along uniform cubic B-splines of positions and radii (spline.h), with open ends. to_world transforms
 * the control points, but not their radii. u runs once around the tube, v from 0 to 1 over all pieces of the file.
 */
#include "worker/render/shape/curve_file.h"
#include "worker/render/shape/curve_shape.h"
#include "worker/render/shape/declare.h"
#include "worker/render/shape/spline.h"

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct curve_points points;
	int rc = curve_file_read(n, assets, SPLINE_POINTS, &points, e);
	return rc ? rc : curve_shape_build(n, &points, true, arena, out, e);
}

SHAPE_OPS(bsplinecurve, {"filename", UNDERSTOOD(VALUE_STRING)}, SHAPE_PARAMS);
