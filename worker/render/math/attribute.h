/* SPDX-License-Identifier: Apache-2.0 */
/* Numbers at the vertices or on the triangles of a mesh: the readers of meshes fill them, textures look them up. */
#ifndef WORKER_RENDER_MATH_ATTRIBUTE_H
#define WORKER_RENDER_MATH_ATTRIBUTE_H

#include <stdbool.h>
#include <stdint.h>

enum { ATTRIBUTE_CHANNELS_MAX = 4, ATTRIBUTE_NAME_MAX = 96 };

struct attribute {
	char name[ATTRIBUTE_NAME_MAX]; /* "vertex_color", "face_heat" */
	bool per_face;
	bool encoded; /* colours that 0.6 takes as sRGB, and 3.x as linear */
	bool damaged; /* a value was not finite, or beyond 1e12 */
	uint32_t channels;
	float *value; /* `channels` for each vertex or triangle; finite */
};

#endif
