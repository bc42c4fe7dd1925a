/* SPDX-License-Identifier: Apache-2.0 */
/* Elements that are not in an XML file but made from the contents of other files. One thread; they are allocated in
 * the given arena. */
#ifndef WORKER_RENDER_XML_ELEMENT_MAKE_H
#define WORKER_RENDER_XML_ELEMENT_MAKE_H

#include "common/base/arena.h"
#include "worker/render/xml/element.h"

enum { ELEMENT_MAKE_ATTRIBUTES = 4 };

/* Appends it to the children of `parent`. */
void element_link(struct xml_element *parent, struct xml_element *el);

/* A new element of that place in a file, appended to `parent` (NULL: to none). NULL: out of memory. */
struct xml_element *element_make(struct xml_element *parent, const char *name, const char *file, int line,
				 struct arena *arena);

/* Adds an attribute to an element of element_make, at most ELEMENT_MAKE_ATTRIBUTES. */
void element_put(struct xml_element *el, const char *name, const char *value);

/* A parameter: a new element of `in` with `name` and `value`. false: out of memory. */
bool element_value(struct xml_element *in, const char *kind, const char *name, const char *value, struct arena *arena);

#endif
