/* SPDX-License-Identifier: Apache-2.0 */
/* The errors for unknown and unsupported elements, types and parameters, with the most similar name. Each function
 * returns a negative errno. Pure. */
#ifndef WORKER_RENDER_SCENE_REFUSE_H
#define WORKER_RENDER_SCENE_REFUSE_H

#include "worker/render/xml/element.h"
#include "worker/render/plugin/param.h"

/* Refuses an element that is not allowed where it stands. */
int refuse_element(const struct xml_element *el, struct error *e);

/* Refuses an object of an unknown type, or of a type that Mitsuba has but that is not supported. */
int refuse_type(const struct plugin_decl *decls, const struct xml_element *el, enum plugin_class cls, const char *type,
		struct error *e);

/* Returns the plug-in whose name an unknown type resembles, under which refuse_type says that its content is checked;
 * NULL if there is none. */
const struct plugin_decl *refuse_guess_type(const struct plugin_decl *decls, const struct xml_element *el,
					    enum plugin_class cls, const char *type);

/* Returns the parameter of `owner` that an unknown name may mean: as a misspelling, as another usual name, or, if
 * the parameter has an effect, as a part of its name. NULL if there is none. */
const struct param *refuse_guess_parameter(const struct plugin_decl *owner, const char *name);

/* Refuses a parameter that is unknown (p NULL) or not supported. `owner` is the plug-in, `type` the type written in
 * the file. */
int refuse_property(const struct plugin_decl *owner, const char *type, const struct xml_element *el, const char *name,
		    const struct param *p, struct error *e);

#endif
