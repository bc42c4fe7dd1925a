/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Tables give replacements for plug-ins of other versions and branches of Mitsuba that are known by name. For other
 * names the replacement is guessed from the element: from a shape's file, a sensor's name, a material's parameters. An
 * object without a replacement is left out, or refused.
 *
 * Nothing fails here: the caller reports what is replaced, left out or refused.
 */
#include "worker/render/scene/lenient.h"

#include "worker/render/asset/asset_name.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/text/snake_case.h"

#include <string.h>
#include <strings.h>

static bool is_one_of(const char *name, const char *const *list)
{
	for (; *list; list++)
		if (strcmp(name, *list) == 0)
			return true;
	return false;
}

/* Replacements for plug-ins known by name. */
static const struct {
	enum plugin_class cls;
	const char *type, *stand_in;
} replacements[] = {
	{PLUGIN_BSDF, "measured", "roughplastic"}, /* if its file is missing */
	{PLUGIN_BSDF, "measured_polarized", "roughplastic"},
	{PLUGIN_BSDF, "dielectric_disp", "dielectric"},
	{PLUGIN_BSDF, "disney", "principled"},
	{PLUGIN_BSDF, "openpbr", "principled"},
	/* shows 3 p.m. of the first day instead of the average over all times */
	{PLUGIN_EMITTER, "avg_sunsky", "sunsky"},
};

/* Textures that modify the texture inside them. */
static const char *const texture_modifiers[] = {"lut", "math", "uv_set_selector", NULL};

enum lenient_action lenient_plugin_action(enum plugin_class cls, const char *type, const char **stand_in)
{
	*stand_in = NULL;
	if (cls == PLUGIN_TEXTURE && is_one_of(type, texture_modifiers))
		return LENIENT_INNER;
	for (size_t i = 0; i < sizeof replacements / sizeof *replacements; i++)
		if (replacements[i].cls == cls && strcmp(replacements[i].type, type) == 0) {
			*stand_in = replacements[i].stand_in;
			return LENIENT_REPLACE;
		}
	switch (cls) {
	case PLUGIN_BSDF:
		*stand_in = "diffuse";
		return LENIENT_INNER;
	case PLUGIN_RFILTER:
		*stand_in = "gaussian"; /* less sharp than filters with negative lobes */
		return LENIENT_REPLACE;
	case PLUGIN_PHASE:
		*stand_in = "isotropic";
		return LENIENT_REPLACE;
	case PLUGIN_FILM:
		*stand_in = "hdrfilm"; /* keeps size, filter and crop window; other parameters are left out */
		return LENIENT_REPLACE;
	case PLUGIN_SHAPE:
	case PLUGIN_EMITTER:
	case PLUGIN_TEXTURE:
	case PLUGIN_MEDIUM:
	case PLUGIN_VOLUME:
		return LENIENT_LEAVE_OUT;
	default:
		return LENIENT_REFUSE;
	}
}

/* Returns the plug-in for the mesh file that a shape names; NULL if it names none. */
static const char *mesh_plugin(const struct xml_element *el)
{
	static const char *const formats[] = {"obj", "ply", "serialized"};
	for (const struct xml_element *c = el->first_child; c; c = c->next_sibling) {
		const char *name = xml_attribute_value(c, "name"), *file = xml_attribute_value(c, "value"),
			   *end = file ? strrchr(file, '.') : NULL;
		for (size_t i = 0; end && i < sizeof formats / sizeof *formats; i++)
			if (name && strcmp(name, "filename") == 0 && strcasecmp(end + 1, formats[i]) == 0)
				return formats[i];
	}
	return NULL;
}

/* Returns the first of `parts` that occurs in the type's name; NULL if none does. */
static const char *first_part_in(const char *type, const char *const *parts)
{
	while (*parts && !strcasestr(type, *parts))
		parts++;
	return *parts;
}

/* Returns the camera whose name is part of the type, as in "codedOrthographic" and "thinlens_srf". Other types
 * called a lens or a camera become a camera without a lens. NULL for types that project, or measure light, in some
 * other way. */
static const char *camera_plugin(const char *type)
{
	static const char *const cameras[] = {"perspective", "thinlens",  "orthographic",
					      "telecentric", "spherical", NULL};
	const char *camera = first_part_in(type, cameras);
	if (camera)
		return camera;
	return strcasestr(type, "lens") || strcasestr(type, "camera") ? "perspective" : NULL;
}

static bool has_parameter(const struct xml_element *el, const char *const *list)
{
	for (const struct xml_element *c = el->first_child; c; c = c->next_sibling)
		if (xml_attribute_value(c, "name") && is_one_of(xml_attribute_value(c, "name"), list))
			return true;
	return false;
}

