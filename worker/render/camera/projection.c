/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/camera/projection.h"

#define PROJECTIONS(X)       \
	X(SPHERE, spherical) \
	X(DISTORTED, rdist)

#define X(kind, name) extern const struct camera_projection camera_projection_##name;
PROJECTIONS(X)
#undef X

const struct camera_projection *camera_projection_find(enum scene_projection p)
{
	static const struct camera_projection *const table[] = {
#define X(kind, name) [PROJECTION_##kind] = &camera_projection_##name,
		PROJECTIONS(X)
#undef X
	};
	return table[p];
}
