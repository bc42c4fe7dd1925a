/* SPDX-License-Identifier: Apache-2.0 */
/*
 * upgrade() walks over the file's elements, inner ones last, so that rules see the enclosing elements under their new
 * names. Rules are rows of tables, like Mitsuba's own; those that need more than a new name are functions.
 *
 * Some materials had other parameters and defaults before 0.3: they are refused by name.
 */
#include "worker/render/scene/upgrade.h"

#include <errno.h>
#include <string.h>
#include <strings.h>

/* Minor version before which it applies: 0.3 is `before` 4. NULL: any. */
struct new_name {
	int before;
	const char *element, *type, *old, *now;
};

static const struct new_name types[] = {
	{5, "bsdf", NULL, "bump", "bumpmap"},
	{4, "film", NULL, "exrfilm", "hdrfilm"},
	{4, "film", NULL, "pngfilm", "ldrfilm"},
	{3, "bsdf", NULL, "lambertian", "diffuse"},
	{3, "bsdf", NULL, "roughmetal", "roughconductor"},
	{3, "bsdf", NULL, "roughglass", "roughdielectric"},
	{3, "bsdf", NULL, "composite", "mixturebsdf"},
	{3, "texture", NULL, "exrtexture", "bitmap"},
	{3, "texture", NULL, "ldrtexture", "bitmap"},
};

/* For elements inside one of that name and type. */
static const struct new_name parameters[] = {
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
	{3, "bsdf", "roughconductor", "alphaB", "alpha"},
	{3, "bsdf", "roughdielectric", "alphaB", "alpha"},
};

static bool is_named(const struct xml_element *el, const char *name)
{
	return strcmp(el->name, name) == 0;
}

static bool is_of_type(const struct xml_element *el, const char *type)
{
	const char *own = xml_attribute(el, "type");
	return !type || (own && strcmp(own, type) == 0);
}

static struct xml_attribute *attribute_of(const struct xml_element *el, const char *name)
{
	for (uint32_t i = 0; i < el->attribute_count; i++)
		if (strcmp(el->attributes[i].name, name) == 0)
			return &el->attributes[i];
	return NULL;
}

static void rename_value(const struct new_name *rules, size_t count, int minor, const struct xml_element *around,
			 struct xml_attribute *a)
{
	for (size_t i = 0; i < count && a; i++)
		if (minor < rules[i].before && is_named(around, rules[i].element) &&
		    is_of_type(around, rules[i].type) && strcmp(a->value, rules[i].old) == 0) {
			a->value = rules[i].now;
			return;
		}
}

/* Adds an element with one or two attributes as the first inside another. */
static struct xml_element *put_first(struct xml_element *in, const char *name, const char *key, const char *value,
				     const char *key_2, const char *value_2, struct arena *arena)
{
	struct xml_element *el = arena_alloc(arena, 1, sizeof *el);
	struct xml_attribute *a = arena_alloc(arena, 2, sizeof *a);
	if (!el || !a)
		return NULL;
	a[0] = (struct xml_attribute){key, value};
	a[1] = (struct xml_attribute){key_2, value_2};
	*el = (struct xml_element){.name = name,
				   .file = in->file,
				   .line = in->line,
				   .snake = in->snake,
				   .attribute_count = key_2 ? 2 : 1,
				   .attributes = a,
				   .parent = in,
				   .next = in->first};
	in->first = el;
	in->last = in->last ? in->last : el;
	return el;
}

/* Cameras before 0.4 were mirrored horizontally, and their angle of view was that of the smaller side. */
static bool turn_camera(struct xml_element *camera, struct arena *arena)
{
	const char *axis = "smaller";
	for (struct xml_element *c = camera->first; c; c = c->next) {
		const char *name = xml_attribute(c, "name"), *value = xml_attribute(c, "value");
		if (!name)
			continue;
		if (is_named(c, "transform") && strcmp(name, "toWorld") == 0 &&
		    !put_first(c, "scale", "x", "-1", NULL, NULL, arena))
			return false;
		if (is_named(c, "boolean") && strcmp(name, "mapSmallerSide") == 0) {
			axis = value && strcasecmp(value, "false") == 0 ? "larger" : axis;
			c->ignored = true;
		}
	}
	return !is_of_type(camera, "perspective") ||
	       put_first(camera, "string", "name", "fovAxis", "value", axis, arena);
}

static int check_material(const struct xml_element *el, struct error *e)
{
	static const char *const others[] = {"microfacet", "phong", "ward", "mirror"};
	for (size_t i = 0; is_named(el, "bsdf") && i < sizeof others / sizeof *others; i++)
		if (is_of_type(el, others[i]) && xml_attribute(el, "type"))
			return xml_error(el, e, ENOTSUP,
					 "is not supported in files before version 0.3; Mitsuba 0.6 can convert them");
	return 0;
}

static int upgrade(struct xml_element *el, int minor, struct arena *arena, struct error *e)
{
	int r = minor < 3 ? check_material(el, e) : 0;
	if (r)
		return r;
	if (minor < 4 && is_named(el, "luminaire"))
		el->name = "emitter";
	if (minor < 4 && is_named(el, "camera")) {
		el->name = "sensor";
		if (!turn_camera(el, arena))
			return xml_error(el, e, ENOMEM, "out of memory");
	}
	/* pixelFormat has replaced it, and has no effect here. */
	const char *name = xml_attribute(el, "name");
	if (minor < 4 && el->parent && is_named(el->parent, "film") && name && strcmp(name, "alpha") == 0)
		el->ignored = true;
	struct xml_attribute *scale = minor < 4 && is_named(el, "blackbody") ? attribute_of(el, "multiplier") : NULL;
	if (scale)
		scale->name = "scale";
	rename_value(types, sizeof types / sizeof *types, minor, el, attribute_of(el, "type"));
	if (el->parent)
		rename_value(parameters, sizeof parameters / sizeof *parameters, minor, el->parent,
			     attribute_of(el, "name"));
	for (struct xml_element *c = el->first; c && !r; c = c->next)
		if (!is_named(c, "scene"))
			r = upgrade(c, minor, arena, e);
	return r;
}

bool upgrade_is_unmarked(const struct xml_element *scene)
{
	for (const struct xml_element *el = scene->first; el; el = el->next)
		if (!el->ignored && (is_named(el, "camera") || is_named(el, "luminaire") || upgrade_is_unmarked(el)))
			return true;
	return false;
}

int upgrade_file(struct xml_element *scene, int minor, struct arena *arena, struct error *e)
{
	return upgrade(scene, minor, arena, e);
}
