/* SPDX-License-Identifier: Apache-2.0 */
/*
 * upgrade_element() walks over the file's elements, outer ones first, so that rules see the enclosing elements under
 * their new names. Rules are rows of tables, like Mitsuba's own; those that need more than a new name are functions.
 *
 * Before 0.3, more than names was different: `phong`, `ward` and `microfacet` had two factors besides their colours,
 * and other defaults; `mirror` was smooth chrome; and <lookAt ox="..." ...> was mirrored. In files of 2.x and 3.x only
 * one name has changed since: `disney`, under which Mitsuba's `principled` was known before its release.
 *
 * The only failure is running out of memory.
 */
#include "worker/render/xml/upgrade.h"

#include "worker/render/text/number.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

/* A rule. before_minor: the minor version from which it no longer applies (4: files before 0.4). NULL: any element or
 * type. */
struct rename_rule {
	int before_minor;
	const char *element, *type, *old_name, *new_name;
};

static const struct rename_rule type_renames[] = {
	{5, "bsdf", NULL, "bump", "bumpmap"},
	{4, "film", NULL, "exrfilm", "hdrfilm"},
	{4, "film", NULL, "pngfilm", "ldrfilm"},
	{3, "bsdf", NULL, "lambertian", "diffuse"},
	{3, "bsdf", NULL, "roughmetal", "roughconductor"},
	{3, "bsdf", NULL, "roughglass", "roughdielectric"},
	{3, "bsdf", NULL, "composite", "mixturebsdf"},
	{3, "texture", NULL, "exrtexture", "bitmap"},
	{3, "texture", NULL, "ldrtexture", "bitmap"},
	{3, "bsdf", NULL, "mirror", "conductor"},
	{3, "bsdf", NULL, "microfacet", "roughplastic"},
};

/* Names of parameters: of children of an element with that name and type. */
static const struct rename_rule parameter_renames[] = {
	{4, "emitter", "area", "intensity", "radiance"},
	{4, "emitter", "constant", "intensity", "radiance"},
	{4, "emitter", "directional", "intensity", "irradiance"},
	{4, "emitter", NULL, "intensityScale", "scale"},
	{4, "sensor", NULL, "focusDepth", "focusDistance"},
	{3, "shape", "sphere", "inverted", "flipNormals"},
	{3, "shape", "cylinder", "p1", "p0"},
	{3, "shape", "cylinder", "p2", "p1"},
	{3, "texture", "checkerboard", "brightColor", "color0"},
	{3, "texture", "checkerboard", "darkColor", "color1"},
	{3, "texture", "gridtexture", "brightColor", "color0"},
	{3, "texture", "gridtexture", "darkColor", "color1"},
	{3, "bsdf", "roughconductor", "alphaB", "alpha"},
	{3, "bsdf", "roughconductor", "ior", "eta"},
	{3, "bsdf", "roughplastic", "alphaB", "alpha"},
	{3, "bsdf", "ward", "alphaX", "alphaU"},
	{3, "bsdf", "ward", "alphaY", "alphaV"},
	{3, "bsdf", "roughdielectric", "alphaB", "alpha"},
};

static const struct rename_rule element_renames[] = {{4, NULL, NULL, "luminaire", "emitter"},
						     {4, NULL, NULL, "camera", "sensor"}};

/* `thin` selects between this and `principledthin`. */
static const struct rename_rule prerelease_renames[] = {{0, "bsdf", NULL, "disney", "principled"}};

bool upgrade_rename_at(size_t i, struct renamed_name *out)
{
	static const struct {
		const struct rename_rule *names;
		size_t count;
		bool parameters;
	} tables[] = {{element_renames, sizeof element_renames / sizeof *element_renames, false},
		      {type_renames, sizeof type_renames / sizeof *type_renames, false},
		      {parameter_renames, sizeof parameter_renames / sizeof *parameter_renames, true},
		      {prerelease_renames, sizeof prerelease_renames / sizeof *prerelease_renames, false}};
	for (size_t t = 0; t < sizeof tables / sizeof *tables; i -= tables[t++].count)
		if (i < tables[t].count) {
			const struct rename_rule *n = &tables[t].names[i];
			*out = (struct renamed_name){n->before_minor, n->element,  n->type,
						     n->old_name,     n->new_name, tables[t].parameters};
			return true;
		}
	return false;
}

