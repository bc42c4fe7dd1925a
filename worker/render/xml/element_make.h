/* SPDX-License-Identifier: Apache-2.0 */
/* Makes elements that do not come from an XML file but from the contents of other files. One thread; they are
 * allocated in the given arena. */
#ifndef WORKER_RENDER_XML_ELEMENT_MAKE_H
#define WORKER_RENDER_XML_ELEMENT_MAKE_H

#include "common/base/arena.h"
#include "worker/render/xml/element.h"

enum { ELEMENT_MAKE_ATTRIBUTES_MAX = 4 };

/* Appends `el` to the children of `parent`. */
void element_append(struct xml_element *parent, struct xml_element *el);

/* Makes an element that is reported at that place in a file, and appends it to `parent` unless that is NULL. Returns
 * NULL if out of memory. */
struct xml_element *element_make(struct xml_element *parent, const char *name, const char *file, int line,
				 struct arena *arena);

/* Adds an attribute to an element made by element_make(), which has room for ELEMENT_MAKE_ATTRIBUTES_MAX of them. */
void element_add_attribute(struct xml_element *el, const char *name, const char *value);

/* Appends a parameter to `parent`: an element `kind` with `name` and `value`. Returns false if out of memory. */
bool element_add_parameter(struct xml_element *parent, const char *kind, const char *name, const char *value,
			   struct arena *arena);

#endif
