/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The value of a bump map or a normal map at (u,v): produced by a material, applied by worker/render/geom/relief.h.
 * Immutable; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_MATH_RELIEF_H
#define WORKER_RENDER_MATH_RELIEF_H

#include "worker/render/math/frame.h"

#include <stdbool.h>

enum relief_kind {
	/* A height along the normal: x is its gradient (dh/du, dh/dv, 0), in the scene's units of length. */
	RELIEF_HEIGHT,
	RELIEF_NORMAL, /* x is the normal in the shading frame, with any length above 0 */
};

struct relief_sample {
	vec3 x, du, dv; /* the value, and its derivatives with respect to u and v */
};

struct relief {
	enum relief_kind kind;
	void (*eval)(const void *data, double u, double v, struct relief_sample *out);
	const void *data;
	/* For RELIEF_NORMAL: y points against dp/dv instead of along n x dp/du, where the two differ. */
	bool uses_handedness;
	bool flips_invalid_normals; /* normals that face away from the camera's side of a path are turned round, see
				       path_point_facing_camera() */
	const struct relief *base;  /* the relief whose normals this one bends further; NULL: none */
};

/*
 * Provides the shading frame that a point would have with the relief of one part of a material instead of the
 * surface's, in the coordinates of the point's present frame. r: NULL for no relief.
 */
struct relief_frames {
	const void *context;							/* argument of `get_frame` */
	struct frame (*get_frame)(const void *context, const struct relief *r); /* NULL: the point is on no surface */
};

#endif
