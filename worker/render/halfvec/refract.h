/* SPDX-License-Identifier: Apache-2.0 */
/* Finds the path along which light is refracted from a point of an emitter to another vertex (path/refracted.h). */
#ifndef WORKER_RENDER_HALFVEC_REFRACT_H
#define WORKER_RENDER_HALFVEC_REFRACT_H

#include "worker/render/path/refracted.h"

/* A function for path_context.refract. The walk starts where the straight line from z to y crosses surfaces, all
 * of which have to refract. Between points that see each other along a straight line nothing is found. Pure,
 * except that it counts rays. */
path_refract halfvec_refract;

#endif
