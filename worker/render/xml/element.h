/* SPDX-License-Identifier: Apache-2.0 */
/* An element of a scene file, its attributes and its child elements. Pure. */
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

/* What an object contains when all references are followed, itself included (nesting.h). */
struct xml_nesting {
	uint32_t height;
	bool exceeds_limits; /* the limits are exceeded, and the other members no longer count */
	uint64_t object_count;
};

struct xml_element {
	const char *name, *file;
	int line;
	bool is_camel_case; /* names are camelCase and have to be converted (version < 2) */
	bool is_ignored;    /* this element or one around it has no meaning here */
	bool has_text;	    /* contains text other than blanks */
	bool is_unset;	    /* a $name in it has no value, or its include file is missing; xml.c has reported it */
	uint32_t attribute_count;
	struct xml_attribute *attributes;
	struct xml_element *parent, *first_child, *last_child, *next_sibling;
	const struct scene_node *node;	       /* for the interpreter: the node made from it */
	const struct scene_node *limited_node; /* for the interpreter: with colours limited to 1 (limit_to_one.h) */
	struct xml_nesting nesting;	       /* for the interpreter: what that node contains */
	bool is_in_progress, is_rejected; /* for the interpreter: it is being made into a node; it cannot be made into
					     one, which has been reported */
	bool is_counted;		  /* for the interpreter: included in the scene's count of objects */
	bool is_too_deep; /* for the interpreter: a reference to it is too deep, which has been reported */
};

/* The value of a property that stands for a member of a glTF file without a counterpart here. */
#define ELEMENT_UNSUPPORTED "unsupported"

const char *xml_attribute_value(const struct xml_element *el, const char *name); /* NULL: none */

/* Returns the parameter's name as the file spells it; `name`, the spelling of 3.x, if the element has no name of its
 * own. */
const char *element_written_name(const struct xml_element *el, const char *name);

/* Returns whether the element or a descendant, such as a step of a transform, is unset. */
bool element_is_unset(const struct xml_element *el);

/* Like error_set(), with "file:line: <element>: " before the text. */
__attribute__((format(printf, 4, 5))) int xml_error(const struct xml_element *el, struct error *e, int errno_value,
						    const char *format, ...);

/* Refuses an element for lack of an attribute, with the attribute that may be meant for it. */
int element_refuse_missing_attribute(const struct xml_element *el, const char *attribute, struct error *e);

/* Refuses attributes that are not in `allowed_attributes` (names separated by '|'), text and, unless `allow_children`
 * is set, child elements. */
int element_check_contents(const struct xml_element *el, const char *allowed_attributes, bool allow_children,
			   struct error *e);
const char *element_next_name(const char *list, char *name, size_t size); /* iterates over `list`; NULL at its end */

#endif
