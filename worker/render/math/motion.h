/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What moves while the shutter is open. A transform M of a keyframe is R S and a translation, its polar decomposition:
 * R rotates, S is symmetric. Between two keyframes the translation and S change linearly, and R turns at a constant
 * rate about one axis, the shorter way (Shoemake 1985, Animating Rotation with Quaternion Curves; Shoemake and Duff
 * 1992, Matrix Animation and Polar Decomposition). Before the first keyframe and after the last, nothing moves. Pure;
 * any thread.
 */
#ifndef WORKER_RENDER_MATH_MOTION_H
#define WORKER_RENDER_MATH_MOTION_H

#include "worker/render/math/mat4.h"

#include <stdint.h>

/* An animation as in a scene: times ascend, all transforms have an inverse, and all or none of them mirror. */
struct keyframe {
	double time;
	mat4 place;
};
struct animation {
	uint32_t count; /* from 1 on */
	const struct keyframe *key;
};

struct motion_key {
	double time;
	double turn[4];	      /* R, a unit quaternion: w, x, y, z */
	double angle;	      /* half of the angle of the turn to the next key, in [0, pi/2] */
	double stretch[3][3]; /* S */
	vec3 at;
};

struct motion {
	uint32_t count;
	struct motion_key *key; /* times: 0 where the shutter opens, 1 where it closes */
	mat4 before;		/* is applied before them */
};

/* The motion from `open` to `close`, made of the keyframes that matter there (if both are equal, those around that
 * time). The keys are written to `room`, which has space for all. false: nothing moves. */
bool motion_make(struct motion *m, const struct animation *a, double open, double close, struct motion_key *room);
/* Lengths are multiplied by scale after `center` has been subtracted. */
void motion_rescale(struct motion *m, vec3 center, double scale);

mat4 motion_at(const struct motion *m, double time);
/* Bounds of a box from 0 to 1, for all times: not the tightest, but nothing leaves them. */
void motion_bounds(const struct motion *m, vec3 low, vec3 high, vec3 *all_low, vec3 *all_high);

#endif
