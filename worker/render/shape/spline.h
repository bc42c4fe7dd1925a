/* SPDX-License-Identifier: Apache-2.0 */
/* Makes rings of a tube from uniform cubic B-splines of positions and radii. One thread. */
#ifndef WORKER_RENDER_SHAPE_SPLINE_H
#define WORKER_RENDER_SHAPE_SPLINE_H

#include "worker/render/shape/tube.h"

enum { SPLINE_POINTS = 4 };

/* Adds the rings of one curve of at least SPLINE_POINTS control points. Chords between rings deviate by at most
 * `tolerance` times the largest radius of the four control points around, unless that takes more than 64 chords per
 * piece. v grows by v_step from one control point to the next. Returns 0, -EFBIG or -ENOMEM. */
int spline_add_rings(struct list *rings, const double (*points)[4], uint32_t count, double tolerance, double v,
		     double v_step);

#endif
