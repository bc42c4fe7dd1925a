/* SPDX-License-Identifier: Apache-2.0 */
/* An element of a scene file, its attributes, and elements inside. Pure. */
#ifndef WORKER_RENDER_XML_ELEMENT_H
#define WORKER_RENDER_XML_ELEMENT_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct scene_node;

struct xml_attribute {
	const char *name, *value;
};

/* What an object holds when all references are followed, itself included (nesting.h). */
struct xml_nesting {
	uint32_t height;
	uint64_t objects;
};

struct xml_element {
	const char *name, *file;
	int line;
	bool snake;   /* names are to be converted from camelCase (version < 2) */
	bool ignored; /* it or one of those around it has no meaning here */
	bool text;    /* holds text other than blanks */
	bool unset;   /* a $name in it has no value, or the file to include is not there: reported by xml.c */
	uint32_t attribute_count;
	struct xml_attribute *attributes;
	struct xml_element *parent, *first, *last, *next;
	const struct scene_node *node;	  /* for the interpreter: what it became */
	const struct scene_node *limited; /* for the interpreter: a texture with colours of 1 at most (over_one.h) */
	struct xml_nesting nesting;	  /* for the interpreter: of that node */
	bool busy, told; /* for the interpreter: being made into a node; cannot be, and that has been said */
	bool counted;	 /* for the interpreter: among the objects of the scene */
};

/* The value of a property that stands for a member of a glTF file which has no counterpart here. */
#define ELEMENT_UNSUPPORTED "unsupported"

const char *xml_attribute(const struct xml_element *el, const char *name); /* NULL: none */

/* How the file spells the parameter that the element gives; `name`, the spelling of 3.x, where it has no name of its
 * own. */
const char *element_spelling(const struct xml_element *el, const char *name);

/* Whether a value in it, such as a step of a transform, is unset. */
bool element_is_unset(const struct xml_element *el);

/* error_set with "file:line: <element>: " before the text. */
__attribute__((format(printf, 4, 5))) int xml_error(const struct xml_element *el, struct error *e, int errno_value,
						    const char *format, ...);

/* Refuses attributes that are not in `known` (a list with '|' between), text and, unless `children`, elements inside.
 */
int element_check(const struct xml_element *el, const char *known, bool children, struct error *e);
const char *element_next_name(const char *list, char *name, size_t size); /* walks such a list; NULL at the end */

#endif
