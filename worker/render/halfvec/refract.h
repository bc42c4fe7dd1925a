/* SPDX-License-Identifier: Apache-2.0 */
/* Finds the path by which light is refracted from a point of an emitter to another vertex (path/refracted.h). */
#ifndef WORKER_RENDER_HALFVEC_REFRACT_H
#define WORKER_RENDER_HALFVEC_REFRACT_H

#include "worker/render/path/refracted.h"

/* For path_context.refract. The walk starts where the straight line from z to y crosses surfaces, all of which have to
 * refract. Nothing is found between points that see each other straight. Pure, but for the rays that it counts. */
path_refract halfvec_refract;

#endif