static bool is_named(const struct xml_element *el, const char *name)
{
	return strcmp(el->name, name) == 0;
}

static bool has_type(const struct xml_element *el, const char *type)
{
	const char *actual = xml_attribute_value(el, "type");
	return !type || (actual && strcmp(actual, type) == 0);
}

static struct xml_attribute *find_attribute(const struct xml_element *el, const char *name)
{
	for (uint32_t i = 0; i < el->attribute_count; i++)
		if (strcmp(el->attributes[i].name, name) == 0)
			return &el->attributes[i];
	return NULL;
}

static void rename_value(const struct rename_rule *rules, size_t count, int minor, const struct xml_element *enclosing,
			 struct xml_attribute *a)
{
	for (size_t i = 0; i < count && a; i++)
		if (minor < rules[i].before_minor && is_named(enclosing, rules[i].element) &&
		    has_type(enclosing, rules[i].type) && strcmp(a->value, rules[i].old_name) == 0) {
			a->value = rules[i].new_name;
			return;
		}
}

/* Inserts an element with one or two attributes as the first child of another. */
static struct xml_element *prepend_child(struct xml_element *parent, const char *name, const char *key,
					 const char *value, const char *key_2, const char *value_2, struct arena *arena)
{
	struct xml_element *el = arena_alloc(arena, 1, sizeof *el);
	struct xml_attribute *a = arena_alloc(arena, 2, sizeof *a);
	if (!el || !a)
		return NULL;
	a[0] = (struct xml_attribute){key, value};
	a[1] = (struct xml_attribute){key_2, value_2};
	*el = (struct xml_element){.name = name,
				   .file = parent->file,
				   .line = parent->line,
				   .is_camel_case = parent->is_camel_case,
				   .attribute_count = key_2 ? 2 : 1,
				   .attributes = a,
				   .parent = parent,
				   .next_sibling = parent->first_child};
	parent->first_child = el;
	parent->last_child = parent->last_child ? parent->last_child : el;
	return el;
}

/* Removes an element whose meaning another element has taken over. */
static void remove_child(struct xml_element *parent, const struct xml_element *el)
{
	struct xml_element *previous = NULL;
	for (struct xml_element *c = parent->first_child; c && c != el; c = c->next_sibling)
		previous = c;
	if (previous)
		previous->next_sibling = el->next_sibling;
	else
		parent->first_child = el->next_sibling;
	if (parent->last_child == el)
		parent->last_child = previous;
}

/* Before 0.4, cameras were mirrored horizontally, and their angle of view was that of the smaller side. */
static bool upgrade_camera(struct xml_element *camera, struct arena *arena)
{
	const char *axis = "smaller";
	for (struct xml_element *c = camera->first_child; c; c = c->next_sibling) {
		const char *name = xml_attribute_value(c, "name"), *value = xml_attribute_value(c, "value");
		if (!name)
			continue;
		if (is_named(c, "transform") && strcmp(name, "toWorld") == 0 &&
		    !prepend_child(c, "scale", "x", "-1", NULL, NULL, arena))
			return false;
		if (is_named(c, "boolean") && strcmp(name, "mapSmallerSide") == 0) {
			axis = value && strcasecmp(value, "false") == 0 ? "larger" : axis;
			remove_child(camera, c);
		}
	}
	return !has_type(camera, "perspective") ||
	       prepend_child(camera, "string", "name", "fovAxis", "value", axis, arena);
}

static struct xml_element *find_child(const struct xml_element *parent, const char *name)
{
	for (struct xml_element *c = parent->first_child; c; c = c->next_sibling) {
		const char *child_name = xml_attribute_value(c, "name");
		if (child_name && strcmp(child_name, name) == 0)
			return c;
	}
	return NULL;
}

/* Materials with a diffuse and a specular lobe, and the default colours of these. */
static const struct lobes {
	const char *type, *diffuse, *specular;
} lobes[] = {{"phong", "0.5", "0.2"}, {"ward", "0.5", "0.2"}, {"microfacet", "0", "1"}};

