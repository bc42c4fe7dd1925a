/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads spectra. Each form of a spectrum has a function that makes a constant or a table of wavelengths and values of
 * it; check_table checks each table for order and range.
 *
 * Failures: lists of different lengths, wavelengths that do not increase, files that do not consist of lines of two
 * numbers, temperatures out of range.
 */
#include "worker/render/scene/spectral.h"

#include "common/base/spelling.h"
#include "worker/render/asset/asset_name.h"
#include "worker/render/math/cie.h"
#include "worker/render/text/number.h"

#include <string.h>

#define TEMPERATURE_MAX 1e6 /* in kelvin; below TEMPERATURE_MIN there is practically no visible light */
#define TEMPERATURE_MIN 100
#define SPECTRAL_VALUE_MAX 1e30

/* Returns the luminance of the CIE's D65 table relative to that of a constant 1. Divided by it, the table gives the
 * white of rgb 1. */
static double d65_normalization(void)
{
	double sum = 0, y = 0;
	for (int i = 0; i < CIE_COUNT; i++) {
		sum += cie_d65[i] * cie_observer[i][1];
		y += cie_observer[i][1];
	}
	return sum / y;
}

static int make_constant(const struct xml_element *el, double x, struct arena *arena, struct value *out,
			 struct error *e)
{
	double *value = arena_alloc(arena, 1, sizeof *value);
	if (!value)
		return xml_error(el, e, ENOMEM, "out of memory");
	*value = x;
	*out = (struct value){.type = VALUE_SPECTRUM};
	out->as.spectrum.count = 1;
	out->as.spectrum.value = value;
	return 0;
}

/* Makes a table with room for n points. Returns false, with the error set, if out of memory. */
static bool make_table(const struct xml_element *el, uint32_t n, struct arena *arena, struct value *out, double **nm,
		       double **value, struct error *e)
{
	*nm = arena_alloc(arena, n, sizeof **nm);
	*value = arena_alloc(arena, n, sizeof **value);
	*out = (struct value){.type = VALUE_SPECTRUM};
	out->as.spectrum.count = n;
	out->as.spectrum.nm = *nm;
	out->as.spectrum.value = *value;
	if (*nm && *value)
		return true;
	xml_error(el, e, ENOMEM, "out of memory");
	return false;
}

/* file: the name of the file that the values are from, followed by ": "; "" if they are in the scene. */
static int check_table(const struct xml_element *el, const char *file, const struct value *v, struct error *e)
{
	const double *nm = v->as.spectrum.nm;
	if (v->as.spectrum.count < 2)
		return xml_error(el, e, EINVAL,
				 "%sone pair nm:value is not a spectrum; give a single number for a constant", file);
	for (uint32_t i = 0; i < v->as.spectrum.count; i++)
		if (!(nm[i] > 0) || (i && !(nm[i] > nm[i - 1])))
			return xml_error(el, e, EINVAL, "%swavelengths must be positive and ascend: %g nm does not",
					 file, nm[i]);
	return 0;
}

/* Reads "400:0.1, 500:0.2", or lines "400 0.1" of a file. Returns the number of points, or 0 if the text is
 * malformed; *stop is then the pair that is none, or the end. */
static uint32_t scan_pairs(const char *p, const char *end, char separator, double *nm, double *value, const char **stop)
{
	uint32_t n = 0;
	while (p < end) {
		while (p < end && (number_is_blank(*p) || *p == ','))
			p++;
		if (p < end && *p == '#' && separator == ' ') {
			while (p < end && *p != '\n')
				p++;
			continue;
		}
		if (p == end)
			break;
		double x, y;
		*stop = p;
		p = number_scan(p, end, &x);
		if (!p || p == end || n == SPECTRAL_POINTS_MAX || (separator == ':' ? *p != ':' : !number_is_blank(*p)))
			return 0;
		p++;
		while (separator == ' ' && p < end && (*p == ' ' || *p == '\t'))
			p++;
		p = number_scan(p, end, &y);
		if (!p || (p < end && !number_is_blank(*p) && *p != ','))
			return 0;
		if (nm) {
			nm[n] = x;
			value[n] = y;
		}
		n++;
	}
	*stop = end;
	return n;
}

