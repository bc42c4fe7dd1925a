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
static double inside_reflectance(double eta)
{
	return -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
}

double subsurface_reflectance(double albedo, double eta)
{
	double inside = inside_reflectance(eta), a = (1 + inside) / (1 - inside), s = sqrt(3 * (1 - albedo));
	return albedo / 2 * (1 + exp(-4.0 / 3 * a * s)) * exp(-s);
}

double subsurface_base(double reflectance, double eta)
{
	double inside = inside_reflectance(eta);
	return reflectance / (1 - inside + reflectance * inside);
}

struct medium {
	double sigma_s[3], sigma_a[3], sigma_t[3], albedo[3], g[3], inside, outside;
	unsigned given; /* bit k: the k-th of sigma_s, sigma_a, sigma_t, albedo is given */
};

static bool read_color(struct maker *m, const struct xml_element *el, double out[3])
{
	struct value v;
	struct error unused;
	if (value_read(el, m->assets_from, m->arena, &v, &unused))
		return false;
	bool rgb = v.type == VALUE_RGB, even = v.type == VALUE_SPECTRUM && v.as.spectrum.count == 1;
	for (int i = 0; i < 3; i++)
		out[i] = rgb ? v.as.rgb[i] : even ? v.as.spectrum.value[0] : v.as.number;
	return rgb || even || v.type == VALUE_FLOAT;
}

static bool read_measured(const char *name, struct medium *out)
{
	char list[2048];
	const struct measured_medium *known = measured_find(name, list, sizeof list);
	for (int i = 0; i < 3 && known; i++) {
		out->sigma_s[i] = known->sigma_s[i];
		out->sigma_a[i] = known->sigma_a[i];
		out->g[i] = known->g[i];
	}
	out->given = 3;
	return known;
}

/* Reads one parameter. Returns false if it is not understood. */
static bool read_parameter(struct maker *m, const struct xml_element *el, struct medium *out)
{
	const char *written = xml_attribute(el, "name"), *value = xml_attribute(el, "value");
	char name[64];
	double number;
	if (!written || 2 * strlen(written) + 1 > sizeof name || !value)
		return false;
	snake_case(written, name);
	double *const colors[] = {out->sigma_s, out->sigma_a, out->sigma_t, out->albedo};
	static const char *const names[] = {"sigma_s", "sigma_a", "sigma_t", "albedo"};
	for (unsigned i = 0; i < 4; i++)
		if (strcmp(name, names[i]) == 0) {
			out->given |= 1u << i;
			return read_color(m, el, colors[i]);
		}
	if (strcmp(name, "material") == 0)
		return read_measured(value, out);
	if (strcmp(name, "g") == 0)
		return read_color(m, el, out->g);
	if (strcmp(name, "int_ior") == 0 && number_parse(value, &number))
		out->inside = number;
	if (strcmp(name, "ext_ior") == 0 && number_parse(value, &number))
		out->outside = number;
	return true; /* scale and number of samples do not matter here */
}

/* Writes the colour of the base as text. Returns false if the dipole is not understood. */
static bool base_of(struct maker *m, const struct xml_element *dipole, char *text, size_t size)
{
	struct medium md = {.inside = BK7_ETA, .outside = AIR_ETA};
	double base[3];
	for (const struct xml_element *c = dipole->first; c; c = c->next)
		if (!read_parameter(m, c, &md))
			return false;
	if (!md.given)
		read_measured(MEASURED_DEFAULT, &md);
	double eta = md.inside / md.outside;
	if ((md.given != 3 && md.given != 12) || !(eta > 1 && eta < 4))
		return false;
	for (int i = 0; i < 3; i++) {
		double s = md.given == 3 ? md.sigma_s[i] : md.sigma_t[i] * md.albedo[i],
		       a = md.given == 3 ? md.sigma_a[i] : md.sigma_t[i] * (1 - md.albedo[i]);
		s *= 1 - md.g[i];
		if (!(s >= 0 && a >= 0 && s + a > 0 && isfinite(s + a)))
			return false;
		base[i] = subsurface_base(subsurface_reflectance(s / (s + a), eta), eta);
	}
	snprintf(text, size, "%.17g %.17g %.17g", base[0], base[1], base[2]);
	return true;
}

