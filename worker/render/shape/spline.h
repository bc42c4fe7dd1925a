/* SPDX-License-Identifier: Apache-2.0 */
/* Uniform cubic B-splines of positions and radii, as rings of a tube. One thread. */
#ifndef WORKER_RENDER_SHAPE_SPLINE_H
#define WORKER_RENDER_SHAPE_SPLINE_H

#include "worker/render/shape/tube.h"

enum { SPLINE_POINTS = 4 };

/* Rings of one curve of at least SPLINE_POINTS control points, so many that chords between them are off by at most
 * `tolerance` times the largest radius of the four points around, but at most 64 for each; v grows by v_step from one
 * control point to the next. */
int spline_add(struct list *rings, const double (*points)[4], uint32_t count, double tolerance, double v,
	       double v_step);

#endif
