/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Light that media emit (worker/render/medium/emission.h). Only the camera's sub-path finds it, along its edges; no
 * other technique ends in a medium, so its contribution has weight 1. One thread; allocates nothing.
 */
#ifndef WORKER_RENDER_PATH_VOLUME_EMISSION_H
#define WORKER_RENDER_PATH_VOLUME_EMISSION_H

#include "worker/render/path/classes.h"

/* Returns the contribution to the film of the paths that end on the edges first ... last of the camera's sub-path.
 * classes: NULL, or gets each path's class and contribution. */
spectrum volume_emission(struct path_context *c, unsigned first, unsigned last, struct path_classes *classes);

#endif
