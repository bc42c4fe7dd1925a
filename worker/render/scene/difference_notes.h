/* SPDX-License-Identifier: Apache-2.0 */
/* Notes about what is rendered differently from what the scene says, although everything in it is supported: other
 * indices of refraction of a metal, a part of the light, one of several cameras, no light. One thread. */
#ifndef WORKER_RENDER_SCENE_DIFFERENCE_NOTES_H
#define WORKER_RENDER_SCENE_DIFFERENCE_NOTES_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/report.h"

/* Adds notes about one object, apart from its contents: objects are made, and noted, once, however many refer to
 * them. Returns 0 or -ENOMEM. */
int note_object_differences(const struct scene_node *n, struct report *r, struct error *e);
/* Adds notes about the scene with these top-level objects. Returns 0 or -ENOMEM. */
int note_scene_differences(const struct scene_node *const *objects, uint32_t count, bool dialect_3, struct report *r,
			   struct error *e);

#endif
