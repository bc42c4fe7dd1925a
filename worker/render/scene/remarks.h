/* SPDX-License-Identifier: Apache-2.0 */
/* Notes about what is rendered otherwise than the scene says, though everything in it is supported: other indices of a
 * metal, a part of the light, one of several cameras, no light. One thread. */
#ifndef WORKER_RENDER_SCENE_REMARKS_H
#define WORKER_RENDER_SCENE_REMARKS_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/report.h"

/* About one object, whatever it holds: each is made once, however many refer to it. Adds notes to the report. 0 or
 * -ENOMEM. */
int remarks_on_object(const struct scene_node *n, struct report *r, struct error *e);
/* Adds remarks about the scene with these top-level objects. 0, -ENOMEM. */
int remarks_on_scene(const struct scene_node *const *objects, uint32_t count, bool dialect_3, struct report *r,
		     struct error *e);

#endif