static bool is_plastic(const struct xml_element *el)
{
	const char *type = xml_attribute(el, "type");
	return strcmp(el->name, "bsdf") == 0 && type &&
	       (strcmp(type, "plastic") == 0 || strcmp(type, "roughplastic") == 0);
}

/* Returns the plastic that `el` is or refers to, or NULL. */
static const struct xml_element *plastic_of(struct maker *m, const struct xml_element *el)
{
	const char *id = strcmp(el->name, "ref") == 0 ? xml_attribute(el, "id") : NULL;
	const struct xml_element *target = id ? id_table_look(&m->ids, id) : el;
	return target && is_plastic(target) ? target : NULL;
}

/* Turns el into a copy of the plastic with that base; other shapes may refer to the original. */
static int put_base(struct maker *m, struct xml_element *el, const struct xml_element *plastic, const char *base)
{
	const struct xml_element old = *plastic;
	const char *color = arena_strdup(m->arena, base);
	struct xml_attribute *type = arena_alloc(m->arena, 1, sizeof *type);
	if (!color || !type)
		return maker_out_of_memory(m);
	*type = (struct xml_attribute){"type", xml_attribute(plastic, "type")};
	el->name = "bsdf";
	el->attributes = type;
	el->attribute_count = 1;
	el->first = el->last = NULL;
	for (const struct xml_element *c = old.first; c; c = c->next) {
		const char *name = xml_attribute(c, "name");
		bool diffuse =
			name && (strcmp(name, "diffuseReflectance") == 0 || strcmp(name, "diffuse_reflectance") == 0);
		struct xml_element *copy = diffuse ? NULL : arena_alloc(m->arena, 1, sizeof *copy);
		if (!diffuse && !copy)
			return maker_out_of_memory(m);
		if (diffuse)
			continue;
		*copy = *c;
		copy->next = NULL;
		element_link(el, copy);
	}
	return element_value(el, "rgb", "diffuse_reflectance", color, m->arena) ? 0 : maker_out_of_memory(m);
}

static void unlink_child(struct xml_element *parent, const struct xml_element *el)
{
	struct xml_element *before = NULL;
	for (struct xml_element *c = parent->first; c != el; c = c->next)
		before = c;
	if (before)
		before->next = el->next;
	else
		parent->first = el->next;
	if (parent->last == el)
		parent->last = before;
}

enum { DIPOLE };
static const struct {
	const char *type, *becomes;
} models[] = {
	[DIPOLE] =
		{"dipole",
		 "a diffuse base of the same reflectance below `plastic` and `roughplastic`; otherwise it is left out"},
	{"singlescatter", "nothing: it is left out"},
};

const char *subsurface_at(size_t i, const char **becomes)
{
	if (i >= sizeof models / sizeof *models)
		return NULL;
	*becomes = models[i].becomes;
	return models[i].type;
}

static int settle_shape(struct maker *m, struct xml_element *shape)
{
	struct xml_element *dipole = NULL, *holder = NULL;
	const struct xml_element *plastic = NULL;
	char base[128];
	for (struct xml_element *c = shape->first; c; c = c->next) {
		const char *type = xml_attribute(c, "type");
		if (strcmp(c->name, "subsurface") == 0 && type && strcmp(type, models[DIPOLE].type) == 0 &&
		    !element_is_unset(c))
			dipole = c;
		else if (!plastic && (plastic = plastic_of(m, c)))
			holder = c;
	}
	if (!dipole || !holder || !base_of(m, dipole, base, sizeof base))
		return 0;
	int r = put_base(m, holder, plastic, base);
	unlink_child(shape, dipole);
	return r ? r
		 : note(&m->notes, dipole, "dipole", "",
			"%s:%d: <subsurface type=\"dipole\"> is not supported; a diffuse base of the same reflectance stands in "
			"for it (lenient)",
			dipole->file, dipole->line);
}

static int settle_element(struct maker *m, struct xml_element *el)
{
	int r = strcmp(el->name, "shape") == 0 && !el->ignored ? settle_shape(m, el) : 0;
	for (struct xml_element *c = el->first; c && !r; c = c->next)
		r = settle_element(m, c);
	return r;
}

int subsurface_settle(struct maker *m)
{
	return settle_element(m, m->tree->root);
}
