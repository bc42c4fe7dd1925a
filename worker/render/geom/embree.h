/* SPDX-License-Identifier: Apache-2.0 */
/* Common names for Embree 3 and 4, and the construction of trees: that of the world (accel.c) and those of meshes
 * (instances.c). Only these two files and user_geometry.c include this header. */
#ifndef WORKER_RENDER_GEOM_EMBREE_H
#define WORKER_RENDER_GEOM_EMBREE_H

#include "worker/render/geom/primitive.h"

/* Suppresses warnings in Embree's own headers. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wstrict-prototypes"
#pragma GCC diagnostic ignored "-Wundef"
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
typedef struct RTCRayQueryContext embree_context;
#define EMBREE_INIT_CONTEXT rtcInitRayQueryContext
#else
#include <embree3/rtcore.h>
typedef struct RTCIntersectContext embree_context;
#define EMBREE_INIT_CONTEXT rtcInitIntersectContext
#endif
#pragma GCC diagnostic pop

RTCScene embree_new_scene(RTCDevice device); /* a new scene in robust mode; NULL if out of memory */
/* Returns a geometry with the triangles of a shape, whose arrays must outlive it. NULL if out of memory. */
RTCGeometry embree_new_triangles(RTCDevice device, const struct accel_shape *s);
/* Commits a geometry and attaches it to the scene with that ID. */
void embree_attach(RTCScene scene, RTCGeometry g, uint32_t id);
/* Builds the tree. Errors are reported through the device. Counts as progress (common/base/liveness.h). */
void embree_build(RTCScene scene);
void embree_bounds(RTCScene scene, vec3 *low, vec3 *high);

/* The callbacks of primitives that we intersect ourselves. */
struct embree_ops {
	RTCBoundsFunction bounds;
	RTCIntersectFunctionN intersect;
	RTCOccludedFunctionN occluded;
};

static inline void embree_intersect(RTCScene scene, embree_context *context, struct RTCRayHit *rh)
{
#if RTC_VERSION_MAJOR >= 4
	struct RTCIntersectArguments args;
	rtcInitIntersectArguments(&args);
	args.context = context;
	rtcIntersect1(scene, rh, &args);
#else
	rtcIntersect1(scene, context, rh);
#endif
}

static inline void embree_occluded(RTCScene scene, embree_context *context, struct RTCRay *ray)
{
#if RTC_VERSION_MAJOR >= 4
	struct RTCOccludedArguments args;
	rtcInitOccludedArguments(&args);
	args.context = context;
	rtcOccluded1(scene, ray, &args);
#else
	rtcOccluded1(scene, context, ray);
#endif
}

#endif
