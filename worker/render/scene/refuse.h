/* SPDX-License-Identifier: Apache-2.0 */
/* The sentences for unknown and unsupported elements, types and parameters, with the nearest name. Each returns
 * -EINVAL. Pure. */
#ifndef WORKER_RENDER_SCENE_REFUSE_H
#define WORKER_RENDER_SCENE_REFUSE_H

#include "worker/render/xml/element.h"
#include "worker/render/plugin/param.h"

/* An element that is not allowed where it stands. */
int refuse_element(const struct xml_element *el, struct error *e);

/* An object of an unknown type, or of one of Mitsuba's types that is not supported. */
int refuse_type(const struct plugin_decl *decls, const struct xml_element *el, enum plugin_class cls, const char *type,
		struct error *e);

/* The parameter that a name which `owner` does not have is a misspelling of, another usual name for, or, where the
 * parameter has an effect, a part of; NULL: none. */
const struct param *meant_parameter(const struct plugin_decl *owner, const char *name);

/* A parameter of `owner`, whose type in the file is `type`: unknown (p NULL), or not supported. */
int refuse_property(const struct plugin_decl *owner, const char *type, const struct xml_element *el, const char *name,
		    const struct param *p, struct error *e);

#endif
