/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Curves of straight pieces: cones with spheres as joints and ends, as in Mitsuba. to_world transforms the control
 * points, but not their radii. u runs once around the curve, v from 0 to 1 over all pieces of the file.
 */
#include "worker/render/shape/curve_file.h"
#include "worker/render/shape/curve_shape.h"
#include "worker/render/shape/declare.h"

static int build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		 struct shape_geometry *out, struct error *e)
{
	struct curve_points points;
	int rc = curve_file_read(n, assets, 2, &points, e);
	return rc ? rc : curve_shape_build(n, &points, false, arena, out, e);
}

SHAPE_OPS(linearcurve, {"filename", UNDERSTOOD(VALUE_STRING)}, SHAPE_PARAMS);
