/* SPDX-License-Identifier: Apache-2.0 */
/* Finds the surfaces that coincide, as described in coincide.h. One thread. */
#ifndef WORKER_RENDER_GEOM_COINCIDE_FIND_H
#define WORKER_RENDER_GEOM_COINCIDE_FIND_H

#include "worker/render/geom/coincide.h"

/* *c is NULL if nothing coincides. It refers to the arrays of the shapes, here and in coincide_there. -ENOMEM. */
int coincide_find(struct coincidence **c, const struct accel_shape *shapes, uint32_t count, struct error *e);

#endif
