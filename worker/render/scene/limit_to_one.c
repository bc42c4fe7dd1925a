/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/limit_to_one.h"

#include "common/base/arena.h"
#include "worker/render/scene/value.h"

#include <errno.h>
#include <math.h>
#include <string.h>

static bool is_fraction(enum plugin_class cls, const struct param *p)
{
	bool allows_colour = p->types & VALUE_RGB;
	return (p->types & VALUE_FLOAT) && (cls == PLUGIN_BSDF || allows_colour) && p->min == 0 && p->max == 1;
}

/* Returns the largest number of a value if all are finite and none is below 0; otherwise 0. */
static double largest_value(const struct value *v)
{
	double scratch[3], largest = 0;
	uint32_t count;
	const double *x = value_numbers(v, scratch, &count);
	for (uint32_t i = 0; i < count; i++) {
		if (!(x[i] >= 0 && isfinite(x[i])))
			return 0;
		largest = fmax(largest, x[i]);
	}
	return largest;
}

bool limit_to_one_applies(enum plugin_class cls, const struct param *p, const struct value *v)
{
	return is_fraction(cls, p) && largest_value(v) > 1;
}

static int limit_to_one(struct value *v, struct arena *arena)
{
	if (v->type == VALUE_INT)
		v->as.integer = 1;
	if (v->type == VALUE_FLOAT)
		v->as.number = 1;
	for (int i = 0; v->type == VALUE_RGB && i < 3; i++)
		v->as.rgb[i] = fmin(v->as.rgb[i], 1);
	if (v->type != VALUE_SPECTRUM)
		return 0;
	double *limited = arena_alloc(arena, v->as.spectrum.count, sizeof *limited);
	if (!limited)
		return -ENOMEM;
	for (uint32_t i = 0; i < v->as.spectrum.count; i++)
		limited[i] = fmin(v->as.spectrum.value[i], 1);
	v->as.spectrum.value = limited;
	return 0;
}

static int out_of_memory(const struct notes *t)
{
	return error_set(t->error, ENOMEM, "out of memory");
}

int limit_value_to_one(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		       enum plugin_class cls, const struct param *p, struct arena *arena, struct value *v)
{
	double largest = largest_value(v);
	if (!limit_to_one_applies(cls, p, v))
		return 0;
	if (limit_to_one(v, arena))
		return out_of_memory(t);
	const char *type = xml_attribute_value(owner, "type");
	return note_add(t, owner, type, p->name,
			"%s:%d: <%.64s type=\"%.64s\">: %s=%g is above 1 and counts as 1 (lenient)", el->file, el->line,
			owner->name, type, element_written_name(el, p->name), largest);
}

/* Textures made of colours, or of other textures. What a `scale` texture makes of its colours is limited where it is
 * used. */
static bool is_pattern(const char *type)
{
	return strcmp(type, "checkerboard") == 0 || strcmp(type, "gridtexture") == 0;
}

/* Refuses a colour of a texture, but only once, however many materials use the texture. */
static int refuse_colour(const struct notes *t, const struct scene_node *texture, const struct property *p,
			 double largest)
{
	error_set(t->error, ERANGE, "%s:%d: <texture type=\"%.64s\">: %s=%g is above 1, which no reflectance can be%s",
		  texture->file, p->line, texture->type, p->name, largest, OVER_ONE_HINT);
	for (uint32_t i = 0; i < t->report->problem_count; i++)
		if (strcmp(t->report->problems[i], t->error->text) == 0)
			return REPORT_ALREADY_REPORTED;
	return -ERANGE;
}

/* Limits v, a colour of a texture, to 1. */
static int limit_colour(const struct notes *t, bool lenient, struct arena *arena, const struct xml_element *el,
			const struct scene_node *texture, const struct property *p, struct value *v)
{
	double largest = largest_value(v);
	if (!lenient)
		return refuse_colour(t, texture, p, largest);
	if (limit_to_one(v, arena))
		return out_of_memory(t);
	return note_add(t, el, texture->type, p->name,
			"%s:%d: <texture type=\"%.64s\">: %s=%g is above 1 and counts as 1 (lenient)", texture->file,
			p->line, texture->type, p->name, largest);
}

static int limit_pattern(const struct notes *t, bool lenient, struct arena *arena, const struct xml_element *el,
			 const struct scene_node **texture)
{
	static const char *const names[] = {"color0", "color1"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		const struct property *p = node_find_property(*texture, names[i]);
		if (!p)
			continue;
		struct value v = p->value;
		int r = 0;
		if (v.type == VALUE_NODE && is_pattern(v.as.node->type))
			r = limit_pattern(t, lenient, arena, el, &v.as.node);
		else if (largest_value(&v) > 1)
			r = limit_colour(t, lenient, arena, el, *texture, p, &v);
		else
			continue;
		if (r)
			return r;
		if (v.type == VALUE_NODE && v.as.node == p->value.as.node)
			continue;
		*texture = node_copy_with_property(*texture, names[i], v, arena);
		if (!*texture)
			return out_of_memory(t);
	}
	return 0;
}

int limit_texture_to_one(const struct notes *t, enum plugin_class cls, const struct param *p, bool lenient,
			 struct arena *arena, struct xml_element *el, const struct scene_node **texture)
{
	if (!is_fraction(cls, p) || !is_pattern((*texture)->type))
		return 0;
	if (!el->limited_node) {
		int r = limit_pattern(t, lenient, arena, el, texture);
		el->limited_node = r ? NULL : *texture;
		return r;
	}
	*texture = el->limited_node;
	return 0;
}
