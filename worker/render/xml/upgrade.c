/* SPDX-License-Identifier: Apache-2.0 */
/*
 * upgrade() walks over the file's elements, outer ones first, so that rules see the enclosing elements under their new
 * names. Rules are rows of tables, like Mitsuba's own; those that need more than a new name are functions.
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

/* A rule. before: the minor version from which it no longer applies (4: files before 0.4). NULL: any element or
 * type. */
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
	{3, "bsdf", NULL, "mirror", "conductor"},
	{3, "bsdf", NULL, "microfacet", "roughplastic"},
};

/* Names of parameters: of children of an element with that name and type. */
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
	{3, "texture", "gridtexture", "brightColor", "color0"},
	{3, "texture", "gridtexture", "darkColor", "color1"},
	{3, "bsdf", "roughconductor", "alphaB", "alpha"},
	{3, "bsdf", "roughconductor", "ior", "eta"},
	{3, "bsdf", "roughplastic", "alphaB", "alpha"},
	{3, "bsdf", "ward", "alphaX", "alphaU"},
	{3, "bsdf", "ward", "alphaY", "alphaV"},
	{3, "bsdf", "roughdielectric", "alphaB", "alpha"},
};

static const struct new_name elements[] = {{4, NULL, NULL, "luminaire", "emitter"},
					   {4, NULL, NULL, "camera", "sensor"}};

/* `thin` selects between this and `principledthin`. */
static const struct new_name unreleased[] = {{0, "bsdf", NULL, "disney", "principled"}};

bool upgrade_name_at(size_t i, struct renamed *out)
{
	static const struct {
		const struct new_name *names;
		size_t count;
		bool parameters;
	} tables[] = {{elements, sizeof elements / sizeof *elements, false},
		      {types, sizeof types / sizeof *types, false},
		      {parameters, sizeof parameters / sizeof *parameters, true},
		      {unreleased, sizeof unreleased / sizeof *unreleased, false}};
	for (size_t t = 0; t < sizeof tables / sizeof *tables; i -= tables[t++].count)
		if (i < tables[t].count) {
			const struct new_name *n = &tables[t].names[i];
			*out = (struct renamed){n->before, n->element, n->type, n->old, n->now, tables[t].parameters};
			return true;
		}
	return false;
}

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

/* Inserts an element with one or two attributes as the first child of another. */
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

/* Removes an element whose meaning another element has taken over. */
static void take_out(struct xml_element *in, const struct xml_element *el)
{
	struct xml_element *before = NULL;
	for (struct xml_element *c = in->first; c && c != el; c = c->next)
		before = c;
	if (before)
		before->next = el->next;
	else
		in->first = el->next;
	if (in->last == el)
		in->last = before;
}

/* Before 0.4, cameras were mirrored horizontally, and their angle of view was that of the smaller side. */
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
			take_out(camera, c);
		}
	}
	return !is_of_type(camera, "perspective") ||
	       put_first(camera, "string", "name", "fovAxis", "value", axis, arena);
}

static struct xml_element *named_child(const struct xml_element *in, const char *name)
{
	for (struct xml_element *c = in->first; c; c = c->next) {
		const char *own = xml_attribute(c, "name");
		if (own && strcmp(own, name) == 0)
			return c;
	}
	return NULL;
}

/* Materials with a diffuse and a specular lobe, and the default colours of these. */
static const struct lobes {
	const char *type, *diffuse, *specular;
} lobes[] = {{"phong", "0.5", "0.2"}, {"ward", "0.5", "0.2"}, {"microfacet", "0", "1"}};

/* Puts a `scale` texture in the place of a colour, which becomes the texture's value. */
static bool wrap(struct xml_element *colour, const char *factor, struct arena *arena)
{
	struct xml_element *inner = arena_alloc(arena, 1, sizeof *inner);
	struct xml_attribute *outside = arena_alloc(arena, 2, sizeof *outside),
			     *inside = arena_alloc(arena, colour->attribute_count, sizeof *inside);
	if (!inner || !outside || !inside)
		return false;
	for (uint32_t i = 0; i < colour->attribute_count; i++) {
		inside[i] = colour->attributes[i];
		if (strcmp(inside[i].name, "name") == 0) {
			outside[0] = inside[i];
			inside[i].value = "value";
		}
	}
	outside[1] = (struct xml_attribute){"type", "scale"};
	*inner = *colour;
	inner->attributes = inside;
	inner->parent = colour;
	inner->next = NULL;
	for (struct xml_element *c = inner->first; c; c = c->next)
		c->parent = inner;
	colour->name = "texture";
	colour->attributes = outside;
	colour->attribute_count = 2;
	colour->first = colour->last = inner;
	return put_first(colour, "float", "name", "scale", "value", factor, arena);
}

