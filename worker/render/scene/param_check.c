/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/param_check.h"

#include "common/base/spelling.h"
#include "worker/render/scene/element.h"
#include "worker/render/scene/value.h"

#include <float.h>
#include <stdint.h>
#include <string.h>

static int refuse_choice(const struct xml_element *el, const struct param *p, const char *given, struct error *e)
{
	char one[64], names[16][64], hint[128], list[512] = "";
	struct spelling s = {.wanted = given};
	size_t n = 0;
	for (const char *rest = p->choices; n < 16 && (rest = element_next_name(rest, one, sizeof one)); n++) {
		memcpy(names[n], one, sizeof one);
		spelling_offer(&s, names[n]);
	}
	for (const char *rest = p->choices; (rest = element_next_name(rest, one, sizeof one));)
		spelling_list(list, sizeof list, one);
	return xml_error(el, e, EINVAL, "%s=\"%.64s\" is not supported%s (supported: %s)",
			 element_spelling(el, p->name), given, spelling_hint(&s, hint, sizeof hint), list);
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
			return xml_error(el, e, ERANGE, "%s=%g is outside [%g, %g]", element_spelling(el, p->name),
					 x[i], p->min, p->max);
	return 0;
}

/* A colour that is constant is accepted as a number: exporters write roughness as a colour. */
static void number_of_color(const struct param *p, struct value *v)
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
	if (v->type == VALUE_INT && !(p->types & VALUE_INT) && (p->types & VALUE_FLOAT)) {
		double x = (double)v->as.integer;
		v->type = VALUE_FLOAT;
		v->as.number = x;
	}
	number_of_color(p, v);
	if (!(v->type & p->types)) {
		char list[256];
		value_type_names(p->types, list, sizeof list);
		return xml_error(el, e, EINVAL, "`%s` cannot have this type (supported: %s)",
				 element_spelling(el, p->name), list);
	}
	if (p->min < p->max && (r = check_range(el, p, v, e)))
		return r;
	if (v->type == VALUE_STRING && p->choices) {
		char one[64];
		for (const char *rest = p->choices; (rest = element_next_name(rest, one, sizeof one));)
			if (strcmp(one, v->as.string) == 0)
				return 0;
		return refuse_choice(el, p, v->as.string, e);
	}
	return 0;
}
