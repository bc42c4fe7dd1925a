/* SPDX-License-Identifier: Apache-2.0 */
/* The one shape of a scene in memory, read and built, for tests of its geometry. */
#ifndef TESTS_SUPPORT_BUILT_SHAPE_H
#define TESTS_SUPPORT_BUILT_SHAPE_H

#include "tests/support/memory_assets.h"
#include "worker/render/scene/settings.h"
#include "worker/render/shape/shape.h"

struct built_shape {
	struct scene scene;
	struct arena arena;
	struct shape_geometry g;
	uint64_t dropped; /* triangles without area */
	struct error error;
	int result; /* 0, or that of what refused it, with its sentence in `error` */
};

/* files: among them s.xml, the scene. */
struct built_shape built_shape(const struct memory_file *files, const struct plugin_decl *plugins);
void built_shape_release(struct built_shape *b);

/* Builds the scene's first shape again and again, each time with one more allocation before memory runs out: an answer
 * each time, and a shape in the end. More than `least` allocations are made. */
void built_shape_without_memory(const struct scene *scene, const struct memory_file *files, long least);

vec3 built_corner(const struct mesh *m, uint32_t triangle, int k);
/* Of a closed mesh; negative: inside out. */
double built_volume(const struct mesh *m);
double built_area(const struct mesh *m);

#endif
