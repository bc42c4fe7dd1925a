/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Light of media that shine (worker/render/medium/emission.h). It is found by the camera's sub-path alone, along its
 * edges, and counts in full: no other technique ends in a medium. One thread; allocates nothing.
 */
#ifndef WORKER_RENDER_PATH_VOLUME_EMISSION_H
#define WORKER_RENDER_PATH_VOLUME_EMISSION_H

#include "worker/render/path/classes.h"

/* What paths that end on the edges first ... last of the camera's sub-path contribute to the film. classes: NULL, or
 * told of each path. */
spectrum volume_emission(struct path_context *c, unsigned first, unsigned last, struct classes *classes);

#endif
