/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/old_values.h"

#include "worker/render/scene/value.h"

#include <string.h>
#include <strings.h>

/* The reflectance to which Mitsuba scales: if a material reflected all light, its paths would never end. */
static const double scaled_to = 0.99;

static bool must_conserve_energy(const struct xml_element *owner)
{
	for (const struct xml_element *c = owner->first; c; c = c->next) {
		const char *name = xml_attribute(c, "name"), *value = xml_attribute(c, "value");
		if (name && value && strcmp(name, "ensureEnergyConservation") == 0 && strcasecmp(value, "false") == 0)
			return false;
	}
	return true;
}

static int scale(struct value *v, double factor, struct arena *arena)
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

static double *components(struct value *v)
{
	return v->type == VALUE_FLOAT ? &v->as.number : v->type == VALUE_RGB ? v->as.rgb : NULL;
}

/* The reflectance of a metal depends on the squares of eta and k only. */
static int drop_sign(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		     const struct param *p, struct value *v)
{
	double *x = components(v), least = 0;
	for (int i = 0; x && i < (v->type == VALUE_RGB ? 3 : 1); i++) {
		least = fmin(least, x[i]);
		x[i] = fabs(x[i]);
	}
	return least == 0 ? 0
			  : note(t, owner, xml_attribute(owner, "type"), p->name,
				 "%s:%d: <%.64s type=\"%.64s\">: %s=%g is below 0: its sign is ignored, as in Mitsuba",
				 el->file, el->line, owner->name, xml_attribute(owner, "type"),
				 element_spelling(el, p->name), least);
}

static int scale_reflectance(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
			     const struct param *p, struct arena *arena, struct value *v)
{
	double scratch[3], most = 0;
	uint32_t count;
	const double *x = value_numbers(v, scratch, &count);
	for (uint32_t i = 0; i < count; i++)
		most = fmax(most, x[i]);
	if (!(most > 1) || !isfinite(most) || !must_conserve_energy(owner))
		return 0;
	double factor = scaled_to / most;
	if (scale(v, factor, arena))
		return error_set(t->error, ENOMEM, "out of memory");
	return note(t, owner, xml_attribute(owner, "type"), p->name,
		    "%s:%d: <%.64s type=\"%.64s\">: %s=%g is above 1: scaled by %.4g, as in Mitsuba", el->file,
		    el->line, owner->name, xml_attribute(owner, "type"), element_spelling(el, p->name), most, factor);
}

static int replace_distribution(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
				struct value *v)
{
	const char *given = v->as.string;
	if (strcmp(given, "phong") != 0 && strcmp(given, "as") != 0)
		return 0;
	v->as.string = "beckmann";
	return note(
		t, owner, xml_attribute(owner, "type"), given,
		"%s:%d: <%.64s type=\"%.64s\">: the distribution `%s` becomes `beckmann`, which falls off faster: the image "
		"differs a little from Mitsuba's",
		el->file, el->line, owner->name, xml_attribute(owner, "type"), given);
}

/* Converts a word that its table restricts to a list: Mitsuba 0.6 ignores the case of most of these. */
static int to_lower(struct value *v, struct arena *arena)
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

int old_value(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
	      const struct param *p, enum plugin_class cls, struct arena *arena, struct value *v)
{
	if (v->type == VALUE_STRING && p->choices && to_lower(v, arena))
		return error_set(t->error, ENOMEM, "out of memory");
	if (cls != PLUGIN_BSDF)
		return 0;
	if (v->type == VALUE_STRING)
		return strcmp(p->name, "distribution") == 0 ? replace_distribution(t, owner, el, v) : 0;
	if ((strcmp(p->name, "eta") == 0 || strcmp(p->name, "k") == 0) && p->min == 0)
		return drop_sign(t, owner, el, p, v);
	bool reflects =
		strstr(p->name, "reflectance") || strstr(p->name, "transmittance") || strcmp(p->name, "opacity") == 0;
	return reflects && p->max == 1 ? scale_reflectance(t, owner, el, p, arena, v) : 0;
}
