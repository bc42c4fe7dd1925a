/* SPDX-License-Identifier: Apache-2.0 */
/* Numbers at the vertices or on the triangles of a mesh, set by the readers of meshes and used by textures. */
#ifndef WORKER_RENDER_MATH_ATTRIBUTE_H
#define WORKER_RENDER_MATH_ATTRIBUTE_H

#include <stdbool.h>
#include <stdint.h>

enum { ATTRIBUTE_CHANNELS_MAX = 4, ATTRIBUTE_NAME_MAX = 96 };

struct attribute {
	char name[ATTRIBUTE_NAME_MAX]; /* "vertex_color", "face_heat" */
	bool is_per_face;
	bool is_srgb;		/* colours that are sRGB in Mitsuba 0.6 and linear in 3.x */
	bool has_invalid_value; /* a value was not finite or exceeded 1e12 */
	uint32_t channels;
	float *value; /* `channels` per vertex or triangle; finite */
};

#endif
