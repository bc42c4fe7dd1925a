/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Jacobians between measures; those that need a whole vertex are in vertex.h. Names read jac_<to>_from_<from>. omega
 * points from the vertex where the direction was chosen to the next one; ng is a geometric normal.
 */
#ifndef WORKER_RENDER_PATH_MEASURE_H
#define WORKER_RENDER_PATH_MEASURE_H

#include "worker/render/math/vec3.h"

/* For parallel light through a disk across the world: converts a density per area of the disk to one per area at y. */
static inline double jac_disk_from_area(vec3 ng_y, vec3 omega)
{
	return fabs(vec3_dot(ng_y, omega));
}

#endif