/* Puts a `scale` texture in the place of a colour, which becomes the texture's value. */
static bool wrap_in_scale(struct xml_element *colour, const char *factor, struct arena *arena)
{
	struct xml_element *inner = arena_alloc(arena, 1, sizeof *inner);
	struct xml_attribute *outer_attributes = arena_alloc(arena, 2, sizeof *outer_attributes),
			     *inner_attributes = arena_alloc(arena, colour->attribute_count, sizeof *inner_attributes);
	if (!inner || !outer_attributes || !inner_attributes)
		return false;
	for (uint32_t i = 0; i < colour->attribute_count; i++) {
		inner_attributes[i] = colour->attributes[i];
		if (strcmp(inner_attributes[i].name, "name") == 0) {
			outer_attributes[0] = inner_attributes[i];
			inner_attributes[i].value = "value";
		}
	}
	outer_attributes[1] = (struct xml_attribute){"type", "scale"};
	*inner = *colour;
	inner->attributes = inner_attributes;
	inner->parent = colour;
	inner->next_sibling = NULL;
	for (struct xml_element *c = inner->first_child; c; c = c->next_sibling)
		c->parent = inner;
	colour->name = "texture";
	colour->attributes = outer_attributes;
	colour->attribute_count = 2;
	colour->first_child = colour->last_child = inner;
	return prepend_child(colour, "float", "name", "scale", "value", factor, arena);
}

/* Applies a factor to a colour; without the factor's element the factor is 1. */
static bool scale_colour(struct xml_element *bsdf, const char *name, const char *factor_name, const char *fallback,
			 struct arena *arena)
{
	struct xml_element *colour = find_child(bsdf, name), *factor_element = find_child(bsdf, factor_name);
	const char *factor = factor_element ? xml_attribute_value(factor_element, "value") : NULL;
	double x;
	bool has_factor = factor && (!number_parse(factor, &x) || x != 1);
	if (factor_element)
		remove_child(bsdf, factor_element);
	if (!colour)
		colour = prepend_child(bsdf, "spectrum", "name", name, "value", fallback, arena);
	return colour && (!has_factor || wrap_in_scale(colour, factor, arena));
}

static bool upgrade_material(struct xml_element *bsdf, struct arena *arena)
{
	if (!xml_attribute_value(bsdf, "type"))
		return true;
	for (size_t i = 0; i < sizeof lobes / sizeof *lobes; i++)
		if (has_type(bsdf, lobes[i].type))
			return scale_colour(bsdf, "specularReflectance", "specularAmount", lobes[i].specular, arena) &&
			       scale_colour(bsdf, "diffuseReflectance", "diffuseAmount", lobes[i].diffuse, arena);
	return !has_type(bsdf, "mirror") || prepend_child(bsdf, "string", "name", "material", "value", "Cr", arena);
}

/* Joins the three attributes that origin, target and up once had, one per number, into one; x is the first letter of
 * their names, such as "o" of ox, oy and oz. */
static bool join_vector(const struct xml_element *el, const char *x, const char *name, struct xml_attribute *out,
			struct arena *arena)
{
	const char *part[3];
	size_t size = 1;
	for (int i = 0; i < 3; i++) {
		part[i] = xml_attribute_value(el, (char[]){*x, (char)('x' + i), 0});
		part[i] = part[i] ? part[i] : "";
		size += strlen(part[i]) + 2;
	}
	char *text = arena_alloc(arena, size, 1);
	if (!text)
		return false;
	snprintf(text, size, "%s, %s, %s", part[0], part[1], part[2]);
	*out = (struct xml_attribute){name, text};
	return true;
}

