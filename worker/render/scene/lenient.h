/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What stands in for what is not supported, where the user asked for leniency. Whatever is replaced or left out is
 * noted by the reader. Pure; any thread.
 */
#ifndef WORKER_RENDER_SCENE_LENIENT_H
#define WORKER_RENDER_SCENE_LENIENT_H

#include "worker/render/scene/id_table.h"
#include "worker/render/scene/node.h"
#include "worker/render/scene/param.h"

#include <stdbool.h>

enum lenient_way {
	LENIENT_REFUSE,	   /* nothing is like it: a sensor */
	LENIENT_LEAVE_OUT, /* a medium, a shape, an emitter, a texture (the parameter keeps its default) */
	LENIENT_REPLACE,   /* by *stand_in of the same class */
	LENIENT_INNER,	   /* by the BSDF inside, where there is one; else as LENIENT_REPLACE */
};

/* For a plug-in that no table has. */
enum lenient_way lenient_plugin(enum plugin_class cls, const char *type, const char **stand_in);

/* The stand-in's parameter that says what `name` said of the plug-in replaced; `name` itself where none does. */
const char *lenient_param(const char *stand_in, const char *name);

/* The BSDF in `n` where `n` is one that holds opaque ones only and that one lets light through; NULL: all is well. */
const struct scene_node *lenient_uncovered(const struct scene_node *n);

/* The BSDF inside one that is not supported; NULL: none. */
struct xml_element *lenient_inner(struct id_table *ids, const struct xml_element *el);

#endif
