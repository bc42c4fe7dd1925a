/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/medium/medium.h"

#include "worker/render/medium/measured.h"

#include <math.h>
#include <string.h>

#define COEFFICIENT VALUE_COLOR, PARAM_UNDERSTOOD, 0, 1e30, NULL
#define IGNORED 0, PARAM_IGNORED, 0, 0, NULL

/* Ways of sampling distances are not the scene's choice here. */
static const struct param homogeneous_params[] = {
	{"sigma_a", COEFFICIENT},
	{"sigma_s", COEFFICIENT},
	{"sigma_t", COEFFICIENT},
	{"albedo", VALUE_COLOR, PARAM_UNDERSTOOD, 0, 1, NULL},
	{"scale", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, 1e30, NULL},
	{"material", VALUE_STRING, PARAM_UNDERSTOOD, 0, 0, NULL}, /* of 0.6: measured.h */
	{"has_spectral_extinction", IGNORED},
	{"sample_emitters", IGNORED},
	{"strategy", IGNORED},
	{"sampling_density", IGNORED},
	{"medium_sampling_mode", IGNORED},
	{NULL, 0, 0, 0, 0, NULL},
};

const struct plugin_decl medium_decls[] = {
	{PLUGIN_MEDIUM, "homogeneous", homogeneous_params, 1u << PLUGIN_PHASE, PARAM_UNDERSTOOD},
	{0, NULL, NULL, 0, 0},
};

/* Mitsuba 3's defaults. */
static const double default_sigma_t = 1, default_albedo = 0.75;

static int read_coefficient(struct color *c, const struct scene_node *n, const char *name, enum color_role role,
			    double fallback, struct arena *arena, struct error *e)
{
	const struct property *p = node_find(n, name);
	struct error reason;
	*c = color_constant(fallback);
	int code = p ? color_from_value(&p->value, role, arena, c, &reason) : 0;
	return code ? node_error(n, e, -code, "%s: %s", name, reason.text) : 0;
}

/* -EINVAL: no such material. */
static int read_measured(struct medium *m, const struct scene_node *n, const char *name, struct error *e)
{
	char list[300];
	const struct measured_medium *found = measured_find(name, list, sizeof list);
	if (!found)
		return node_error(n, e, EINVAL, "there is no material '%.64s' (supported: %s)", name, list);
	int rc = color_from_rgb(found->sigma_a, COLOR_UNBOUNDED, &m->first);
	return rc ? rc : color_from_rgb(found->sigma_s, COLOR_UNBOUNDED, &m->second);
}

static int read_coefficients(struct medium *m, const struct scene_node *n, struct arena *arena, struct error *e)
{
	int rc = m->by_albedo ? read_coefficient(&m->first, n, "sigma_t", COLOR_UNBOUNDED, default_sigma_t, arena, e)
			      : read_coefficient(&m->first, n, "sigma_a", COLOR_UNBOUNDED, 0, arena, e);
	if (rc)
		return rc;
	return m->by_albedo ? read_coefficient(&m->second, n, "albedo", COLOR_REFLECTANCE, default_albedo, arena, e)
			    : read_coefficient(&m->second, n, "sigma_s", COLOR_UNBOUNDED, 0, arena, e);
}

int medium_create(struct medium *m, const struct scene_node *n, const struct medium_build *build, struct error *e)
{
	bool apart = node_find(n, "sigma_a") || node_find(n, "sigma_s"),
	     together = node_find(n, "sigma_t") || node_find(n, "albedo");
	const char *material = node_string(n, "material", NULL);
	if (apart + together + (material != NULL) > 1)
		return node_error(n, e, EINVAL,
				  "either sigma_a and sigma_s, or sigma_t and albedo, or a material of 0.6");
	if (!material && !apart && !together && !build->dialect_3)
		material = MEASURED_DEFAULT;
	*m = (struct medium){.by_albedo = !apart && !material, .per_length = node_float(n, "scale", 1) / build->unit};
	int rc = material ? read_measured(m, n, material, e) : read_coefficients(m, n, build->arena, e);
	if (rc)
		return rc;
	phase_create(&m->phase, node_child(n, PLUGIN_PHASE, 0));
	bool first = color_max(&m->first) > 0, second = color_max(&m->second) > 0,
	     all = m->second.shape == COLOR_SHAPE_CONSTANT && color_max(&m->second) == 1;
	m->absorbs = m->per_length > 0 && first && !(m->by_albedo && all);
	m->scatters = m->per_length > 0 && second && (first || !m->by_albedo);
	return 0;
}

bool medium_is_coloured(const struct medium *m)
{
	return m->first.shape != COLOR_SHAPE_CONSTANT || m->second.shape != COLOR_SHAPE_CONSTANT;
}

/* Sigma_s, and sigma_t of what the medium does. 1 / length */
static spectrum coefficients(const struct medium *m, const struct wavelengths *w, spectrum *sigma_t)
{
	spectrum first = color_eval(&m->first, w), second = color_eval(&m->second, w), sigma_s;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double scattered = m->by_albedo ? first.v[i] * second.v[i] : second.v[i];
		double absorbed = m->by_albedo ? first.v[i] - scattered : first.v[i];
		sigma_s.v[i] = m->scatters ? scattered * m->per_length : 0;
		sigma_t->v[i] = sigma_s.v[i] + (m->absorbs ? absorbed * m->per_length : 0);
	}
	return sigma_s;
}

spectrum medium_scattering(const struct medium *m, const struct wavelengths *w)
{
	spectrum sigma_t;
	return coefficients(m, w, &sigma_t);
}

spectrum medium_extinction(const struct medium *m, const struct wavelengths *w)
{
	spectrum sigma_t;
	coefficients(m, w, &sigma_t);
	return sigma_t;
}

spectrum medium_transmittance(const struct medium *m, double distance, const struct wavelengths *w)
{
	spectrum t = medium_extinction(m, w);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		t.v[i] = t.v[i] > 0 ? exp(-t.v[i] * distance) : 1; /* not 0 times infinity */
	return t;
}
