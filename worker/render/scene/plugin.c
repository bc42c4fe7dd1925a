/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/plugin.h"

#include <string.h>
#include <strings.h>

static const char *const class_names[PLUGIN_CLASSES] = {
	[PLUGIN_SHAPE] = "shape",     [PLUGIN_BSDF] = "bsdf",	    [PLUGIN_TEXTURE] = "texture",
	[PLUGIN_EMITTER] = "emitter", [PLUGIN_SENSOR] = "sensor",   [PLUGIN_FILM] = "film",
	[PLUGIN_RFILTER] = "rfilter", [PLUGIN_SAMPLER] = "sampler", [PLUGIN_INTEGRATOR] = "integrator",
	[PLUGIN_MEDIUM] = "medium",
};

const char *plugin_class_name(enum plugin_class cls)
{
	return class_names[cls];
}

bool plugin_class_find(const char *element, enum plugin_class *cls)
{
	for (int i = 0; i < PLUGIN_CLASSES; i++)
		if (strcmp(class_names[i], element) == 0) {
			*cls = (enum plugin_class)i;
			return true;
		}
	*cls = PLUGIN_SENSOR;
	return strcmp(element, "camera") == 0;
}

void plugin_offer_classes(struct spelling *s)
{
	for (int i = 0; i < PLUGIN_CLASSES; i++)
		spelling_offer(s, class_names[i]);
}

static bool is_any(const char *name)
{
	return strcmp(name, "*") == 0;
}

const struct plugin_decl *plugin_find(const struct plugin_decl *decls, enum plugin_class cls, const char *type)
{
	const struct plugin_decl *any = NULL;
	for (const struct plugin_decl *d = decls; d->type; d++) {
		if (d->cls != cls)
			continue;
		if (strcasecmp(d->type, type) ==
		    0) /* Mitsuba looks for a file of this name: "Sphere" on Windows, too */
			return d;
		if (is_any(d->type))
			any = d;
	}
	return any;
}

const struct param *plugin_param(const struct plugin_decl *d, const char *name)
{
	const struct param *any = NULL;
	for (const struct param *p = d->params; p && p->name; p++) {
		if (strcmp(p->name, name) == 0)
			return p;
		if (is_any(p->name))
			any = p;
	}
	return any;
}

void plugin_offer_types(const struct plugin_decl *decls, enum plugin_class cls, struct spelling *s)
{
	for (const struct plugin_decl *d = decls; d->type; d++)
		if (d->cls == cls && !is_any(d->type))
			spelling_offer(s, d->type);
}

void plugin_offer_params(const struct plugin_decl *d, struct spelling *s)
{
	for (const struct param *p = d->params; p && p->name; p++)
		if (!is_any(p->name))
			spelling_offer(s, p->name);
}

void plugin_list_types(const struct plugin_decl *decls, enum plugin_class cls, char *text, size_t size)
{
	text[0] = 0;
	for (const struct plugin_decl *d = decls; d->type; d++)
		if (d->cls == cls && !is_any(d->type))
			spelling_list(text, size, d->type);
	if (!text[0])
		spelling_list(text, size, "none");
}

void plugin_list_params(const struct plugin_decl *d, char *text, size_t size)
{
	text[0] = 0;
	for (const struct param *p = d->params; p && p->name; p++)
		if (p->status == PARAM_UNDERSTOOD && !is_any(p->name))
			spelling_list(text, size, p->name);
	if (!text[0])
		spelling_list(text, size, "none");
}