/* Refuses a file at the place where it is no list. */
static int refuse_line(const struct xml_element *el, const char *file, const char *text, const char *stop,
		       const char *end, struct error *e)
{
	char shown[257];
	int line = 1;
	for (const char *p = text; p < stop; p++)
		line += *p == '\n';
	asset_name_display(file, shown, sizeof shown);
	if (stop == end)
		return xml_error(el, e, EINVAL, "%s: has no line `nm value`", shown);
	return xml_error(el, e, EINVAL, "%s:%d: not a line `nm value`, of at most %d", shown, line,
			 SPECTRAL_POINTS_MAX);
}

/* file: NULL if the text is in the scene. */
static int read_pairs(const struct xml_element *el, const char *file, const char *text, const char *end,
		      struct arena *arena, struct value *out, struct error *e)
{
	char separator = file ? ' ' : ':', name[260] = "";
	const char *stop;
	uint32_t n = scan_pairs(text, end, separator, NULL, NULL, &stop);
	if (n == 0)
		return file ? refuse_line(el, file, text, stop, end, e)
			    : xml_error(el, e, EINVAL,
					"`%.64s` is neither a number nor a list nm:value, nm:value, ... of at most %d",
					text, SPECTRAL_POINTS_MAX);
	double *nm, *value;
	if (!make_table(el, n, arena, out, &nm, &value, e))
		return -ENOMEM;
	scan_pairs(text, end, separator, nm, value, &stop);
	if (file) {
		asset_name_display(file, name, sizeof name - 2);
		strcat(name, ": ");
	}
	return check_table(el, name, out, e);
}

/* A file is read once, however often the scene names it. */
static int read_file(const struct xml_element *el, const char *name, const struct asset_source *assets,
		     struct arena *arena, struct value *out, struct error *e)
{
	struct asset a;
	struct error inner;
	struct arena_interned *share = arena_intern(arena, name, strlen(name) + 1);
	struct value *cached = share ? share->user : NULL;
	if (cached) {
		*out = *cached;
		return 0;
	}
	int r = assets->open(assets->user, name, &a, &inner);
	if (r)
		return xml_error(el, e, -r, "%s", inner.text);
	const char *text = (const char *)a.bytes;
	r = read_pairs(el, name, a.size ? text : "", a.size ? text + a.size : "", arena, out, e);
	assets->close(assets->user, &a);
	cached = share && !r ? arena_alloc(arena, 1, sizeof *cached) : NULL;
	if (cached) {
		*cached = *out;
		share->user = cached;
	}
	return r;
}

static int read_value(const struct xml_element *el, const char *text, const struct asset_source *assets,
		      struct arena *arena, struct value *out, struct error *e)
{
	double x[3];
	(void)assets;
	if (strchr(text, ':'))
		return read_pairs(el, NULL, text, text + strlen(text), arena, out, e);
	if (number_parse(text, x)) {
		if (!el->is_camel_case)
			return make_constant(el, x[0], arena, out, e);
		/* In 0.6 a single number is rgb, so that as a light it is white; in 3.x it is constant over all
		 * wavelengths. */
		*out = (struct value){.type = VALUE_FLOAT};
		out->as.number = x[0];
		return 0;
	}
	/* 0.6 built with three spectral samples accepts r, g, b here; built with more, it accepts that many numbers. */
	if (el->is_camel_case && number_parse_list(text, x, 3) == 3) {
		*out = (struct value){.type = VALUE_RGB};
		memcpy(out->as.rgb, x, sizeof x);
		return 0;
	}
	return xml_error(el, e, EINVAL,
			 "`%.64s` is neither a number nor a list nm:value, nm:value, ...; three numbers "
			 "are for <rgb>",
			 text);
}

