/* SPDX-License-Identifier: Apache-2.0 */
/* A property that an object of a scene file is given a second time. Pure but for the notes. */
#ifndef WORKER_RENDER_SCENE_GIVEN_TWICE_H
#define WORKER_RENDER_SCENE_GIVEN_TWICE_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/notes.h"
#include "worker/render/scene/param.h"

/* Refuses it: -EINVAL. */
int given_twice(const struct xml_element *el, const struct property *before, struct error *e);

/* In files of 0.6: sets *before to the value that counts there, with a note. -EINVAL: two names of 0.6 for one thing.
 */
int given_again(const struct notes *t, const struct plugin_decl *decl, const struct xml_element *el,
		struct property *before, struct value v);

#endif
