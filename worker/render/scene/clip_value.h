/* SPDX-License-Identifier: Apache-2.0 */
/* Numbers that Mitsuba neither refuses nor uses as they are: it limits them to their range (VALUE_CLIPPED). One thread.
 */
#ifndef WORKER_RENDER_SCENE_CLIP_VALUE_H
#define WORKER_RENDER_SCENE_CLIP_VALUE_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/notes.h"

/* Moves a number, or each component of a colour, that is outside the range of p to the nearer end, with a note. Spectra
 * stay as they are. 0 or -ENOMEM. */
int clip_value(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
	       const struct param *p, struct value *v);

#endif
