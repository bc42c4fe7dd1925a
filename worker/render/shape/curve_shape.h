/* SPDX-License-Identifier: Apache-2.0 */
/* What the shapes made of curves share. */
#ifndef WORKER_RENDER_SHAPE_CURVE_SHAPE_H
#define WORKER_RENDER_SHAPE_CURVE_SHAPE_H

#include "worker/render/shape/curve_file.h"
#include "worker/render/shape/shape.h"
#include "worker/render/shape/tube.h"

/* Makes the mesh of the tubes, and frees both; rc: an error of tube_add, or 0. */
int curve_shape_finish(const struct scene_node *n, struct curve_points *points, struct list *rings, int rc,
		       struct arena *arena, struct shape_geometry *out, struct error *e);
/* Chains of cones; frees the points. */
int curve_shape_chains(const struct scene_node *n, struct curve_points *points, struct arena *arena,
		       struct shape_geometry *out, struct error *e);

#endif
