/* SPDX-License-Identifier: Apache-2.0 */
/* What only the whole scene says: a camera too many, a picture that will not be what was asked for, no light. One
 * thread. */
#ifndef WORKER_RENDER_SCENE_REMARKS_H
#define WORKER_RENDER_SCENE_REMARKS_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/report.h"

/* Of the objects at the top of a scene. Notes it in the report. 0 or -ENOMEM. */
int remarks_on(const struct scene_node *const *objects, uint32_t count, struct report *r, struct error *e);

#endif
