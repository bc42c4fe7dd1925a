/* SPDX-License-Identifier: Apache-2.0 */
/* Looking things up in the tables of plug-ins, and saying what is in them. Pure; any thread. */
#ifndef WORKER_RENDER_SCENE_PLUGIN_H
#define WORKER_RENDER_SCENE_PLUGIN_H

#include "common/base/spelling.h"
#include "worker/render/scene/param.h"

#include <stdbool.h>
#include <stddef.h>

const char *plugin_class_name(enum plugin_class cls);		     /* "bsdf" */
bool plugin_class_find(const char *element, enum plugin_class *cls); /* also <camera>, the old name of <sensor> */
void plugin_offer_classes(struct spelling *s);

/* The entry of that name, or the class's "*"; NULL: unknown. */
const struct plugin_decl *plugin_find(const struct plugin_decl *decls, enum plugin_class cls, const char *type);
const struct param *plugin_param(const struct plugin_decl *d, const char *name);

/* The name in 3.x of what 0.5/0.6 has another name for, beyond the spelling; else the name itself. */
const char *plugin_new_name(const struct plugin_decl *d, const char *name);

/* Is it one of Mitsuba's own plug-ins, of either dialect, of those that are not supported or have not been? */
bool plugin_is_mitsubas(enum plugin_class cls, const char *type);
/* The index-th of all, with its class; NULL: there are no more. */
const char *plugin_of_mitsuba(size_t index, enum plugin_class *cls);

void plugin_offer_types(const struct plugin_decl *decls, enum plugin_class cls, struct spelling *s);
void plugin_offer_params(const struct plugin_decl *d, struct spelling *s);
void plugin_list_types(const struct plugin_decl *decls, enum plugin_class cls, char *text, size_t size);
void plugin_list_params(const struct plugin_decl *d, char *text, size_t size); /* the understood ones */

#endif
