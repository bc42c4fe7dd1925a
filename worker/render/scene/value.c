/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A table has each element's name, its attributes and its reader. An attribute that is not in it is refused with the
 * most similar name, so a misspelling never silently becomes a default; so is a value that does not parse. Each error
 * has file and line.
 */
#include "worker/render/scene/value.h"

#include "common/base/spelling.h"
#include "worker/render/text/number.h"
#include "worker/render/scene/spectral.h"
#include "worker/render/scene/transform.h"
#include "worker/render/image/srgb.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

static int require_value(const struct xml_element *el, const char **text, struct error *e)
{
	*text = xml_attribute_value(el, "value");
	return *text ? 0 : element_refuse_missing_attribute(el, "value", e);
}

static int read_bool(const struct xml_element *el, struct value *out, struct error *e)
{
	const char *text;
	int r = require_value(el, &text, e);
	if (r)
		return r;
	out->as.boolean = strcasecmp(text, "true") == 0; /* Python writes True */
	if (!out->as.boolean && strcasecmp(text, "false") != 0) {
		struct spelling s = {.wanted_name = text};
		char hint[32];
		spelling_offer(&s, "true");
		spelling_offer(&s, "false");
		return xml_error(el, e, EINVAL, "`%.64s` is neither true nor false%s", text,
				 spelling_hint(&s, hint, sizeof hint));
	}
	return 0;
}

static int read_int(const struct xml_element *el, struct value *out, struct error *e)
{
	const char *text;
	int r = require_value(el, &text, e);
	if (!r && !number_parse_int(text, &out->as.integer) && number_parse(text, &(double){0}) &&
	    !strpbrk(text, ".eE"))
		return xml_error(el, e, ERANGE, "`%.64s` is too large", text);
	if (!r && !number_parse_int(text, &out->as.integer))
		return xml_error(el, e, EINVAL, "`%.64s` is not a whole number", text);
	return r;
}

static int read_float(const struct xml_element *el, struct value *out, struct error *e)
{
	const char *text;
	int r = require_value(el, &text, e);
	if (!r && !number_parse(text, &out->as.number))
		return xml_error(el, e, EINVAL, "`%.64s` is not a (finite) number", text);
	return r;
}

static bool parse_hex(const char *text, double rgb[3])
{
	if (strlen(text) != 7 || text[0] != '#' || strspn(text + 1, "0123456789abcdefABCDEF") != 6)
		return false;
	unsigned long bits = strtoul(text + 1, NULL, 16);
	for (int i = 0; i < 3; i++)
		rgb[i] = (double)(bits >> (16 - 8 * i) & 0xff) / 255.0;
	return true;
}

static int read_rgb(const struct xml_element *el, struct value *out, struct error *e)
{
	const char *text;
	int r = require_value(el, &text, e);
	if (r)
		return r;
	double *rgb = out->as.rgb;
	bool is_srgb = strcmp(el->name, "srgb") == 0;
	/* 0.6 reads #rrggbb also in <rgb>, as linear; 3.x does not. */
	if (!(text[0] == '#' && (is_srgb || el->is_camel_case) && parse_hex(text, rgb))) {
		int n = number_parse_list(text, rgb, 3);
		if (n == 1)
			rgb[1] = rgb[2] = rgb[0];
		else if (n != 3)
			return xml_error(el, e, EINVAL, "`%.64s` is neither three numbers nor one%s", text,
					 is_srgb	  ? " nor #rrggbb"
					 : text[0] == '#' ? "; #rrggbb is for <srgb>"
							  : "");
	}
	for (int i = 0; i < 3 && is_srgb; i++)
		rgb[i] = srgb_to_linear(rgb[i]);
	return 0;
}

/* In Mitsuba 0.6 a value may state whether it is a light's colour or a surface's; a statement that contradicts its
 * place is refused. */
static int check_intent(const struct xml_element *el, struct error *e)
{
	const char *intent = xml_attribute_value(el, "intent");
	bool in_emitter = el->parent && strcmp(el->parent->name, "emitter") == 0;
	if (intent && strcmp(intent, in_emitter ? "illuminant" : "reflectance") != 0)
		return xml_error(el, e, EINVAL, "intent=\"%.64s\" is not supported; here it is \"%s\"", intent,
				 in_emitter ? "illuminant" : "reflectance");
	return 0;
}

