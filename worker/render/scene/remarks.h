/* SPDX-License-Identifier: Apache-2.0 */
/* What only the whole scene says: a camera too many, a picture that will not be what was asked for, no light. One
 * thread. */
#ifndef WORKER_RENDER_SCENE_REMARKS_H
#define WORKER_RENDER_SCENE_REMARKS_H

#include "worker/render/scene/report.h"
#include "worker/render/scene/scene.h"

/* Notes it in the report. 0 or -ENOMEM. */
int remarks_on(const struct scene *s, struct report *r, struct error *e);

#endif
