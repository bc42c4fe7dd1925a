/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/ior.h"

#include "common/base/spelling.h"
#include "common/base/text.h"
#include "worker/render/math/spectrum.h"
#include "worker/render/text/number.h"

#include <string.h>
#include <strings.h>

/* Mitsuba's values. Mitsuba does not have sf11 and sapphire: their indices follow from the laws below at 587.6 nm. */
static const struct {
	const char *name;
	double n;
} named_indices[] = {
	{"vacuum", 1.0},	   {"helium", 1.000036},	{"hydrogen", 1.000132},
	{"air", 1.000277},	   {"carbon dioxide", 1.00045}, {"water", 1.3330},
	{"acetone", 1.36},	   {"ethanol", 1.361},		{"carbon tetrachloride", 1.461},
	{"glycerol", 1.4729},	   {"benzene", 1.501},		{"silicone oil", 1.52045},
	{"bromine", 1.661},	   {"water ice", 1.31},		{"fused quartz", 1.458},
	{"pyrex", 1.470},	   {"acrylic glass", 1.49},	{"polypropylene", 1.49},
	{"bk7", 1.5046},	   {"sodium chloride", 1.544},	{"amber", 1.55},
	{"pet", 1.5750},	   {"diamond", 2.419},		{"sf11", 1.78471},
	{"sapphire (o)", 1.76817},
};

/* Coefficients of Sellmeier's law. Sources: Schott (N-BK7, N-SF11), Malitson 1965 (fused quartz), Peter 1923 (diamond),
 * Daimon and Masumura 2007 at 20 C (water), Malitson and Dodge 1972 (sapphire, ordinary ray). */
static const struct {
	const char *name;
	int term_count;
	double b[IOR_TERMS], c[IOR_TERMS];
} sellmeier_laws[] = {
	{"bk7", 3, {1.03961212, 0.231792344, 1.01046945}, {0.00600069867, 0.0200179144, 103.560653}},
	{"sf11", 3, {1.73759695, 0.313747346, 1.89878101}, {0.013188707, 0.0623068142, 155.23629}},
	{"fused quartz", 3, {0.6961663, 0.4079426, 0.8974794}, {0.004679148258, 0.01351206307, 97.93400254}},
	{"diamond", 2, {0.3306, 4.3356}, {0.030625, 0.011236}},
	{"water",
	 4,
	 {0.5684027565, 0.1726177391, 0.02086189578, 0.1130748688},
	 {0.005101829712, 0.01821153936, 0.02620722293, 10.69792721}},
	{"sapphire (o)", 3, {1.4313493, 0.65054713, 5.3414021}, {0.005279926102, 0.01423826471, 325.0178341}},
};

/* Indices below this one are those of gases, which refract so little that a constant suffices even with dispersion. */
#define GAS_IOR_MAX 1.001

static int refuse_name(const struct scene_node *n, const char *property, const char *material, struct error *e)
{
	char hint[128], list[512] = "";
	struct spelling s = {.wanted_name = material};
	for (size_t i = 0; i < sizeof named_indices / sizeof *named_indices; i++) {
		spelling_offer(&s, named_indices[i].name);
		spelling_append_to_list(list, sizeof list, named_indices[i].name);
	}
	if (!s.best_match && strcasestr(material, "glas")) /* the usual crown glass */
		s.best_match = "bk7";
	return node_error(n, e, ENOTSUP, "%s: unknown material \"%.64s\"%s; a number is accepted, too (known: %s)",
			  property, material, spelling_hint(&s, hint, sizeof hint), list);
}

int ior_read(const struct scene_node *n, const char *name, double fallback, double *out, struct error *e)
{
	const struct property *p = node_find_property(n, name);
	if (p && p->value.type == VALUE_STRING) {
		for (size_t i = 0; i < sizeof named_indices / sizeof *named_indices; i++)
			if (strcasecmp(named_indices[i].name, p->value.as.string) == 0) {
				*out = named_indices[i].n;
				return 0;
			}
		return refuse_name(n, name, p->value.as.string, e);
	}
	*out = node_float(n, name, fallback);
	return 0;
}

static double ior_eval(const struct ior *i, double nm)
{
	if (i->term_count == 0) {
		double k = 1e6 / (nm * nm), d = 1e6 / (IOR_REFERENCE_NM * IOR_REFERENCE_NM);
		return i->n + i->cauchy * (k - d);
	}
	double l2 = nm * nm * 1e-6, n2 = 1;
	for (int t = 0; t < i->term_count; t++)
		n2 += i->b[t] * l2 / (l2 - i->c[t]);
	return sqrt(fmax(n2, 0));
}

double ior_eta(const struct ior side[2], double nm)
{
	return ior_eval(&side[IOR_INT], nm) / ior_eval(&side[IOR_EXT], nm);
}

const char *ior_dispersive_names(char *text, size_t size)
{
	struct text t = {text, size};
	for (size_t i = 0; i < sizeof sellmeier_laws / sizeof *sellmeier_laws; i++)
		text_appendf(&t, "%s%s", i ? ", " : "", sellmeier_laws[i].name);
	return text;
}

