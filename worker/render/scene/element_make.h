/* SPDX-License-Identifier: Apache-2.0 */
/* Elements that no XML file holds: made of what stands in other files. One thread; they live in the arena given. */
#ifndef WORKER_RENDER_SCENE_ELEMENT_MAKE_H
#define WORKER_RENDER_SCENE_ELEMENT_MAKE_H

#include "common/base/arena.h"
#include "worker/render/scene/element.h"

enum { ELEMENT_MAKE_ATTRIBUTES = 4 };

/* The last inside `parent` from now on. */
void element_link(struct xml_element *parent, struct xml_element *el);

/* A new one of that place, the last inside `parent` (NULL: it stands alone). NULL: no memory. */
struct xml_element *element_make(struct xml_element *parent, const char *name, const char *file, int line,
				 struct arena *arena);

/* Adds an attribute to one of element_make, ELEMENT_MAKE_ATTRIBUTES at most. */
void element_put(struct xml_element *el, const char *name, const char *value);

#endif