/* Planck's law; h, c and k as defined by the SI. */
static double planck(double nm, double kelvin)
{
	const double h = 6.62607015e-34, c = 299792458, k = 1.380649e-23;
	double m = nm * 1e-9;
	return 2 * h * c * c / pow(m, 5) / expm1(h * c / (m * k * kelvin)) * 1e-9;
}

static int make_blackbody(const struct xml_element *el, double kelvin, double scale, struct arena *arena,
			  struct value *out, struct error *e)
{
	enum { STEP = 5, POINTS = (CIE_LAST_NM - CIE_FIRST_NM) / STEP + 1 };
	if (!(kelvin >= TEMPERATURE_MIN && kelvin <= TEMPERATURE_MAX))
		return xml_error(el, e, ERANGE, "a temperature of %g K is outside [%g, %g]", kelvin,
				 (double)TEMPERATURE_MIN, TEMPERATURE_MAX);
	double *nm, *value;
	if (!make_table(el, POINTS, arena, out, &nm, &value, e))
		return -ENOMEM;
	for (uint32_t i = 0; i < POINTS; i++) {
		nm[i] = CIE_FIRST_NM + STEP * (double)i;
		value[i] = planck(nm[i], kelvin) * scale;
	}
	return 0;
}

static int read_number(const struct xml_element *el, const char *what, const char *text, double min, double *x,
		       struct error *e)
{
	const char *end = text + strlen(text), *rest = number_scan(text, end, x);
	if (rest && rest < end && (*rest == 'K' || *rest == 'k') && strcmp(what, "temperature") == 0)
		rest++;
	if (!rest || rest != end || !(*x >= min && *x <= SPECTRAL_VALUE_MAX))
		return xml_error(el, e, EINVAL, "%s=\"%.64s\" is not a number from %g to %g", what, text, min,
				 SPECTRAL_VALUE_MAX);
	return 0;
}

int spectral_read_blackbody(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e)
{
	const char *temperature = xml_attribute_value(el, "temperature"), *scale = xml_attribute_value(el, "scale");
	double kelvin, factor = 1;
	if (!temperature)
		return xml_error(el, e, EINVAL, "needs a temperature in kelvin");
	int r = read_number(el, "temperature", temperature, 0, &kelvin, e);
	if (!r && scale)
		r = read_number(el, "scale", scale, 0, &factor, e);
	return r ? r : make_blackbody(el, kelvin, factor, arena, out, e);
}

/* Returns the value of the parameter `name` inside a <spectrum type="...">, whatever its element; NULL if there is
 * none. */
static const char *child_value(const struct xml_element *el, const char *name)
{
	for (const struct xml_element *c = el->first_child; c; c = c->next_sibling) {
		const char *child_name = xml_attribute_value(c, "name");
		if (child_name && strcmp(child_name, name) == 0)
			return xml_attribute_value(c, "value");
	}
	return NULL;
}

static int child_number(const struct xml_element *el, const char *name, const char *old_name, double fallback,
			double *x, struct error *e)
{
	const char *text = child_value(el, name);
	if (!text && old_name)
		text = child_value(el, old_name);
	*x = fallback;
	if (!text && isnan(fallback))
		return xml_error(el, e, EINVAL, "needs `%s`", name);
	return text ? read_number(el, name, text, 0, x, e) : 0;
}

/* Reads the numbers of `name`, at least 2. Returns their count, or a negative errno with the error set. */
static int child_list(const struct xml_element *el, const char *name, struct arena *arena, double **out,
		      struct error *e)
{
	const char *text = child_value(el, name);
	size_t capacity = text ? strlen(text) / 2 + 1 : 0;
	if (capacity > SPECTRAL_POINTS_MAX)
		capacity = SPECTRAL_POINTS_MAX;
	*out = arena_alloc(arena, capacity, sizeof **out);
	if (!*out)
		return xml_error(el, e, ENOMEM, "out of memory");
	int n = text ? number_parse_list(text, *out, capacity) : 0;
	return n >= 2 ? n : xml_error(el, e, EINVAL, "needs `%s`, 2 to %d numbers", name, SPECTRAL_POINTS_MAX);
}

