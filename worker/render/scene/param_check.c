/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/param_check.h"

#include "common/base/spelling.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/text/snake_case.h"
#include "worker/render/scene/value.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

static void convert_to_float(struct value *v)
{
	double x = (double)v->as.integer;
	v->type = VALUE_FLOAT;
	v->as.number = x;
}

static int refuse_choice(const struct xml_element *el, const struct param *p, const char *word, struct error *e)
{
	char choice[64], names[16][64], hint[128], list[512] = "";
	struct spelling s = {.wanted_name = word};
	size_t n = 0;
	for (const char *rest = p->choices; n < 16 && (rest = element_next_name(rest, choice, sizeof choice)); n++) {
		memcpy(names[n], choice, sizeof choice);
		spelling_offer(&s, names[n]);
	}
	for (const char *rest = p->choices; (rest = element_next_name(rest, choice, sizeof choice));)
		spelling_append_to_list(list, sizeof list, choice);
	return xml_error(el, e, EINVAL, "%s=\"%.64s\" is not supported%s (supported: %s)",
			 element_written_name(el, p->name), word, spelling_hint(&s, hint, sizeof hint), list);
}

static int check_range(const struct xml_element *el, const struct param *p, const struct value *v, struct error *e)
{
	double scratch[3];
	uint32_t count;
	const double *x = value_numbers(v, scratch, &count);
	for (uint32_t i = 0; i < count; i++)
		if (p->min > 0 && p->min <= DBL_MIN && !(x[i] > 0))
			return xml_error(el, e, ERANGE, "%s=%g must be positive", p->name, x[i]);
	for (uint32_t i = 0; i < count; i++)
		if (!(x[i] >= p->min && x[i] <= p->max))
			return xml_error(el, e, ERANGE, "%s=%.9g is outside [%.10g, %.10g]",
					 element_written_name(el, p->name), x[i], p->min, p->max);
	return 0;
}

/* Accepts a colour with three equal components as a number: exporters write roughness as a colour. */
static void convert_color_to_number(const struct param *p, struct value *v)
{
	if (!(p->types & VALUE_FLOAT) || (p->types & v->type))
		return;
	double x;
	if (v->type == VALUE_RGB && v->as.rgb[0] == v->as.rgb[1] && v->as.rgb[1] == v->as.rgb[2])
		x = v->as.rgb[0];
	else if (v->type == VALUE_SPECTRUM && v->as.spectrum.count == 1)
		x = v->as.spectrum.value[0];
	else
		return;
	v->type = VALUE_FLOAT;
	v->as.number = x;
}

int param_check(const struct xml_element *el, const struct param *p, struct value *v, struct error *e)
{
	int r;
	if (v->type == VALUE_INT && !(p->types & VALUE_INT) && (p->types & VALUE_FLOAT))
		convert_to_float(v);
	convert_color_to_number(p, v);
	if (!(v->type & p->types)) {
		char list[256];
		value_list_type_names(p->types, list, sizeof list);
		return xml_error(el, e, EINVAL, "`%s` cannot have this type (supported: %s)",
				 element_written_name(el, p->name), list);
	}
	if (p->min < p->max && (r = check_range(el, p, v, e)))
		return r;
	if (v->type == VALUE_STRING && p->choices) {
		char choice[64];
		for (const char *rest = p->choices; (rest = element_next_name(rest, choice, sizeof choice));)
			if (strcmp(choice, v->as.string) == 0)
				return 0;
		return refuse_choice(el, p, v->as.string, e);
	}
	return 0;
}

/* ---- out of range, but not refused */

int clip_value(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
	       const struct param *p, struct value *v)
{
	if (v->type == VALUE_INT)
		convert_to_float(v);
	double *x = v->type == VALUE_FLOAT ? &v->as.number : v->as.rgb, unclipped = 0, limit = 0;
	int count = v->type == VALUE_FLOAT ? 1 : v->type == VALUE_RGB ? 3 : 0;
	for (int i = 0; i < count; i++) {
		double clipped = fmin(fmax(x[i], p->min), p->max);
		if (clipped != x[i]) {
			unclipped = x[i];
			limit = clipped;
		}
		x[i] = clipped;
	}
	if (unclipped == limit)
		return 0;
	const char *type = xml_attribute_value(owner, "type");
	return note_add(t, owner, type, p->name,
			"%s:%d: <%.64s type=\"%.64s\">: %s=%.9g is outside [%.10g, %.10g] and counts as %.10g",
			el->file, el->line, owner->name, type, element_written_name(el, p->name), unclipped, p->min,
			p->max, limit);
}

/* ---- given a second time */

int refuse_second_value(const struct xml_element *el, const struct property *previous, struct error *e)
{
	return xml_error(el, e, EINVAL, "`%s` is given twice (first in line %d)", previous->name, previous->line);
}

/* Returns the name under which an earlier element of the object gives the property. */
static const char *earlier_name(const struct plugin_decl *decl, const struct xml_element *el, const char *property)
{
	char name[256];
	for (const struct xml_element *c = el->parent->first_child; c && c != el; c = c->next_sibling) {
		const char *written = xml_attribute_value(c, "name");
		if (!written || 2 * strlen(written) + 1 > sizeof name)
			continue;
		snake_case_from_camel(written, name);
		if (strcmp(plugin_current_param_name(decl, name), property) == 0)
			return written;
	}
	return property;
}

/* The last value counts, except that a texture replaces a value in whichever order they come, and that names of 3.x
 * have no effect. */
int resolve_second_value(const struct notes *t, const struct plugin_decl *decl, const struct xml_element *el,
			 struct property *previous, struct value v)
{
	bool had_node = previous->value.type == VALUE_NODE, is_node = v.type == VALUE_NODE;
	if (had_node != is_node) {
		previous->value = is_node ? v : previous->value;
		return 0;
	}
	const char *first = earlier_name(decl, el, previous->name), *second = element_written_name(el, previous->name);
	bool first_is_new = strchr(first, '_'), second_is_new = strchr(second, '_');
	if (first_is_new == second_is_new && strcmp(first, second) != 0)
		return refuse_second_value(el, previous, t->error);
	bool last_counts = !second_is_new || first_is_new;
	char key[64];
	snprintf(key, sizeof key, "twice %.48s", second);
	int r = note_add(t, el, decl->type, key,
			 "%s:%d: <%.64s>: `%.64s` is given twice (first in line %d); the %s counts, as in Mitsuba 0.6",
			 el->file, el->line, el->name, second, previous->line, last_counts ? "last" : "first");
	if (last_counts)
		*previous = (struct property){previous->name, el->line, v};
	return r;
}
