/* SPDX-License-Identifier: Apache-2.0 */
/* What the shapes made of curves share. */
#ifndef WORKER_RENDER_SHAPE_CURVE_SHAPE_H
#define WORKER_RENDER_SHAPE_CURVE_SHAPE_H

#include "worker/render/shape/curve_file.h"
#include "worker/render/shape/shape.h"

/* Makes them the shape's geometry; frees the points. */
int curve_shape_take(const struct scene_node *n, struct curve_points *points, bool spline, struct arena *arena,
		     struct shape_geometry *out, struct error *e);

#endif
