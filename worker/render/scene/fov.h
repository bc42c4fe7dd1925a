/* SPDX-License-Identifier: Apache-2.0 */
/* The angle of view of perspective cameras and projectors: `fov` with `fov_axis`, or `focal_length` of a 35 mm film. */
#ifndef WORKER_RENDER_SCENE_FOV_H
#define WORKER_RENDER_SCENE_FOV_H

#include "worker/render/scene/scene.h"

enum { FOV_AXIS_MAX = 16 };

/* The field of view in degrees, and the side of the picture that it spans: x, y, diagonal, smaller or larger. 50mm
 * where n has neither angle nor focal length; -EINVAL with a sentence where it has both, or a malformed length. */
int fov_read(const struct scene_node *n, double *degrees, char axis[FOV_AXIS_MAX], struct error *e);
/* That side of a picture of width x height, in the same unit. */
double fov_side(const char *axis, double width, double height);

#endif