struct ior_params {
	const char *ior, *cauchy, *sellmeier;
};
static const struct ior_params side_params[] = {
	[IOR_INT] = {"int_ior", "int_cauchy_b", "int_sellmeier"},
	[IOR_EXT] = {"ext_ior", "ext_cauchy_b", "ext_sellmeier"},
};

/* Parses "B1,..,Bm,C1,..,Cm". If no number is negative and no C lies between the squares of the shortest and the
 * longest wavelength, n decreases with the wavelength; the caller then only has to check both ends. */
static int parse_sellmeier(struct ior *out, const struct scene_node *n, const char *name, const char *text,
			   struct error *e)
{
	double list[2 * IOR_TERMS], shortest = WAVELENGTH_MIN * WAVELENGTH_MIN * 1e-6,
				    longest = WAVELENGTH_MAX * WAVELENGTH_MAX * 1e-6;
	int count = number_parse_list(text, list, 2 * IOR_TERMS);
	if (count < 2 || count % 2)
		return node_error(n, e, EINVAL,
				  "%s takes 1 to %d numbers B and as many C (micrometres squared) after them", name,
				  IOR_TERMS);
	out->term_count = count / 2;
	for (int t = 0; t < out->term_count; t++) {
		out->b[t] = list[t];
		out->c[t] = list[out->term_count + t];
		if (!(out->b[t] >= 0 && out->c[t] >= 0))
			return node_error(n, e, EINVAL, "%s: no coefficient may be negative", name);
		if (out->c[t] >= shortest && out->c[t] <= longest)
			return node_error(n, e, EINVAL,
					  "%s: C = %g is a resonance at %g nm, among the wavelengths of light", name,
					  out->c[t], 1000 * sqrt(out->c[t]));
	}
	return 0;
}

static int look_up_law(struct ior *out, const struct scene_node *n, const char *property, const char *material,
		       struct error *e)
{
	for (size_t i = 0; i < sizeof sellmeier_laws / sizeof *sellmeier_laws; i++) {
		if (strcasecmp(sellmeier_laws[i].name, material) != 0)
			continue;
		out->term_count = sellmeier_laws[i].term_count;
		for (int t = 0; t < out->term_count; t++) {
			out->b[t] = sellmeier_laws[i].b[t];
			out->c[t] = sellmeier_laws[i].c[t];
		}
		return 0;
	}
	char list[128];
	if (out->n < GAS_IOR_MAX)
		return 0;
	return node_error(n, e, ENOTSUP,
			  "%s: the dispersion of \"%s\" is not known, only that of %s; coefficients are accepted, too",
			  property, material, ior_dispersive_names(list, sizeof list));
}

bool ior_has_coefficients(const struct scene_node *n)
{
	static const char *const names[] = {"int_cauchy_b", "ext_cauchy_b", "int_sellmeier", "ext_sellmeier"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (node_find_property(n, names[i]))
			return true;
	return false;
}

int ior_read_law(const struct scene_node *n, enum ior_side side, struct ior *out, struct error *e)
{
	const struct ior_params *name = &side_params[side];
	const struct property *ior = node_find_property(n, name->ior), *cauchy = node_find_property(n, name->cauchy);
	const char *sellmeier = node_string(n, name->sellmeier, NULL);
	*out = (struct ior){.cauchy = node_float(n, name->cauchy, 0)};
	if (sellmeier && (ior || cauchy))
		return node_error(n, e, EINVAL, "%s and %s are both given: only one is allowed", name->sellmeier,
				  (ior ? ior : cauchy)->name);
	int code = ior_read(n, name->ior, side == IOR_INT ? IOR_BK7_DEFAULT : IOR_AIR_DEFAULT, &out->n, e);
	if (!code && sellmeier)
		code = parse_sellmeier(out, n, name->sellmeier, sellmeier, e);
	else if (!code && !cauchy && ior && ior->value.type == VALUE_STRING && node_bool(n, "dispersion", false))
		code = look_up_law(out, n, name->ior, ior->value.as.string, e);
	if (code)
		return code;
	double shortest_ior = ior_eval(out, WAVELENGTH_MIN), longest_ior = ior_eval(out, WAVELENGTH_MAX);
	if (!(fmax(shortest_ior, longest_ior) <= PARAM_IOR_MAX && fmin(shortest_ior, longest_ior) >= PARAM_IOR_MIN))
		return node_error(n, e, ERANGE,
				  "%s: the index of refraction is %g at %g nm and %g at %g nm, outside [%g, %g]",
				  sellmeier ? name->sellmeier : name->cauchy, shortest_ior, WAVELENGTH_MIN, longest_ior,
				  WAVELENGTH_MAX, PARAM_IOR_MIN, PARAM_IOR_MAX);
	out->n = ior_eval(out, IOR_REFERENCE_NM);
	return 0;
}
