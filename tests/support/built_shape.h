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
	struct error error;
	int result; /* 0, or that of what refused it, with its sentence in `error` */
};

/* files: among them s.xml, the scene. */
struct built_shape built_shape(const struct memory_file *files, const struct plugin_decl *plugins);
void built_shape_release(struct built_shape *b);

#endif
