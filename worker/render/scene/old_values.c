/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/old_values.h"

#include "worker/render/scene/value.h"

#include <string.h>
#include <strings.h>

/* The reflectance to which Mitsuba scales: if a material reflected all light, its paths would never end. */
static const double max_reflectance = 0.99;

static bool must_conserve_energy(const struct xml_element *owner)
{
	for (const struct xml_element *c = owner->first_child; c; c = c->next_sibling) {
		const char *name = xml_attribute_value(c, "name"), *value = xml_attribute_value(c, "value");
		if (name && value && strcmp(name, "ensureEnergyConservation") == 0 && strcasecmp(value, "false") == 0)
			return false;
	}
	return true;
}

static int scale_value(struct value *v, double factor, struct arena *arena)
{
	if (v->type == VALUE_INT) {
		double x = (double)v->as.integer;
		v->type = VALUE_FLOAT;
		v->as.number = x;
	}
	if (v->type == VALUE_FLOAT)
		v->as.number *= factor;
	for (int i = 0; v->type == VALUE_RGB && i < 3; i++)
		v->as.rgb[i] *= factor;
	if (v->type != VALUE_SPECTRUM)
		return 0;
	double *scaled = arena_alloc(arena, v->as.spectrum.count, sizeof *scaled);
	if (!scaled)
		return -ENOMEM;
	for (uint32_t i = 0; i < v->as.spectrum.count; i++)
		scaled[i] = factor * v->as.spectrum.value[i];
	v->as.spectrum.value = scaled;
	return 0;
}

static double *value_components(struct value *v)
{
	return v->type == VALUE_FLOAT ? &v->as.number : v->type == VALUE_RGB ? v->as.rgb : NULL;
}

/* The reflectance of a metal depends on the squares of eta and k only. */
static int drop_sign(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		     const struct param *p, struct value *v)
{
	double *x = value_components(v), lowest = 0;
	for (int i = 0; x && i < (v->type == VALUE_RGB ? 3 : 1); i++) {
		lowest = fmin(lowest, x[i]);
		x[i] = fabs(x[i]);
	}
	return lowest == 0
		       ? 0
		       : note_add(t, owner, xml_attribute_value(owner, "type"), p->name,
				  "%s:%d: <%.64s type=\"%.64s\">: %s=%g is below 0: its sign is ignored, as in Mitsuba",
				  el->file, el->line, owner->name, xml_attribute_value(owner, "type"),
				  element_written_name(el, p->name), lowest);
}

static int scale_reflectance(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
			     const struct param *p, struct arena *arena, struct value *v)
{
	double scratch[3], largest = 0;
	uint32_t count;
	const double *x = value_numbers(v, scratch, &count);
	for (uint32_t i = 0; i < count; i++)
		largest = fmax(largest, x[i]);
	if (!(largest > 1) || !isfinite(largest) || !must_conserve_energy(owner))
		return 0;
	double factor = max_reflectance / largest;
	if (scale_value(v, factor, arena))
		return error_set(t->error, ENOMEM, "out of memory");
	return note_add(t, owner, xml_attribute_value(owner, "type"), p->name,
			"%s:%d: <%.64s type=\"%.64s\">: %s=%g is above 1: scaled by %.4g, as in Mitsuba", el->file,
			el->line, owner->name, xml_attribute_value(owner, "type"), element_written_name(el, p->name),
			largest, factor);
}

static int replace_distribution(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
				struct value *v)
{
	const char *distribution = v->as.string;
	if (strcmp(distribution, "phong") != 0 && strcmp(distribution, "as") != 0)
		return 0;
	v->as.string = "beckmann";
	return note_add(
		t, owner, xml_attribute_value(owner, "type"), distribution,
		"%s:%d: <%.64s type=\"%.64s\">: the distribution `%s` becomes `beckmann`, which falls off faster: the image "
		"differs a little from Mitsuba's",
		el->file, el->line, owner->name, xml_attribute_value(owner, "type"), distribution);
}

/* Converts a word that its table restricts to a list: Mitsuba 0.6 ignores the case of most of these. */
static int convert_to_lower(struct value *v, struct arena *arena)
{
	char *word = arena_strdup(arena, v->as.string);
	if (!word)
		return -ENOMEM;
	for (char *c = word; *c; c++)
		if (*c >= 'A' && *c <= 'Z')
			*c = (char)(*c - 'A' + 'a');
	v->as.string = word;
	return 0;
}

int old_values_adapt(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		     const struct param *p, enum plugin_class cls, struct arena *arena, struct value *v)
{
	if (v->type == VALUE_STRING && p->choices && convert_to_lower(v, arena))
		return error_set(t->error, ENOMEM, "out of memory");
	if (cls != PLUGIN_BSDF)
		return 0;
	if (v->type == VALUE_STRING)
		return strcmp(p->name, "distribution") == 0 ? replace_distribution(t, owner, el, v) : 0;
	if ((strcmp(p->name, "eta") == 0 || strcmp(p->name, "k") == 0) && p->min == 0)
		return drop_sign(t, owner, el, p, v);
	bool is_reflectance =
		strstr(p->name, "reflectance") || strstr(p->name, "transmittance") || strcmp(p->name, "opacity") == 0;
	return is_reflectance && p->max == 1 ? scale_reflectance(t, owner, el, p, arena, v) : 0;
}
