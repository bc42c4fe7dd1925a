/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/medium/medium.h"

#include <math.h>

#define COEFFICIENT VALUE_COLOR, PARAM_UNDERSTOOD, 0, 1e30, NULL
#define IGNORED 0, PARAM_IGNORED, 0, 0, NULL

/* Methods of sampling distances have nothing to do here. */
static const struct param homogeneous_params[] = {
	{"sigma_a", COEFFICIENT},
	{"sigma_s", COEFFICIENT},
	{"sigma_t", COEFFICIENT},
	{"albedo", VALUE_COLOR, PARAM_UNDERSTOOD, 0, 1, NULL},
	{"scale", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, 1e30, NULL},
	{"has_spectral_extinction", IGNORED},
	{"sample_emitters", IGNORED},
	{"strategy", IGNORED},
	{"sampling_density", IGNORED},
	{NULL, 0, 0, 0, 0, NULL},
};

const struct plugin_decl medium_decls[] = {
	{PLUGIN_MEDIUM, "homogeneous", homogeneous_params, 0, PARAM_UNDERSTOOD},
	{0, NULL, NULL, 0, 0},
};

int medium_create(struct medium *m, const struct scene_node *n, double unit, struct arena *arena, struct error *e)
{
	const struct property *absorbed = node_find(n, "sigma_a"), *lost = node_find(n, "sigma_t");
	struct error reason;
	m->sigma_a = color_constant(1); /* sigma_t of Mitsuba 3 */
	m->per_length = node_float(n, "scale", 1) / unit;
	if (!absorbed && !lost)
		return 0;
	int code = color_from_value(absorbed ? &absorbed->value : &lost->value, COLOR_UNBOUNDED, arena, &m->sigma_a,
				    &reason);
	return code ? node_error(n, e, -code, "%s: %s", absorbed ? "sigma_a" : "sigma_t", reason.text) : 0;
}

spectrum medium_transmittance(const struct medium *m, double distance, const struct wavelengths *w)
{
	spectrum t = color_eval(&m->sigma_a, w);
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double per_length = t.v[i] * m->per_length;
		t.v[i] = per_length > 0 ? exp(-per_length * distance) : 1; /* not 0 times infinity */
	}
	return t;
}
