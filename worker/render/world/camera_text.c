/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/camera_text.h"

#include "common/base/text.h"

void render_camera_text(const struct render_summary *scene, char *text, size_t size)
{
	const struct scene_settings *s = &scene->settings;
	struct text t = {text, size};
	if (s->projection == PROJECTION_SPHERE)
		text_appendf(&t, "spherical");
	else if (s->half_width > 0)
		text_appendf(&t, "%s half_width=%.9g", s->aperture_radius > 0 ? "telecentric" : "orthographic",
			     s->half_width);
	else
		text_appendf(&t, "%s fov=%.9g fov_axis=%s",
			     s->projection == PROJECTION_DISTORTED ? "perspective_rdist"
			     : s->aperture_radius > 0		   ? "thinlens"
								   : "perspective",
			     s->fov, s->fov_axis);
	if (s->projection == PROJECTION_DISTORTED)
		text_appendf(&t, " kc=%.9g,%.9g", s->distortion[0], s->distortion[1]);
	if (s->aperture_radius > 0)
		text_appendf(&t, " aperture_radius=%.9g focus_distance=%.9g", s->aperture_radius, s->focus_distance);
	if (s->principal_x != 0 || s->principal_y != 0)
		text_appendf(&t, " principal_point_offset_x=%.9g principal_point_offset_y=%.9g", s->principal_x,
			     s->principal_y);
	if (s->projection != PROJECTION_SPHERE)
		text_appendf(&t, " near_clip=%.9g far_clip=%.9g", s->near_clip, s->far_clip);
	text_appendf(&t, " to_world=");
	for (int i = 0; i < 16; i++)
		text_appendf(&t, "%s%.9g", i ? "," : "", s->to_world.m[i / 4][i % 4]);
}
