/* SPDX-License-Identifier: Apache-2.0 */
/* Look-ups in the tables of plug-ins. Pure; any thread. */
#ifndef WORKER_RENDER_PLUGIN_PLUGIN_H
#define WORKER_RENDER_PLUGIN_PLUGIN_H

#include "common/base/spelling.h"
#include "worker/render/plugin/param.h"

#include <stdbool.h>
#include <stddef.h>

const char *plugin_class_name(enum plugin_class cls);		     /* "bsdf" */
bool plugin_class_find(const char *element, enum plugin_class *cls); /* also finds <camera>, the old name of <sensor> */
void plugin_offer_classes(struct spelling *s);

/* Each returns the entry with that name, or else the "*" entry; NULL if there is neither. */
const struct plugin_decl *plugin_find(const struct plugin_decl *decls, enum plugin_class cls, const char *type);
const struct param *plugin_find_param(const struct plugin_decl *d, const char *name);

/* Returns whether any plug-in in the tables has a parameter of that name. */
bool plugin_any_has_param(const struct plugin_decl *decls, const char *name);

/* Returns Mitsuba 3's name for a parameter that 0.5/0.6 calls by another word (not just in camelCase); any other
 * name is returned as it is. */
const char *plugin_current_param_name(const struct plugin_decl *d, const char *name);

/* A name that older versions used, and the name that it is read as. */
struct renamed_name {
	int dropped_in_minor;	    /* the minor version of 0.x that dropped the old name; 0: any version */
	const char *element, *type; /* where the rule applies; NULL: anywhere */
	const char *old, *current;
	bool is_parameter; /* a parameter's name; otherwise the name of a type or, if `element` is NULL, of an element
			    */
};
bool plugin_renamed_param(size_t i, struct renamed_name *out); /* false: i is past the last name */

/* Returns whether an object only tells Mitsuba where light comes from and does not change the image. type may be
 * NULL. */
bool plugin_is_sampling_hint(const char *element, const char *type);

/* Returns whether Mitsuba (0.6 or 3) has a plug-in of this name that has no entry of its own in the tables, or had
 * none in earlier versions of the tables. */
bool plugin_is_known_to_mitsuba(enum plugin_class cls, const char *type);
/* Returns the index-th of these plug-ins and stores its class; NULL after the last. */
const char *plugin_mitsuba_at(size_t index, enum plugin_class *cls);

void plugin_offer_types(const struct plugin_decl *decls, enum plugin_class cls, struct spelling *s);
void plugin_offer_params(const struct plugin_decl *d, struct spelling *s);
void plugin_list_types(const struct plugin_decl *decls, enum plugin_class cls, char *text, size_t size);
void plugin_list_params(const struct plugin_decl *d, char *text, size_t size); /* only parameters that are understood */

#endif
