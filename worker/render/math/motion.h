/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Motion while the shutter is open. The transform M of a keyframe is R S and a translation, its polar
 * decomposition: R rotates, S is symmetric. Between two keyframes the translation and S change linearly, and R
 * turns at a constant rate about one axis, the shorter way (Shoemake 1985, Animating Rotation with Quaternion
 * Curves; Shoemake and Duff 1992, Matrix Animation and Polar Decomposition). Before the first keyframe and after
 * the last, nothing moves. Pure; any thread.
 */
#ifndef WORKER_RENDER_MATH_MOTION_H
#define WORKER_RENDER_MATH_MOTION_H

#include "worker/render/math/mat4.h"

#include <stdint.h>

/* An animation as in a scene: times ascend, all transforms have an inverse, and either all or none of them mirror. */
struct keyframe {
	double time;
	mat4 transform;
};
struct animation {
	uint32_t count; /* at least 1 */
	const struct keyframe *key;
};

struct motion_key {
	double time;
	double rotation[4];   /* R, a unit quaternion: w, x, y, z */
	double half_angle;    /* of the rotation to the next key, in [0, pi/2] */
	double stretch[3][3]; /* S */
	vec3 translation;
};

struct motion {
	uint32_t count;
	struct motion_key *key; /* times: 0 when the shutter opens, 1 when it closes */
	mat4 pre_transform;	/* applied before the keys' transforms */
};

/* Makes the motion from `open` to `close` from the keyframes that matter in this interval (if both are equal, those
 * around that time). The keys are written to `keys`, which needs space for all. Returns false if nothing moves. */
bool motion_make(struct motion *m, const struct animation *a, double open, double close, struct motion_key *keys);
/* Subtracts `center` from all positions, then multiplies lengths by `scale`. */
void motion_rescale(struct motion *m, vec3 center, double scale);

mat4 motion_transform_at(const struct motion *m, double time);
/* Computes bounds of a moving box for all times from 0 to 1: not the tightest, but nothing leaves them. */
void motion_bounds(const struct motion *m, vec3 low, vec3 high, vec3 *all_low, vec3 *all_high);

#endif