static const struct value_kind {
	const char *element;
	enum value_type type;
	const char *attributes;
	bool allows_children;
} kinds[] = {
	{"boolean", VALUE_BOOL, "name|value", false},
	{"integer", VALUE_INT, "name|value", false},
	{"float", VALUE_FLOAT, "name|value", false},
	{"string", VALUE_STRING, "name|value", false},
	{"point", VALUE_POINT, "name|value|x|y|z", false},
	{"vector", VALUE_POINT, "name|value|x|y|z", false},
	{"rgb", VALUE_RGB, "name|value|intent", false},
	{"srgb", VALUE_RGB, "name|value", false},
	{"spectrum", VALUE_SPECTRUM, "name|value|intent|filename|type|id", true},
	{"transform", VALUE_TRANSFORM, "name|time", true},
	{"blackbody", VALUE_SPECTRUM, "name|temperature|scale", false},
	{"animation", 0, NULL, false},
	{"color", 0, NULL, false},
};
enum { KINDS = sizeof kinds / sizeof *kinds };

static const struct value_kind *find_kind(const char *name)
{
	for (int i = 0; i < KINDS; i++)
		if (strcmp(kinds[i].element, name) == 0)
			return &kinds[i];
	return NULL;
}

bool value_is_element(const char *name)
{
	return find_kind(name) != NULL;
}

void value_offer_elements(struct spelling *s)
{
	for (int i = 0; i < KINDS; i++)
		if (kinds[i].type)
			spelling_offer(s, kinds[i].element);
}

const char *value_element_at(size_t i, const char **attributes)
{
	for (size_t k = 0; k < KINDS; k++)
		if (kinds[k].type && i-- == 0) {
			*attributes = kinds[k].attributes;
			return kinds[k].element;
		}
	return NULL;
}

int value_read(const struct xml_element *el, const struct asset_source *assets, struct arena *arena, struct value *out,
	       struct error *e)
{
	const struct value_kind *k = find_kind(el->name);
	if (!k || !k->type)
		return xml_error(el, e, EINVAL,
				 "is not supported; supported: boolean, integer, float, string, point, vector, "
				 "rgb, srgb, spectrum, blackbody, transform");
	int r = element_check_contents(el, k->attributes, k->allows_children, e);
	if (!r)
		r = check_intent(el, e);
	if (r)
		return r;
	*out = (struct value){.type = k->type};
	switch (k->type) {
	case VALUE_BOOL:
		return read_bool(el, out, e);
	case VALUE_INT:
		return read_int(el, out, e);
	case VALUE_FLOAT:
		return read_float(el, out, e);
	case VALUE_STRING:
		return require_value(el, &out->as.string, e);
	case VALUE_POINT:
		return transform_read_vec3(el, 0, false, &out->as.point, e);
	case VALUE_RGB:
		return read_rgb(el, out, e);
	case VALUE_SPECTRUM:
		return strcmp(el->name, "blackbody") == 0 ? spectral_read_blackbody(el, arena, out, e)
							  : spectral_read(el, assets, arena, out, e);
	default:
		return transform_read(el, &out->as.transform, e);
	}
}

void value_list_type_names(unsigned types, char *text, size_t size)
{
	static const struct {
		unsigned type;
		const char *name;
	} names[] = {{VALUE_BOOL, "boolean"},	   {VALUE_INT, "integer"},	   {VALUE_FLOAT, "float"},
		     {VALUE_STRING, "string"},	   {VALUE_POINT, "point"},	   {VALUE_RGB, "rgb"},
		     {VALUE_SPECTRUM, "spectrum"}, {VALUE_TRANSFORM, "transform"}, {VALUE_NODE, "an object"}};
	text[0] = 0;
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (types & names[i].type)
			spelling_append_to_list(text, size, names[i].name);
}

const double *value_numbers(const struct value *v, double scratch[3], uint32_t *count)
{
	const vec3 *p = &v->as.point;
	*count = 1;
	switch (v->type) {
	case VALUE_INT:
		scratch[0] = (double)v->as.integer;
		return scratch;
	case VALUE_FLOAT:
		return &v->as.number;
	case VALUE_POINT:
		*count = 3;
		memcpy(scratch, (double[3]){p->x, p->y, p->z}, 3 * sizeof *scratch);
		return scratch;
	case VALUE_RGB:
		*count = 3;
		return v->as.rgb;
	case VALUE_SPECTRUM:
		*count = v->as.spectrum.count;
		return v->as.spectrum.value;
	default:
		*count = 0;
		return NULL;
	}
}
