/* SPDX-License-Identifier: Apache-2.0 */
/* Mappings from the unit square to directions around +z. */
#ifndef WORKER_RENDER_BSDF_WARP_H
#define WORKER_RENDER_BSDF_WARP_H

#include "worker/render/math/vec3.h"

#define WARP_PI 3.14159265358979323846

/* Returns a cosine-distributed direction by the concentric map of Shirley and Chiu 1997, which maps neighbouring points
 * to neighbouring directions. z may be 0. */
static inline vec3 warp_cosine_hemisphere(double u0, double u1)
{
	double a = 2 * u0 - 1, b = 2 * u1 - 1, r, phi;
	if (a == 0 && b == 0)
		return (vec3){0, 0, 1};
	if (fabs(a) > fabs(b)) {
		r = a;
		phi = WARP_PI / 4 * (b / a);
	} else {
		r = b;
		phi = WARP_PI / 2 - WARP_PI / 4 * (a / b);
	}
	return (vec3){r * cos(phi), r * sin(phi), sqrt(fmax(0, (1 - r) * (1 + r)))};
}

#endif
