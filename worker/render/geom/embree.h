/* SPDX-License-Identifier: Apache-2.0 */
/* Embree 3 and 4 under common names. Only accel.c, solved.c and instances.c include this. */
#ifndef WORKER_RENDER_GEOM_EMBREE_H
#define WORKER_RENDER_GEOM_EMBREE_H

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
