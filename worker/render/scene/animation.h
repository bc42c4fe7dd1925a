/* SPDX-License-Identifier: Apache-2.0 */
/* <animation>: a transform for each of several times (math/motion.h). One thread; allocates in the given arena. */
#ifndef WORKER_RENDER_SCENE_ANIMATION_H
#define WORKER_RENDER_SCENE_ANIMATION_H

#include "common/base/arena.h"
#include "worker/render/scene/node.h"
#include "worker/render/xml/xml.h"

/* Replaces *el, an <animation>, by the first of its transforms. *out becomes the whole animation, or NULL if all
 * transforms are equal. Errors: times that do not ascend; transforms between which the object would be flat. */
int animation_read(const struct xml_element **el, struct arena *arena, const struct animation **out, struct error *e);

/* Returns, as a noun for the message, the kind of node that cannot be animated although its plug-in can; NULL if it
 * can. */
const char *animation_unsupported_kind(const struct scene_node *n, const struct xml_element *el);

#endif