/* Replaces a lookAt that has such attributes by a scale that mirrors x, followed by a lookAt in today's form. */
static bool upgrade_lookat(struct xml_element *el, struct arena *arena)
{
	struct xml_element *lookat = arena_alloc(arena, 1, sizeof *lookat);
	struct xml_attribute *a = arena_alloc(arena, 3, sizeof *a), *mirror = arena_alloc(arena, 1, sizeof *mirror);
	bool has_up = xml_attribute_value(el, "ux") != NULL;
	if (!lookat || !a || !mirror || !join_vector(el, "o", "origin", &a[0], arena) ||
	    !join_vector(el, "t", "target", &a[1], arena) || (has_up && !join_vector(el, "u", "up", &a[2], arena)))
		return false;
	*lookat = *el;
	lookat->attributes = a;
	lookat->attribute_count = has_up ? 3 : 2;
	*mirror = (struct xml_attribute){"x", "-1"};
	for (struct xml_element *c = lookat->first_child; c; c = c->next_sibling)
		c->parent = lookat;
	/* Otherwise a walk over the elements would return to the wrong one and never end. */
	el->first_child = el->last_child = NULL;
	el->name = "scale";
	el->attributes = mirror;
	el->attribute_count = 1;
	el->next_sibling = lookat;
	if (el->parent->last_child == el)
		el->parent->last_child = lookat;
	return true;
}

/* Applies the rules for files from before 0.3 that need more than a new name. */
static bool upgrade_before_0_3(struct xml_element *el, struct arena *arena)
{
	if (is_named(el, "bsdf"))
		return upgrade_material(el, arena);
	return !is_named(el, "lookAt") || !xml_attribute_value(el, "ox") || upgrade_lookat(el, arena);
}

static int upgrade_element(struct xml_element *el, int minor, struct arena *arena, struct error *e)
{
	int r = 0;
	if (minor < 3 && !upgrade_before_0_3(el, arena))
		return xml_error(el, e, ENOMEM, "out of memory");
	bool is_camera = minor < 4 && is_named(el, "camera");
	for (size_t i = 0; i < sizeof element_renames / sizeof *element_renames; i++)
		if (minor < element_renames[i].before_minor && is_named(el, element_renames[i].old_name))
			el->name = element_renames[i].new_name;
	if (is_camera && !upgrade_camera(el, arena))
		return xml_error(el, e, ENOMEM, "out of memory");
	/* pixelFormat, which has no effect here, has replaced the film's `alpha`. */
	const char *name = xml_attribute_value(el, "name");
	if (minor < 4 && el->parent && is_named(el->parent, "film") && name && strcmp(name, "alpha") == 0)
		el->is_ignored = true;
	struct xml_attribute *scale = minor < 4 && is_named(el, "blackbody") ? find_attribute(el, "multiplier") : NULL;
	if (scale)
		scale->name = "scale";
	rename_value(type_renames, sizeof type_renames / sizeof *type_renames, minor, el, find_attribute(el, "type"));
	if (el->parent)
		rename_value(parameter_renames, sizeof parameter_renames / sizeof *parameter_renames, minor, el->parent,
			     find_attribute(el, "name"));
	for (struct xml_element *c = el->first_child; c && !r; c = c->next_sibling)
		if (!is_named(c, "scene"))
			r = upgrade_element(c, minor, arena, e);
	return r;
}

bool upgrade_is_before_0_3(const struct xml_element *scene)
{
	for (const struct xml_element *el = scene->first_child; el; el = el->next_sibling)
		if (!el->is_ignored &&
		    (is_named(el, "camera") || is_named(el, "luminaire") || upgrade_is_before_0_3(el)))
			return true;
	return false;
}

int upgrade_file(struct xml_element *scene, int minor, struct arena *arena, struct error *e)
{
	return upgrade_element(scene, minor, arena, e);
}

/* The parameter `thin` selected between what are now two plug-ins. */
static void rename_disney(struct xml_element *bsdf, struct xml_attribute *type)
{
	struct xml_element *thin = find_child(bsdf, "thin");
	const char *value = thin && is_named(thin, "boolean") ? xml_attribute_value(thin, "value") : NULL;
	bool is_thin = value && strcasecmp(value, "true") == 0;
	type->value = is_thin ? "principledthin" : prerelease_renames[0].new_name;
	if (is_thin || (value && strcasecmp(value, "false") == 0))
		remove_child(bsdf, thin);
}

void upgrade_prerelease_names(struct xml_element *root)
{
	struct xml_attribute *type =
		is_named(root, "bsdf") && !root->is_camel_case ? find_attribute(root, "type") : NULL;
	if (type && strcasecmp(type->value, prerelease_renames[0].old_name) == 0)
		rename_disney(root, type);
	for (struct xml_element *c = root->first_child; c; c = c->next_sibling)
		upgrade_prerelease_names(c);
}