/* Guesses a material by its parameters, whose names most branches of Mitsuba keep, and glass by its type's name. */
static const char *material_plugin(const struct xml_element *el, const char *type, const char *fallback)
{
	static const char *const glass[] = {"dielectric", "glass", NULL}, *const other[] = {"thin", "coat", NULL};
	static const char *const base[] = {"base_color", "baseColor", NULL},
				 *const disney[] = {"metallic", "roughness", NULL},
				 *const metal[] = {"material", "eta", "k", NULL},
				 *const rough[] = {"alpha", "roughness", NULL},
				 *const diffuse[] = {"diffuse_reflectance", "diffuseReflectance", NULL},
				 *const specular[] = {"specular_reflectance", "specularReflectance", NULL};
	if (first_part_in(type, glass) && !first_part_in(type, other) && !has_parameter(el, diffuse))
		return has_parameter(el, rough) ? "roughdielectric" : "dielectric";
	if (has_parameter(el, base) && has_parameter(el, disney))
		return "principled";
	if (has_parameter(el, metal) && has_parameter(el, rough) && !has_parameter(el, diffuse))
		return "roughconductor";
	if (has_parameter(el, diffuse) && has_parameter(el, specular) && has_parameter(el, rough))
		return "roughplastic";
	return fallback;
}

enum lenient_action lenient_element_action(const struct xml_element *el, enum plugin_class cls, const char *type,
					   const char **stand_in)
{
	enum lenient_action action = lenient_plugin_action(cls, type, stand_in);
	const char *mesh = NULL;
	switch (cls) {
	case PLUGIN_BSDF:
		if (action == LENIENT_INNER)
			*stand_in = material_plugin(el, type, *stand_in);
		return action;
	case PLUGIN_SENSOR:
		*stand_in = camera_plugin(type);
		return *stand_in ? LENIENT_REPLACE : action;
	case PLUGIN_SHAPE:
		/* Mitsuba's own `ellipsoids` have a PLY file too, but it contains points. */
		if (plugin_is_known_to_mitsuba(cls, type) || !(mesh = mesh_plugin(el)))
			return action;
		*stand_in = mesh;
		return LENIENT_REPLACE;
	case PLUGIN_EMITTER:
		if (action != LENIENT_LEAVE_OUT || !el->parent || strcmp(el->parent->name, "shape") != 0)
			return action;
		*stand_in = "area";
		return LENIENT_REPLACE;
	default:
		return action;
	}
}

const char *lenient_param_name(const char *stand_in, const char *name)
{
	static const char *const colors[] = {"base_color", "diffuse_reflectance", "color", "diffuse", "albedo", NULL};
	static const char *const days[] = {"start_year", "start_month", "start_day", NULL};
	static const struct {
		const char *other, *principled;
	} renames[] = {
		{"base_metalness", "metallic"},
		{"specular_roughness", "roughness"},
		{"specular_roughness_anisotropy", "anisotropic"},
		{"specular_ior", "eta"},
		{"transmission_weight", "spec_trans"},
		{"coat_weight", "coat"},
		{"fuzz_weight", "sheen"},
		{"specular_transmission", "spec_trans"},
		{"specular_tint", "spec_tint"},
	};
	if (strcmp(stand_in, "diffuse") == 0 && is_one_of(name, colors))
		return "reflectance";
	if (strncmp(stand_in, "rough", strlen("rough")) == 0 && strcmp(name, "roughness") == 0)
		return "alpha";
	bool is_clear = strcmp(stand_in, "dielectric") == 0 || strcmp(stand_in, "roughdielectric") == 0;
	if (is_clear && (strcmp(name, "eta") == 0 || strcmp(name, "ior") == 0))
		return "int_ior";
	if (is_clear && is_one_of(name, colors))
		return "specular_transmittance";
	for (size_t i = 0; i < sizeof renames / sizeof *renames && strcmp(stand_in, "principled") == 0; i++)
		if (strcmp(renames[i].other, name) == 0)
			return renames[i].principled;
	if (strcmp(stand_in, "sunsky") == 0 && is_one_of(name, days))
		return name + strlen("start_");
	return name;
}

bool lenient_is_redundant_param(const char *stand_in, const char *name, const struct xml_element *owner)
{
	static const char *const index_names[] = {"eta", "specular_ior", NULL};
	return strcmp(stand_in, "principled") == 0 && strcmp(name, "specular") == 0 &&
	       has_parameter(owner, index_names);
}

/* Returns whether an object is also given the parameter by its own name, or earlier by the same old name. */
static bool is_given_otherwise(const struct xml_element *el, const char *name_3, const char *old)
{
	bool is_before = true;
	for (const struct xml_element *c = el->parent->first_child; c; c = c->next_sibling) {
		const char *name = xml_attribute_value(c, "name");
		is_before &= c != el;
		if (name && (strcmp(name, name_3) == 0 || (is_before && strcmp(name, old) == 0)))
			return true;
	}
	return false;
}