static int make_checked_table(const struct xml_element *el, int n, const double *nm, const double *value,
			      struct value *out, struct error *e)
{
	*out = (struct value){.type = VALUE_SPECTRUM};
	out->as.spectrum.count = (uint32_t)n;
	out->as.spectrum.nm = nm;
	out->as.spectrum.value = value;
	return check_table(el, "", out, e);
}

static int read_regular(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e)
{
	double low, high, *value;
	int r = child_number(el, "wavelength_min", "lambda_min", NAN, &low, e);
	if (!r)
		r = child_number(el, "wavelength_max", "lambda_max", NAN, &high, e);
	int n = r ? r : child_list(el, "values", arena, &value, e);
	if (n < 0)
		return n;
	double *nm = arena_alloc(arena, (size_t)n, sizeof *nm);
	if (!nm)
		return xml_error(el, e, ENOMEM, "out of memory");
	for (int i = 0; i < n; i++)
		nm[i] = low + (high - low) * i / (n - 1);
	return make_checked_table(el, n, nm, value, out, e);
}

static int read_irregular(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e)
{
	double *nm, *value;
	int n = child_list(el, "wavelengths", arena, &nm, e),
	    values = n < 0 ? n : child_list(el, "values", arena, &value, e);
	if (values < 0)
		return values;
	return n == values ? make_checked_table(el, n, nm, value, out, e)
			   : xml_error(el, e, EINVAL, "%d wavelengths, but %d values", n, values);
}

/* Reads the colour of <rgb name="NAME" value="..."/>; a single number stands for all three. */
static int child_colour(const struct xml_element *el, const char *name, double scale, struct value *out,
			struct error *e)
{
	const char *text = child_value(el, name);
	double *rgb = out->as.rgb;
	*out = (struct value){.type = VALUE_RGB};
	int n = text ? number_parse_list(text, rgb, 3) : 0;
	if (n != 1 && n != 3)
		return xml_error(el, e, EINVAL, "needs `%s`, three numbers", name);
	for (int k = 0; k < 3; k++)
		rgb[k] = scale * rgb[n == 1 ? 0 : k];
	return 0;
}

/* Reads D65; with a colour, it means the same as an <rgb> of a light. */
static int read_d65(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e)
{
	double scale, *nm, *value;
	int r = child_number(el, "scale", NULL, 1, &scale, e);
	if (r || child_value(el, "color"))
		return r ? r : child_colour(el, "color", scale, out, e);
	if (!make_table(el, CIE_COUNT, arena, out, &nm, &value, e))
		return -ENOMEM;
	double unit = scale / d65_normalization();
	for (uint32_t i = 0; i < CIE_COUNT; i++) {
		nm[i] = CIE_FIRST_NM + (double)i;
		value[i] = cie_d65[i] * unit;
	}
	return 0;
}

static int read_uniform(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e)
{
	double x;
	int r = child_number(el, "value", NULL, 1, &x, e);
	return r ? r : make_constant(el, x, arena, out, e);
}

static int read_blackbody_type(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e)
{
	double kelvin, scale;
	int r = child_number(el, "temperature", NULL, NAN, &kelvin, e);
	if (!r)
		r = child_number(el, "scale", NULL, 1, &scale, e);
	return r ? r : make_blackbody(el, kelvin, scale, arena, out, e);
}

static int read_srgb(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e)
{
	(void)arena;
	return child_colour(el, "color", 1, out, e);
}

/* Reads one number, constant over all wavelengths, or three, which are a colour. */
static int read_rawconstant(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e)
{
	double x[3];
	const char *text = child_value(el, "value");
	return text && number_parse_list(text, x, 3) == 3 ? child_colour(el, "value", 1, out, e)
							  : read_uniform(el, arena, out, e);
}

