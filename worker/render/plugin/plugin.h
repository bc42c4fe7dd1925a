/* SPDX-License-Identifier: Apache-2.0 */
/* Look-ups in the tables of plug-ins. Pure; any thread. */
#ifndef WORKER_RENDER_PLUGIN_PLUGIN_H
#define WORKER_RENDER_PLUGIN_PLUGIN_H

#include "common/base/spelling.h"
#include "worker/render/plugin/param.h"

#include <stdbool.h>
#include <stddef.h>

const char *plugin_class_name(enum plugin_class cls);		     /* "bsdf" */
bool plugin_class_find(const char *element, enum plugin_class *cls); /* also <camera>, the old name of <sensor> */
void plugin_offer_classes(struct spelling *s);

/* The entry with that name, or the class's "*"; NULL: unknown. */
const struct plugin_decl *plugin_find(const struct plugin_decl *decls, enum plugin_class cls, const char *type);
const struct param *plugin_param(const struct plugin_decl *d, const char *name);

/* Whether any of them has a parameter of that name. */
bool plugin_any_has(const struct plugin_decl *decls, const char *name);

/* The 3.x name of what 0.5/0.6 names differently, beyond the spelling; otherwise the name itself. */
const char *plugin_new_name(const struct plugin_decl *d, const char *name);

/* A name of an older version, and the one that it is read as. */
struct renamed {
	int before;		    /* the minor version of 0.x that dropped it; 0: any */
	const char *element, *type; /* what has it, or in which a parameter is; NULL: any */
	const char *old, *now;
	bool parameter; /* a parameter's name; otherwise a type's, or without `element` an element's */
};
bool plugin_new_name_at(size_t i, struct renamed *out); /* false: no more */

/* An object in the scene that only tells Mitsuba where light comes from, and changes no image. type: NULL: none. */
bool plugin_is_guide(const char *element, const char *type);

/* Whether it is one of Mitsuba's own plug-ins, of either dialect, that the tables lack, or lacked, by this name. */
bool plugin_is_mitsubas(enum plugin_class cls, const char *type);
/* The index-th of these, with its class; NULL: no more. */
const char *plugin_of_mitsuba(size_t index, enum plugin_class *cls);

void plugin_offer_types(const struct plugin_decl *decls, enum plugin_class cls, struct spelling *s);
void plugin_offer_params(const struct plugin_decl *d, struct spelling *s);
void plugin_list_types(const struct plugin_decl *decls, enum plugin_class cls, char *text, size_t size);
void plugin_list_params(const struct plugin_decl *d, char *text, size_t size); /* the understood ones */

#endif
