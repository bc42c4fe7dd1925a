/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/world/camera_text.h"

#include <stdarg.h>
#include <stdio.h>

__attribute__((format(printf, 4, 5))) static void put(char *text, size_t size, size_t *used, const char *format, ...)
{
	va_list args;
	va_start(args, format);
	if (*used < size) {
		int n = vsnprintf(text + *used, size - *used, format, args);
		*used += n > 0 ? (size_t)n : 0;
	}
	va_end(args);
}

void render_camera_text(const struct render_summary *scene, char *text, size_t size)
{
	const struct scene_settings *s = &scene->settings;
	size_t used = 0;
	text[0] = 0;
	if (s->projection == PROJECTION_SPHERE)
		put(text, size, &used, "spherical");
	else if (s->half_width > 0)
		put(text, size, &used, "%s half_width=%.9g", s->aperture_radius > 0 ? "telecentric" : "orthographic",
		    s->half_width);
	else
		put(text, size, &used, "%s fov=%.9g fov_axis=%s",
		    s->projection == PROJECTION_DISTORTED ? "perspective_rdist"
		    : s->aperture_radius > 0		  ? "thinlens"
							  : "perspective",
		    s->fov, s->fov_axis);
	if (s->projection == PROJECTION_DISTORTED)
		put(text, size, &used, " kc=%.9g,%.9g", s->kc[0], s->kc[1]);
	if (s->aperture_radius > 0)
		put(text, size, &used, " aperture_radius=%.9g focus_distance=%.9g", s->aperture_radius,
		    s->focus_distance);
	if (s->principal_x != 0 || s->principal_y != 0)
		put(text, size, &used, " principal_point_offset_x=%.9g principal_point_offset_y=%.9g", s->principal_x,
		    s->principal_y);
	if (s->projection != PROJECTION_SPHERE)
		put(text, size, &used, " near_clip=%.9g far_clip=%.9g", s->near_clip, s->far_clip);
	put(text, size, &used, " to_world=");
	for (int i = 0; i < 16; i++)
		put(text, size, &used, "%s%.9g", i ? "," : "", s->to_world.m[i / 4][i % 4]);
}
