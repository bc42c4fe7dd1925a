/* SPDX-License-Identifier: Apache-2.0 */
/* The field of view of perspective cameras and projectors, given by `fov` and `fov_axis` or by `focal_length` for 35
 * mm film. */
#ifndef WORKER_RENDER_SCENE_FOV_H
#define WORKER_RENDER_SCENE_FOV_H

#include "worker/render/scene/scene.h"

enum { FOV_AXIS_MAX = 16 };

/* Stores the field of view in degrees, and the side of the picture that it spans: x, y, diagonal, smaller or larger.
 * If n has neither an angle nor a focal length, it is that of a 50 mm lens. Returns -EINVAL with a sentence if n has
 * both, or a malformed length. */
int fov_read(const struct scene_node *n, double *degrees, char axis[FOV_AXIS_MAX], struct error *e);
/* Returns the length of that side of a picture of width x height, in the same unit. */
double fov_side(const char *axis, double width, double height);

#endif
