/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The shapes of a scene one by one: what is in a `merge`, and for each `instance` a copy of what is in its
 * `shapegroup`, with the instance's to_world after its own. Copies share nothing but materials: each is built, and
 * takes memory, as if it were written out.
 */
#ifndef WORKER_RENDER_SHAPE_GROUP_H
#define WORKER_RENDER_SHAPE_GROUP_H

#include "worker/render/shape/shape.h"

enum { SHAPES_MAX = 1 << 20 };

/* Nodes of the scene, or copies in the arena, in the file's order. -EINVAL, -ENOTSUP, -E2BIG with a sentence, -ENOMEM.
 */
int shape_list(const struct scene *s, struct arena *arena, const struct scene_node ***nodes, uint32_t *count,
	       struct error *e);

#endif
