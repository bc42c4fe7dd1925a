/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Goes through the shapes of a tree. In scenes of 0.6 the diffuse part of a plastic above a dipole has no reflectance,
 * because the dipole replaces it: if only the dipole were left out, the shape would be black. Therefore the dipole's
 * coefficients are converted to the reflectance of a flat, evenly lit medium, and this to the reflectance of the BSDF's
 * base.
 *
 * Combinations that are not understood (varying coefficients, other BSDFs, other models) are left to the maker, which
 * leaves out the <subsurface>.
 */
#include "worker/render/scene/subsurface.h"

#include "worker/render/math/measured_media.h"
#include "worker/render/xml/element_make.h"
#include "worker/render/text/number.h"
#include "worker/render/text/snake_case.h"
#include "worker/render/scene/value.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define BK7_ETA 1.5046 /* over AIR_ETA; a material's name counts as this */
#define AIR_ETA 1.000277

/* Returns the diffuse Fresnel reflectance on the inside, by the polynomial of the section cited in the header; eta >
 * 1. */
static double internal_reflectance(double eta)
{
	return -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
}

double subsurface_reflectance(double albedo, double eta)
{
	double internal = internal_reflectance(eta), a = (1 + internal) / (1 - internal), s = sqrt(3 * (1 - albedo));
	return albedo / 2 * (1 + exp(-4.0 / 3 * a * s)) * exp(-s);
}

double subsurface_base_reflectance(double reflectance, double eta)
{
	double internal = internal_reflectance(eta);
	return reflectance / (1 - internal + reflectance * internal);
}

struct dipole_medium {
	double sigma_s[3], sigma_a[3], sigma_t[3], albedo[3], g[3], interior_ior, exterior_ior;
	unsigned given_mask; /* bit k: the k-th of sigma_s, sigma_a, sigma_t, albedo is given */
};

static bool read_color(struct maker *m, const struct xml_element *el, double out[3])
{
	struct value v;
	struct error unused;
	if (value_read(el, m->asset_source, m->arena, &v, &unused))
		return false;
	bool is_rgb = v.type == VALUE_RGB, is_constant = v.type == VALUE_SPECTRUM && v.as.spectrum.count == 1;
	for (int i = 0; i < 3; i++)
		out[i] = is_rgb ? v.as.rgb[i] : is_constant ? v.as.spectrum.value[0] : v.as.number;
	return is_rgb || is_constant || v.type == VALUE_FLOAT;
}

static bool read_measured(const char *name, struct dipole_medium *out)
{
	char list[2048];
	const struct measured_medium *measured = measured_medium_find(name, list, sizeof list);
	for (int i = 0; i < 3 && measured; i++) {
		out->sigma_s[i] = measured->sigma_s[i];
		out->sigma_a[i] = measured->sigma_a[i];
		out->g[i] = measured->g[i];
	}
	out->given_mask = 3;
	return measured;
}

/* Reads one parameter. Returns false if it is not understood. */
static bool read_parameter(struct maker *m, const struct xml_element *el, struct dipole_medium *out)
{
	const char *written = xml_attribute_value(el, "name"), *value = xml_attribute_value(el, "value");
	char name[64];
	double number;
	if (!written || 2 * strlen(written) + 1 > sizeof name || !value)
		return false;
	snake_case_from_camel(written, name);
	double *const colors[] = {out->sigma_s, out->sigma_a, out->sigma_t, out->albedo};
	static const char *const names[] = {"sigma_s", "sigma_a", "sigma_t", "albedo"};
	for (unsigned i = 0; i < 4; i++)
		if (strcmp(name, names[i]) == 0) {
			out->given_mask |= 1u << i;
			return read_color(m, el, colors[i]);
		}
	if (strcmp(name, "material") == 0)
		return read_measured(value, out);
	if (strcmp(name, "g") == 0)
		return read_color(m, el, out->g);
	if (strcmp(name, "int_ior") == 0 && number_parse(value, &number))
		out->interior_ior = number;
	if (strcmp(name, "ext_ior") == 0 && number_parse(value, &number))
		out->exterior_ior = number;
	return true; /* scale and number of samples do not matter here */
}

/* Writes the colour of the base as text. Returns false if the dipole is not understood. */
static bool compute_base_colour(struct maker *m, const struct xml_element *dipole, char *text, size_t size)
{
	struct dipole_medium md = {.interior_ior = BK7_ETA, .exterior_ior = AIR_ETA};
	double base[3];
	for (const struct xml_element *c = dipole->first_child; c; c = c->next_sibling)
		if (!read_parameter(m, c, &md))
			return false;
	if (!md.given_mask)
		read_measured(MEASURED_MEDIUM_DEFAULT, &md);
	double eta = md.interior_ior / md.exterior_ior;
	if ((md.given_mask != 3 && md.given_mask != 12) || !(eta > 1 && eta < 4))
		return false;
	for (int i = 0; i < 3; i++) {
		double s = md.given_mask == 3 ? md.sigma_s[i] : md.sigma_t[i] * md.albedo[i],
		       a = md.given_mask == 3 ? md.sigma_a[i] : md.sigma_t[i] * (1 - md.albedo[i]);
		s *= 1 - md.g[i];
		if (!(s >= 0 && a >= 0 && s + a > 0 && isfinite(s + a)))
			return false;
		base[i] = subsurface_base_reflectance(subsurface_reflectance(s / (s + a), eta), eta);
	}
	snprintf(text, size, "%.17g %.17g %.17g", base[0], base[1], base[2]);
	return true;
}

