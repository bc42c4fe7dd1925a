/* SPDX-License-Identifier: Apache-2.0 */
/* A specular lobe that transmits a share of the light unchanged, for `null` and `mask`. */
#ifndef WORKER_RENDER_BSDF_STRAIGHT_H
#define WORKER_RENDER_BSDF_STRAIGHT_H

#include "worker/render/math/vec3.h"

#include <float.h>

/* 1 / |wo.z| must be finite. */
static inline bool straight_direction(vec3 wo, vec3 *wi)
{
	*wi = vec3_neg(wo);
	return fabs(wo.z) >= DBL_MIN;
}

#endif