static const struct {
	const char *type, *names; /* names of the parameters that it may contain */
	int (*read)(const struct xml_element *el, struct arena *arena, struct value *out, struct error *e);
} types[] = {
	{"uniform", "value|wavelength_min|wavelength_max|lambda_min|lambda_max", read_uniform},
	{"regular", "wavelength_min|wavelength_max|lambda_min|lambda_max|values", read_regular},
	{"irregular", "wavelengths|values", read_irregular},
	{"d65", "scale|color", read_d65},
	{"blackbody", "temperature|scale|wavelength_min|wavelength_max|lambda_min|lambda_max", read_blackbody_type},
	{"srgb", "color", read_srgb},
	{"rgb", "color", read_srgb},
	{"rawconstant", "value", read_rawconstant},
};
enum { TYPES = sizeof types / sizeof *types };

bool spectral_is_type(const char *type)
{
	for (int i = 0; i < TYPES; i++)
		if (strcmp(types[i].type, type) == 0)
			return true;
	return false;
}

static bool is_listed(const char *list, const char *wanted)
{
	char name[64];
	while ((list = element_next_name(list, name, sizeof name)))
		if (strcmp(name, wanted) == 0)
			return true;
	return false;
}

const char *spectral_type_at(size_t i, const char **names)
{
	if (i >= TYPES)
		return NULL;
	*names = types[i].names;
	return types[i].type;
}

static int read_typed(const struct xml_element *el, const char *type, const struct asset_source *assets,
		      struct arena *arena, struct value *out, struct error *e)
{
	(void)assets;
	char hint[128], list[256] = "";
	struct spelling s = {.wanted_name = type};
	for (int i = 0; i < TYPES; i++) {
		spelling_offer(&s, types[i].type);
		spelling_append_to_list(list, sizeof list, types[i].type);
		if (strcmp(types[i].type, type) != 0)
			continue;
		for (const struct xml_element *c = el->first_child; c; c = c->next_sibling) {
			const char *name = xml_attribute_value(c, "name");
			if (!name || !xml_attribute_value(c, "value") || !is_listed(types[i].names, name))
				return xml_error(c, e, EINVAL,
						 "has no place in a spectrum of type `%s` (it may hold: %s)", type,
						 types[i].names);
		}
		return types[i].read(el, arena, out, e);
	}
	return xml_error(el, e, EINVAL, "there is no spectrum of this type%s (supported: %s)",
			 spelling_hint(&s, hint, sizeof hint), list);
}

static const struct {
	const char *attribute, *meaning;
	int (*read)(const struct xml_element *el, const char *text, const struct asset_source *assets,
		    struct arena *arena, struct value *out, struct error *e);
} forms[] = {
	{"value", "a number, or a list `nm:value, nm:value, ...`; in 0.6 also three numbers, which are rgb",
	 read_value},
	{"filename", "a file (`.spd`) with a line `nm value` for each point", read_file},
	{"type", "one of the next table", read_typed},
};
enum { FORMS = sizeof forms / sizeof *forms };

const char *spectral_form_at(size_t i, const char **meaning)
{
	if (i >= FORMS)
		return NULL;
	*meaning = forms[i].meaning;
	return forms[i].attribute;
}

int spectral_read(const struct xml_element *el, const struct asset_source *assets, struct arena *arena,
		  struct value *out, struct error *e)
{
	const char *text[FORMS];
	int given_count = 0, form = 0;
	for (int i = 0; i < FORMS; i++)
		if ((text[i] = xml_attribute_value(el, forms[i].attribute)) != NULL) {
			form = i;
			given_count++;
		}
	if (given_count != 1)
		return xml_error(el, e, EINVAL, "needs either value or filename or type");
	if (el->first_child && forms[form].read != read_typed)
		return xml_error(el->first_child, e, EINVAL, "has no place in <spectrum>");
	return forms[form].read(el, text[form], assets, arena, out, e);
}
