/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/volume_emission.h"

spectrum volume_emission(struct path_context *c, unsigned first, unsigned last, struct path_classes *classes)
{
	spectrum sum = spectrum_constant(0);
	bool dispersed = c->is_dispersed;
	for (unsigned e = 1; e <= c->emission_edges && e <= last; e++) {
		dispersed = dispersed ||
			    (e > 1 && EFFECT_IS_ON(c->w, dispersion) && path_vertex_disperses(&c->camera[e - 1]));
		if (e < first)
			continue;
		spectrum l = path_collapse_to_hero(c->emission[e], dispersed);
		if (!path_accept(c, l))
			continue;
		sum = spectrum_add(sum, l);
		if (classes)
			path_classes_add(classes, c, 0, e + 1, l);
	}
	return sum;
}
