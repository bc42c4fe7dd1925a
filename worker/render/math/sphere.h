/* SPDX-License-Identifier: Apache-2.0 */
/* The (u, v) of a sphere: the longitude around the axes' n, counted from s, and the angle from n,
 * each divided by its range. */
#ifndef WORKER_RENDER_MATH_SPHERE_H
#define WORKER_RENDER_MATH_SPHERE_H

#include "worker/render/math/frame.h"

/* w: unit direction from the centre. Sets u in [0,1) and v in [0,1]. */
static inline void sphere_uv(const struct frame *axes, vec3 w, double *u, double *v)
{
	vec3 l = frame_to_local(axes, w);
	double phi = atan2(l.y, l.x);
	*u = (phi < 0 ? phi + 2 * M_PI : phi) / (2 * M_PI);
	*v = acos(fmin(fmax(l.z, -1), 1)) / M_PI;
}

#endif
