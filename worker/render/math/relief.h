/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The value of a bump map or a normal map at (u,v): made by a material, applied by worker/render/geom/relief.h.
 * Immutable; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MATH_RELIEF_H
#define WORKER_RENDER_MATH_RELIEF_H

#include "worker/render/math/frame.h"

#include <stdbool.h>

enum relief_kind {
	RELIEF_HEIGHT, /* a height along the normal: x is its gradient (dh/du, dh/dv, 0), in the scene's units of length
			*/
	RELIEF_NORMAL, /* x is the normal in the shading frame, of any length above 0 */
};

struct relief_value {
	vec3 x, du, dv; /* and its derivatives by u and v */
};

struct relief {
	enum relief_kind kind;
	void (*at)(const void *data, double u, double v, struct relief_value *out);
	const void *data;
	bool handed; /* for RELIEF_NORMAL: y runs against dp/dv, not along n x dp/du, where the two differ */
	bool turns;  /* normals that face away from the camera's side of a path are turned round, see path_facing */
};

/*
 * The shading frame that a point would have with the relief of one part of a material instead of the surface's, in the
 * coordinates of the frame that the point has. r: NULL for none.
 */
struct relief_place {
	const void *point;						  /* for frame */
	struct frame (*frame)(const void *point, const struct relief *r); /* NULL: there is no surface */
};

#endif
