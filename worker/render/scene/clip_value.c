/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/clip_value.h"

#include <math.h>

int clip_value(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
	       const struct param *p, struct value *v)
{
	if (v->type == VALUE_INT) {
		double x = (double)v->as.integer;
		v->type = VALUE_FLOAT;
		v->as.number = x;
	}
	double *x = v->type == VALUE_FLOAT ? &v->as.number : v->as.rgb, outside = 0, end = 0;
	int count = v->type == VALUE_FLOAT ? 1 : v->type == VALUE_RGB ? 3 : 0;
	for (int i = 0; i < count; i++) {
		double within = fmin(fmax(x[i], p->min), p->max);
		if (within != x[i]) {
			outside = x[i];
			end = within;
		}
		x[i] = within;
	}
	if (outside == end)
		return 0;
	const char *type = xml_attribute(owner, "type");
	return note(t, owner, type, p->name,
		    "%s:%d: <%.64s type=\"%.64s\">: %s=%g is outside [%g, %g] and counts as %g", el->file, el->line,
		    owner->name, type, element_spelling(el, p->name), outside, p->min, p->max, end);
}