/* Applies a factor to a colour; without the factor's element the factor is 1. */
static bool scale_colour(struct xml_element *bsdf, const char *name, const char *factor_name, const char *fallback,
			 struct arena *arena)
{
	struct xml_element *colour = named_child(bsdf, name), *given = named_child(bsdf, factor_name);
	const char *factor = given ? xml_attribute(given, "value") : NULL;
	double x;
	bool scaled = factor && (!number_parse(factor, &x) || x != 1);
	if (given)
		take_out(bsdf, given);
	if (!colour)
		colour = put_first(bsdf, "spectrum", "name", name, "value", fallback, arena);
	return colour && (!scaled || wrap(colour, factor, arena));
}

static bool upgrade_material(struct xml_element *bsdf, struct arena *arena)
{
	if (!xml_attribute(bsdf, "type"))
		return true;
	for (size_t i = 0; i < sizeof lobes / sizeof *lobes; i++)
		if (is_of_type(bsdf, lobes[i].type))
			return scale_colour(bsdf, "specularReflectance", "specularAmount", lobes[i].specular, arena) &&
			       scale_colour(bsdf, "diffuseReflectance", "diffuseAmount", lobes[i].diffuse, arena);
	return !is_of_type(bsdf, "mirror") || put_first(bsdf, "string", "name", "material", "value", "Cr", arena);
}

/* Joins the three attributes that origin, target and up once had, one per number, into one; x is the first letter of
 * their names, such as "o" of ox, oy and oz. */
static bool join(const struct xml_element *el, const char *x, const char *name, struct xml_attribute *out,
		 struct arena *arena)
{
	const char *part[3];
	size_t size = 1;
	for (int i = 0; i < 3; i++) {
		part[i] = xml_attribute(el, (char[]){*x, (char)('x' + i), 0});
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
static bool turn_lookat(struct xml_element *el, struct arena *arena)
{
	struct xml_element *look = arena_alloc(arena, 1, sizeof *look);
	struct xml_attribute *a = arena_alloc(arena, 3, sizeof *a), *mirror = arena_alloc(arena, 1, sizeof *mirror);
	bool up = xml_attribute(el, "ux") != NULL;
	if (!look || !a || !mirror || !join(el, "o", "origin", &a[0], arena) ||
	    !join(el, "t", "target", &a[1], arena) || (up && !join(el, "u", "up", &a[2], arena)))
		return false;
	*look = *el;
	look->attributes = a;
	look->attribute_count = up ? 3 : 2;
	*mirror = (struct xml_attribute){"x", "-1"};
	for (struct xml_element *c = look->first; c; c = c->next)
		c->parent = look;
	el->first = el->last =
		NULL; /* otherwise a walk over the elements would return to the wrong one and never end */
	el->name = "scale";
	el->attributes = mirror;
	el->attribute_count = 1;
	el->next = look;
	if (el->parent->last == el)
		el->parent->last = look;
	return true;
}

/* Applies the rules for files from before 0.3 that need more than a new name. */
static bool upgrade_oldest(struct xml_element *el, struct arena *arena)
{
	if (is_named(el, "bsdf"))
		return upgrade_material(el, arena);
	return !is_named(el, "lookAt") || !xml_attribute(el, "ox") || turn_lookat(el, arena);
}

static int upgrade(struct xml_element *el, int minor, struct arena *arena, struct error *e)
{
	int r = 0;
	if (minor < 3 && !upgrade_oldest(el, arena))
		return xml_error(el, e, ENOMEM, "out of memory");
	bool camera = minor < 4 && is_named(el, "camera");
	for (size_t i = 0; i < sizeof elements / sizeof *elements; i++)
		if (minor < elements[i].before && is_named(el, elements[i].old))
			el->name = elements[i].now;
	if (camera && !turn_camera(el, arena))
		return xml_error(el, e, ENOMEM, "out of memory");
	/* pixelFormat, which has no effect here, has replaced the film's `alpha`. */
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

/* The parameter `thin` selected between what are now two plug-ins. */
static void rename_disney(struct xml_element *bsdf, struct xml_attribute *type)
{
	struct xml_element *thin = named_child(bsdf, "thin");
	const char *value = thin && is_named(thin, "boolean") ? xml_attribute(thin, "value") : NULL;
	bool yes = value && strcasecmp(value, "true") == 0;
	type->value = yes ? "principledthin" : unreleased[0].now;
	if (yes || (value && strcasecmp(value, "false") == 0))
		take_out(bsdf, thin);
}

void upgrade_unreleased(struct xml_element *root)
{
	struct xml_attribute *type = is_named(root, "bsdf") && !root->snake ? attribute_of(root, "type") : NULL;
	if (type && strcasecmp(type->value, unreleased[0].old) == 0)
		rename_disney(root, type);
	for (struct xml_element *c = root->first; c; c = c->next)
		upgrade_unreleased(c);
}
