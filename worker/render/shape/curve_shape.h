/* SPDX-License-Identifier: Apache-2.0 */
/* Shared by the shapes that consist of curves. */
#ifndef WORKER_RENDER_SHAPE_CURVE_SHAPE_H
#define WORKER_RENDER_SHAPE_CURVE_SHAPE_H

#include "worker/render/shape/curve_file.h"
#include "worker/render/shape/shape.h"

/* Copies the points to the arena as the geometry of shape n, and frees them, also on error. Returns 0, -EFBIG or
 * -ENOMEM. */
int curve_shape_build(const struct scene_node *n, struct curve_points *points, bool spline, struct arena *arena,
		      struct shape_geometry *out, struct error *e);

#endif
