/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Jacobians between measures; those that need a whole vertex are in vertex.h. Names read to_from. omega points from the
 * vertex where the direction was chosen to the next one; ng is a geometric normal.
 */
#ifndef WORKER_RENDER_PATH_MEASURE_H
#define WORKER_RENDER_PATH_MEASURE_H

#include "worker/render/math/vec3.h"

/* Parallel light through a disk of the world's cross section: density per area of the disk -> per area at y. */
static inline double jac_disk_from_area(vec3 ng_y, vec3 omega)
{
	return fabs(vec3_dot(ng_y, omega));
}

#endif
