/* SPDX-License-Identifier: Apache-2.0 */
/* Maps the unit square to the unit sphere, preserving ratios of areas, and back. Pure. */
#ifndef WORKER_RENDER_EMITTER_UNIFORM_H
#define WORKER_RENDER_EMITTER_UNIFORM_H

#include "worker/render/math/vec3.h"

static inline vec3 sphere_from_square(const double u[2])
{
	double z = 1 - 2 * u[0], r = 2 * sqrt(u[0] * (1 - u[0])), phi = 2 * M_PI * u[1];
	return (vec3){r * cos(phi), r * sin(phi), z};
}

/* The inverse of sphere_from_square(), with numbers in [0,1); u[0] keeps its precision around the pole where it is
 * 0. */
static inline void square_from_sphere(vec3 w, double u[2])
{
	double r2 = w.x * w.x + w.y * w.y, turn = atan2(w.y, w.x) / (2 * M_PI);
	u[0] = w.z > 0 ? 0.5 * r2 / (sqrt(r2 + w.z * w.z) + w.z) : 0.5 * (1 - w.z);
	u[1] = turn < 0 ? turn + 1 : turn;
	for (int i = 0; i < 2; i++)
		u[i] = fmin(fmax(u[i], 0), 1 - 0x1p-53);
}

#endif
