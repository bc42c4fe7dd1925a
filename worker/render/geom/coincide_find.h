/* SPDX-License-Identifier: Apache-2.0 */
/* Finds coinciding surfaces, as described in coincide.h. One thread. */
#ifndef WORKER_RENDER_GEOM_COINCIDE_FIND_H
#define WORKER_RENDER_GEOM_COINCIDE_FIND_H

#include "worker/render/geom/coincide.h"

/* Sets *out, or *out = NULL if nothing coincides. The arrays of the shapes are read here and later in
 * coincide_present_prim. Returns -ENOMEM if out of memory. */
int coincide_find(struct coincidence **out, const struct accel_shape *shapes, uint32_t count, struct error *e);

#endif