static bool is_plastic(const struct xml_element *el)
{
	const char *type = xml_attribute_value(el, "type");
	return strcmp(el->name, "bsdf") == 0 && type &&
	       (strcmp(type, "plastic") == 0 || strcmp(type, "roughplastic") == 0);
}

/* Returns the plastic that `el` is or refers to, or NULL. */
static const struct xml_element *find_plastic(struct maker *m, const struct xml_element *el)
{
	const char *id = strcmp(el->name, "ref") == 0 ? xml_attribute_value(el, "id") : NULL;
	const struct xml_element *target = id ? id_table_lookup(&m->ids, id) : el;
	return target && is_plastic(target) ? target : NULL;
}

/* Turns el into a copy of the plastic with that base; other shapes may refer to the original. */
static int replace_with_base(struct maker *m, struct xml_element *el, const struct xml_element *plastic,
			     const char *base)
{
	const struct xml_element original = *plastic;
	const char *color = arena_strdup(m->arena, base);
	struct xml_attribute *type = arena_alloc(m->arena, 1, sizeof *type);
	if (!color || !type)
		return maker_out_of_memory(m);
	*type = (struct xml_attribute){"type", xml_attribute_value(plastic, "type")};
	el->name = "bsdf";
	el->attributes = type;
	el->attribute_count = 1;
	el->first_child = el->last_child = NULL;
	for (const struct xml_element *c = original.first_child; c; c = c->next_sibling) {
		const char *name = xml_attribute_value(c, "name");
		bool is_diffuse =
			name && (strcmp(name, "diffuseReflectance") == 0 || strcmp(name, "diffuse_reflectance") == 0);
		struct xml_element *copy = is_diffuse ? NULL : arena_alloc(m->arena, 1, sizeof *copy);
		if (!is_diffuse && !copy)
			return maker_out_of_memory(m);
		if (is_diffuse)
			continue;
		*copy = *c;
		copy->next_sibling = NULL;
		element_append(el, copy);
	}
	return element_add_parameter(el, "rgb", "diffuse_reflectance", color, m->arena) ? 0 : maker_out_of_memory(m);
}

static void remove_child(struct xml_element *parent, const struct xml_element *el)
{
	struct xml_element *previous = NULL;
	for (struct xml_element *c = parent->first_child; c != el; c = c->next_sibling)
		previous = c;
	if (previous)
		previous->next_sibling = el->next_sibling;
	else
		parent->first_child = el->next_sibling;
	if (parent->last_child == el)
		parent->last_child = previous;
}

enum { DIPOLE };
static const struct {
	const char *type, *replacement;
} models[] = {
	[DIPOLE] =
		{"dipole",
		 "a diffuse base of the same reflectance below `plastic` and `roughplastic`; otherwise it is left out"},
	{"singlescatter", "nothing: it is left out"},
};

const char *subsurface_model_at(size_t i, const char **replacement)
{
	if (i >= sizeof models / sizeof *models)
		return NULL;
	*replacement = models[i].replacement;
	return models[i].type;
}

static int replace_dipole_in_shape(struct maker *m, struct xml_element *shape)
{
	struct xml_element *dipole = NULL, *holder = NULL;
	const struct xml_element *plastic = NULL;
	char base[128];
	for (struct xml_element *c = shape->first_child; c; c = c->next_sibling) {
		const char *type = xml_attribute_value(c, "type");
		if (strcmp(c->name, "subsurface") == 0 && type && strcmp(type, models[DIPOLE].type) == 0 &&
		    !element_is_unset(c))
			dipole = c;
		else if (!plastic && (plastic = find_plastic(m, c)))
			holder = c;
	}
	if (!dipole || !holder || !compute_base_colour(m, dipole, base, sizeof base))
		return 0;
	int r = replace_with_base(m, holder, plastic, base);
	remove_child(shape, dipole);
	return r ? r
		 : note_add(
			   &m->notes, dipole, "dipole", "",
			   "%s:%d: <subsurface type=\"dipole\"> is not supported; a diffuse base of the same reflectance stands in "
			   "for it (lenient)",
			   dipole->file, dipole->line);
}

static int replace_dipoles_below(struct maker *m, struct xml_element *el)
{
	int r = strcmp(el->name, "shape") == 0 && !el->is_ignored ? replace_dipole_in_shape(m, el) : 0;
	for (struct xml_element *c = el->first_child; c && !r; c = c->next_sibling)
		r = replace_dipoles_below(m, c);
	return r;
}

int subsurface_replace_dipoles(struct maker *m)
{
	return replace_dipoles_below(m, m->tree->root);
}
