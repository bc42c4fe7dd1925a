/* SPDX-License-Identifier: Apache-2.0 */
/* Numbers that Mitsuba limits where it uses them, and does not refuse: VALUE_CLIPPED. One thread. */
#ifndef WORKER_RENDER_SCENE_CLIP_VALUE_H
#define WORKER_RENDER_SCENE_CLIP_VALUE_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/notes.h"

/* A number, or the components of a colour, to the range of p. Spectra stay as they are. 0 or -ENOMEM. */
int clip_value(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
	       const struct param *p, struct value *v);

#endif
