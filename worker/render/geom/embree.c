/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/geom/embree.h"

#include "common/base/liveness.h"

RTCScene embree_new_scene(RTCDevice device)
{
	RTCScene scene = rtcNewScene(device);
	if (scene) {
		rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
		rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
	}
	return scene;
}

RTCGeometry embree_new_triangles(RTCDevice device, const struct accel_shape *s)
{
	RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
	if (!g)
		return NULL;
	rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, s->position, 0,
				   sizeof s->position[0], s->vertex_count);
	rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, s->index, 0, sizeof s->index[0],
				   s->triangle_count);
	return g;
}

void embree_attach(RTCScene scene, RTCGeometry g, uint32_t id)
{
	rtcSetGeometryMask(g, 0xFFFFFFFFu);
	rtcCommitGeometry(g);
	rtcAttachGeometryByID(scene, g, id);
	rtcReleaseGeometry(g);
}

/* Embree calls this about once per thousand primitives, on a thread of its choice. */
static bool progress_monitor(void *counter, double done)
{
	(void)done;
	liveness_tick_on(counter);
	return true;
}

void embree_build(RTCScene scene)
{
	rtcSetSceneProgressMonitorFunction(scene, progress_monitor, liveness_counter);
	rtcCommitScene(scene);
}

void embree_bounds(RTCScene scene, vec3 *low, vec3 *high)
{
	struct RTCBounds b;
	rtcGetSceneBounds(scene, &b);
	*low = (vec3){(double)b.lower_x, (double)b.lower_y, (double)b.lower_z};
	*high = (vec3){(double)b.upper_x, (double)b.upper_y, (double)b.upper_z};
}
