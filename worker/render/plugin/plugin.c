/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Look-ups in the tables of plug-ins, and two tables of this file's own: the parameters that 0.5 and 0.6 named
 * differently, and those plug-ins of Mitsuba that the other tables do not list. The tables have some dozens of rows and
 * are searched linearly.
 *
 * Nothing fails: a name that is in no table gives NULL or false, and the caller reports it with the most similar name.
 */
#include "worker/render/plugin/plugin.h"

#include <string.h>
#include <strings.h>

static const char *const class_names[PLUGIN_CLASSES] = {
	[PLUGIN_SHAPE] = "shape",     [PLUGIN_BSDF] = "bsdf",	    [PLUGIN_TEXTURE] = "texture",
	[PLUGIN_EMITTER] = "emitter", [PLUGIN_SENSOR] = "sensor",   [PLUGIN_FILM] = "film",
	[PLUGIN_RFILTER] = "rfilter", [PLUGIN_SAMPLER] = "sampler", [PLUGIN_INTEGRATOR] = "integrator",
	[PLUGIN_MEDIUM] = "medium",   [PLUGIN_PHASE] = "phase",	    [PLUGIN_VOLUME] = "volume",
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

static bool is_wildcard(const char *name)
{
	return strcmp(name, "*") == 0;
}

const struct plugin_decl *plugin_find(const struct plugin_decl *decls, enum plugin_class cls, const char *type)
{
	const struct plugin_decl *wildcard = NULL;
	for (const struct plugin_decl *d = decls; d->type; d++) {
		if (d->cls != cls)
			continue;
		/* Mitsuba opens a file of this name, so "Sphere" works on Windows. */
		if (strcasecmp(d->type, type) == 0)
			return d;
		if (is_wildcard(d->type))
			wildcard = d;
	}
	return wildcard;
}

const struct param *plugin_find_param(const struct plugin_decl *d, const char *name)
{
	const struct param *wildcard = NULL;
	for (const struct param *p = d->params; p && p->name; p++) {
		if (strcmp(p->name, name) == 0)
			return p;
		if (is_wildcard(p->name))
			wildcard = p;
	}
	return wildcard;
}

bool plugin_any_has_param(const struct plugin_decl *decls, const char *name)
{
	for (; decls->type; decls++)
		for (const struct param *p = decls->params; p && p->name; p++)
			if (strcmp(p->name, name) == 0)
				return true;
	return false;
}

static const struct {
	enum plugin_class cls;
	const char *type, *old, *current;
} renamed_params[] = {
	{PLUGIN_BSDF, "diffuse", "diffuse_reflectance", "reflectance"},
	{PLUGIN_BSDF, "roughdiffuse", "diffuse_reflectance", "reflectance"},
	{PLUGIN_MEDIUM, "heterogeneous", "density", "sigma_t"},
};

bool plugin_renamed_param(size_t i, struct renamed_name *out)
{
	if (i >= sizeof renamed_params / sizeof *renamed_params)
		return false;
	*out = (struct renamed_name){.element = class_names[renamed_params[i].cls],
				     .type = renamed_params[i].type,
				     .old = renamed_params[i].old,
				     .current = renamed_params[i].current,
				     .is_parameter = true};
	return true;
}

const char *plugin_current_param_name(const struct plugin_decl *d, const char *name)
{
	for (size_t i = 0; i < sizeof renamed_params / sizeof *renamed_params; i++)
		if (renamed_params[i].cls == d->cls && strcmp(renamed_params[i].type, d->type) == 0 &&
		    strcmp(renamed_params[i].old, name) == 0)
			return renamed_params[i].current;
	return name;
}

bool plugin_is_sampling_hint(const char *element, const char *type)
{
	return strcmp(element, class_names[PLUGIN_EMITTER]) == 0 && type && strcasecmp(type, "portal") == 0;
}

static const struct {
	enum plugin_class cls;
	const char *type;
} mitsuba_plugins[] = {
	{PLUGIN_SHAPE, "deformable"},
	{PLUGIN_SHAPE, "displace"},
	{PLUGIN_SHAPE, "ellipsoids"},
	{PLUGIN_SHAPE, "ellipsoidsmesh"},
	{PLUGIN_SHAPE, "mergeinstance"},
	{PLUGIN_SHAPE, "packed"},
	{PLUGIN_BSDF, "acousticbsdf"},
	{PLUGIN_BSDF, "dielectric_disp"},
	{PLUGIN_BSDF, "irawan"},
	{PLUGIN_BSDF, "neuralbsdf"},
	{PLUGIN_BSDF, "openpbr"},
	{PLUGIN_TEXTURE, "color_ramp"},
	{PLUGIN_TEXTURE, "curvature"},
	{PLUGIN_TEXTURE, "fieldtexture"},
	{PLUGIN_TEXTURE, "lut"},
	{PLUGIN_TEXTURE, "math"},
	{PLUGIN_TEXTURE, "mesh_attribute"},
	{PLUGIN_TEXTURE, "mix_rgb"},
	{PLUGIN_TEXTURE, "uv_set_selector"},
	{PLUGIN_TEXTURE, "vertexcolors"},
	{PLUGIN_TEXTURE, "volume"},
	{PLUGIN_EMITTER, "astroobject"},
	{PLUGIN_SENSOR, "distant"},
	{PLUGIN_SENSOR, "fluxmeter"},
	{PLUGIN_SENSOR, "hdistant"},
	{PLUGIN_SENSOR, "irradiancemeter"},
	{PLUGIN_SENSOR, "microphone"},
	{PLUGIN_SENSOR, "radiancemeter"},
	{PLUGIN_SAMPLER, "halton"},
	{PLUGIN_SAMPLER, "hammersley"},
	{PLUGIN_SAMPLER, "independent"},
	{PLUGIN_SAMPLER, "ldsampler"},
	{PLUGIN_SAMPLER, "multijitter"},
	{PLUGIN_SAMPLER, "orthogonal"},
	{PLUGIN_SAMPLER, "sobol"},
	{PLUGIN_SAMPLER, "stratified"},
	{PLUGIN_FILM, "specfilm"},
	{PLUGIN_FILM, "tape"},
	{PLUGIN_MEDIUM, "heterogeneous"},
	{PLUGIN_MEDIUM, "homogeneous"},
	{PLUGIN_PHASE, "kkay"},
	{PLUGIN_PHASE, "microflake"},
	{PLUGIN_VOLUME, "hgridvolume"},
	{PLUGIN_VOLUME, "volcache"},
};

const char *plugin_mitsuba_at(size_t index, enum plugin_class *cls)
{
	if (index >= sizeof mitsuba_plugins / sizeof *mitsuba_plugins)
		return NULL;
	*cls = mitsuba_plugins[index].cls;
	return mitsuba_plugins[index].type;
}

bool plugin_is_known_to_mitsuba(enum plugin_class cls, const char *type)
{
	for (size_t i = 0; i < sizeof mitsuba_plugins / sizeof *mitsuba_plugins; i++)
		if (mitsuba_plugins[i].cls == cls && strcasecmp(mitsuba_plugins[i].type, type) == 0)
			return true;
	return false;
}

void plugin_offer_types(const struct plugin_decl *decls, enum plugin_class cls, struct spelling *s)
{
	for (const struct plugin_decl *d = decls; d->type; d++)
		if (d->cls == cls && !is_wildcard(d->type))
			spelling_offer(s, d->type);
}

void plugin_offer_params(const struct plugin_decl *d, struct spelling *s)
{
	for (const struct param *p = d->params; p && p->name; p++)
		if (!is_wildcard(p->name))
			spelling_offer(s, p->name);
}

void plugin_list_types(const struct plugin_decl *decls, enum plugin_class cls, char *text, size_t size)
{
	text[0] = 0;
	for (const struct plugin_decl *d = decls; d->type; d++)
		if (d->cls == cls && !is_wildcard(d->type))
			spelling_append_to_list(text, size, d->type);
	if (!text[0])
		spelling_append_to_list(text, size, "none");
}

void plugin_list_params(const struct plugin_decl *d, char *text, size_t size)
{
	text[0] = 0;
	for (const struct param *p = d->params; p && p->name; p++)
		if (p->status == PARAM_UNDERSTOOD && !is_wildcard(p->name))
			spelling_append_to_list(text, size, p->name);
	if (!text[0])
		spelling_append_to_list(text, size, "none");
}
