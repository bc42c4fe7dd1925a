/* SPDX-License-Identifier: Apache-2.0 */
/* The single shape of a scene in memory, read and built, for tests of its geometry. */
#ifndef TESTS_SUPPORT_BUILT_SHAPE_H
#define TESTS_SUPPORT_BUILT_SHAPE_H

#include "tests/support/memory_assets.h"
#include "worker/render/scene/settings.h"
#include "worker/render/shape/shape.h"

struct built_shape {
	struct scene scene;
	struct arena arena;
	struct shape_geometry geometry;
	uint64_t dropped_triangles; /* triangles without area */
	struct error error;
	int result; /* 0, or the negative errno of the function that refused the shape, with the message in `error` */
};

/* files: include s.xml, the scene. */
struct built_shape built_shape_make(const struct memory_file *files, const struct plugin_decl *plugins);
void built_shape_fini(struct built_shape *b);

/* Builds the scene's first shape repeatedly, each time with one more allocation before memory runs out. Each time
 * there must be a result or an error, and finally a shape. Fails the test unless more than `min_allocations`
 * allocations are made. */
void built_shape_check_out_of_memory(const struct scene *scene, const struct memory_file *files, long min_allocations);

vec3 built_shape_corner(const struct mesh *m, uint32_t triangle, int k);
/* Returns the volume of a closed mesh; negative if it is inside out. */
double built_shape_volume(const struct mesh *m);
double built_shape_area(const struct mesh *m);

#endif
