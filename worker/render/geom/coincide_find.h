/* SPDX-License-Identifier: Apache-2.0 */
/* Finding the surfaces that coincide (coincide.h says how). One thread. */
#ifndef WORKER_RENDER_GEOM_COINCIDE_FIND_H
#define WORKER_RENDER_GEOM_COINCIDE_FIND_H

#include "worker/render/geom/coincide.h"

/* *c is NULL when nothing coincides. The arrays of the shapes are looked at here and by coincide_there. -ENOMEM. */
int coincide_find(struct coincidence **c, const struct accel_shape *shapes, uint32_t count, struct error *e);

#endif
