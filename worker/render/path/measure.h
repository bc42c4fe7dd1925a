/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The only place where Jacobians between measures live. Names read to_from. omega points from the vertex where the
 * direction was chosen to the next one; ng is a geometric normal.
 */
#ifndef WORKER_RENDER_PATH_MEASURE_H
#define WORKER_RENDER_PATH_MEASURE_H

#include "worker/render/math/vec3.h"

/* Density per solid angle at x -> density per area at y: |ng_y . omega| / |x - y|^2. */
static inline double jac_solid_from_area(vec3 ng_y, vec3 omega, double distance2)
{
	return fabs(vec3_dot(ng_y, omega)) / distance2;
}

/* Density per projected solid angle at x -> per area at y: the geometry term without visibility. */
static inline double geometry_term(vec3 ng_x, vec3 ng_y, vec3 omega, double distance2)
{
	return fabs(vec3_dot(ng_x, omega)) * fabs(vec3_dot(ng_y, omega)) / distance2;
}

/* Parallel light through a disk of the world's cross section: density per area of the disk -> per area at y. */
static inline double jac_disk_from_area(vec3 ng_y, vec3 omega)
{
	return fabs(vec3_dot(ng_y, omega));
}

#endif