const struct param *lenient_old_param(const struct plugin_decl *d, bool is_stand_in, const struct xml_element *el,
				      const char *name)
{
	char snake[128];
	if (strlen(name) >= sizeof snake / 2)
		return NULL;
	snake_case_from_camel(name, snake);
	const char *new_name = plugin_current_param_name(d, snake);
	bool is_picture = d->cls == PLUGIN_EMITTER && strcmp(d->type, "projector") == 0 &&
			  strcmp(new_name, "texture") == 0 &&
			  (strcmp(el->name, "texture") == 0 || strcmp(el->name, "ref") == 0);
	const struct param *p = plugin_find_param(d, is_picture	   ? "irradiance"
						     : is_stand_in ? lenient_param_name(d->type, new_name)
								   : new_name);
	return p && !is_given_otherwise(el, p->name, name) ? p : NULL;
}

/* Returns whether the material, or one inside it, lets light through. */
static bool transmits_light(const struct scene_node *n)
{
	static const char *const types[] = {"null",	  "polarizer",	     "circular",       "retarder",  "mask",
					    "dielectric", "roughdielectric", "thindielectric", "difftrans", "hk",
					    NULL},
				 *const parameters[] = {"spec_trans", "diff_trans", NULL};
	if (is_one_of(n->type, types))
		return true;
	for (uint32_t i = 0; i < n->property_count; i++) {
		const struct value *v = &n->properties[i].value;
		bool is_zero = v->type == VALUE_FLOAT && v->as.number == 0;
		if (is_one_of(n->properties[i].name, parameters) && !is_zero)
			return true;
	}
	for (uint32_t i = 0; i < n->child_count; i++)
		if (n->children[i]->cls == PLUGIN_BSDF && transmits_light(n->children[i]))
			return true;
	return false;
}

const struct scene_node *lenient_transmissive_inner(const struct scene_node *n)
{
	static const char *const opaque_holders[] = {"coating", "roughcoating", "twosided", NULL};
	const struct scene_node *inner = n->cls == PLUGIN_BSDF ? node_child(n, PLUGIN_BSDF, 0) : NULL;
	return inner && is_one_of(n->type, opaque_holders) && transmits_light(inner) ? inner : NULL;
}

const char *lenient_texture_hint(const char *sentence)
{
	size_t n = strlen(sentence);
	return n && sentence[n - 1] == '?' ? &LENIENT_TEXTURE_HINT[1] : LENIENT_TEXTURE_HINT;
}

bool lenient_needs_texture(const char *type)
{
	static const char *const types[] = {"bumpmap", "normalmap", "mask", "scale", NULL};
	return is_one_of(type, types);
}

const char *lenient_missing_file(const struct asset_source *assets, const struct xml_element *el)
{
	const char *type = xml_attribute_value(el, "type");
	bool is_measured = type && (strcasecmp(type, "measured") == 0 || strcasecmp(type, "measured_polarized") == 0);
	if (strcmp(el->name, "texture") != 0 && !(strcmp(el->name, "bsdf") == 0 && is_measured))
		return NULL;
	for (const struct xml_element *c = el->first_child; c; c = c->next_sibling) {
		const char *name = xml_attribute_value(c, "name"), *file = xml_attribute_value(c, "value"), *rest;
		struct asset asset;
		struct error e;
		if (strcmp(c->name, "string") != 0 || !name || strcmp(name, "filename") != 0 || !file)
			continue;
		int r = assets->open(assets->user, file, &asset, &e);
		if (!r)
			assets->close(assets->user, &asset);
		return r == -ENOENT || (r && asset_name_levels_up(file, &rest) == ASSET_NAME_ABSOLUTE) ? file : NULL;
	}
	return NULL;
}

/* Returns whether a material is a clear coat, which has no colour of its own: the material below it gives the
 * colour. */
static bool is_coat(const struct xml_element *bsdf)
{
	static const char *const clear[] = {"dielectric", "null", NULL};
	const char *type = xml_attribute_value(bsdf, "type");
	return type && first_part_in(type, clear);
}

struct xml_element *lenient_find_inner(struct id_table *ids, const struct xml_element *el, enum plugin_class wanted)
{
	struct error unused;
	enum plugin_class cls;
	struct xml_element *coat = NULL;
	for (struct xml_element *c = el->first_child; c; c = c->next_sibling) {
		struct xml_element *target = c;
		if (strcmp(c->name, "ref") == 0 && id_table_resolve(ids, c, &target, &unused))
			continue;
		if (!plugin_class_find(target->name, &cls) || cls != wanted)
			continue;
		if (cls != PLUGIN_BSDF || !is_coat(target))
			return target;
		coat = coat ? coat : target;
	}
	return coat;
}
