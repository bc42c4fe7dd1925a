/* SPDX-License-Identifier: Apache-2.0 */
/* Embree 3 and 4 under common names, and how trees are made: that of the world (accel.c) and those of meshes
 * (instances.c). Only these two and solved.c include this. */
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

RTCScene embree_scene(RTCDevice device); /* robust; NULL: no memory */
/* The triangles of a shape, whose arrays must outlive it. NULL: no memory. */
RTCGeometry embree_triangles(RTCDevice device, const struct accel_shape *s);
/* Commits a geometry and gives it to the scene under that number. */
void embree_attach(RTCScene scene, RTCGeometry g, uint32_t id);
/* Builds the tree; the device reports what fails. Counts as progress (common/base/liveness.h). */
void embree_build(RTCScene scene);
void embree_bounds(RTCScene scene, vec3 *low, vec3 *high);

/* The functions of primitives that are intersected by our own callbacks. */
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
