/* SPDX-License-Identifier: Apache-2.0 */
/* Notes about the scene as a whole: several cameras, an image that differs from what was asked for, no light. One
 * thread. */
#ifndef WORKER_RENDER_SCENE_REMARKS_H
#define WORKER_RENDER_SCENE_REMARKS_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/report.h"

/* For the top-level objects of a scene. Adds notes to the report. 0 or -ENOMEM. */
int remarks_on(const struct scene_node *const *objects, uint32_t count, struct report *r, struct error *e);

#endif
