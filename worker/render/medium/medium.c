/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads a medium, given in any of the ways of both dialects, into two volumes of coefficients, and evaluates these at
 * points, at wavelengths and along segments of rays.
 *
 * Creation fails, with the position of the node, if coefficients are given in two ways, if no material has the given
 * name, or if `g` has no meaning.
 */
#include "worker/render/medium/medium.h"

#include "worker/render/math/measured_media.h"
#include "worker/render/medium/flakes.h"

#include <string.h>

#define COEFFICIENT VALUE_COLOR, PARAM_UNDERSTOOD, 0, 1e30, NULL
#define VARYING_COEFFICIENT VALUE_VOLUME, PARAM_UNDERSTOOD, 0

/* The scene does not choose how distances are sampled, so these parameters are ignored. */
#define SAMPLING_PARAMS                                                                            \
	{"has_spectral_extinction", IGNORED}, {"sample_emitters", IGNORED}, {"strategy", IGNORED}, \
		{"sampling_density", IGNORED}, {"sigma_n", IGNORED},                               \
	{                                                                                          \
		"medium_sampling_mode", IGNORED                                                    \
	}

const struct plugin_decl medium_decls[] = {
	{PLUGIN_MEDIUM, "homogeneous",
	 PARAMS({"sigma_a", COEFFICIENT}, {"sigma_s", COEFFICIENT}, {"sigma_t", VARYING_COEFFICIENT, 1e30, NULL},
		{"albedo", VARYING_COEFFICIENT, 1, NULL},
		{"scale", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, 1e30, NULL},
		{"material", VALUE_STRING, PARAM_UNDERSTOOD, 0, 0, NULL},	       /* of 0.6: measured_media.h */
		{"g", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, -0.999, 0.999, NULL}, /* of 0.6 */
		SAMPLING_PARAMS),
	 1u << PLUGIN_PHASE, PARAM_UNDERSTOOD},
	{PLUGIN_MEDIUM, "heterogeneous",
	 PARAMS({"sigma_t", VARYING_COEFFICIENT, 1e30, NULL}, /* density in 0.6 */
		{"albedo", VARYING_COEFFICIENT, 1, NULL},
		{"scale", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, 1e30, NULL}, {"method", IGNORED},
		{"step_size", IGNORED}, {"majorant_resolution_factor", IGNORED}, {"majorant_factor", IGNORED},
		SAMPLING_PARAMS),
	 1u << PLUGIN_PHASE, PARAM_UNDERSTOOD},
	{0, NULL, NULL, 0, 0},
};

/* Mitsuba 3's defaults. */
static const double default_sigma_t = 1, default_albedo = 0.75;

/* In a file of 0.6, a missing one of sigma_a and sigma_s, or of sigma_t and albedo, is that of skin1. */
static int fill_in_defaults(struct medium *m, const struct scene_node *n)
{
	char list[2];
	const struct measured_medium *skin = measured_medium_find(MEASURED_MEDIUM_DEFAULT, list, sizeof list);
	double first[3], second[3];
	int rc = 0;
	for (int k = 0; k < 3; k++) {
		double s = MEASURED_MEDIUM_SCALE * skin->sigma_s[k], a = MEASURED_MEDIUM_SCALE * skin->sigma_a[k];
		first[k] = m->uses_albedo ? s + a : a;
		second[k] = m->uses_albedo ? s / (s + a) : s;
	}
	if (!node_find_property(n, m->uses_albedo ? "sigma_t" : "sigma_a")) {
		m->first = (struct volume){.grid = NULL};
		rc = color_from_rgb(first, COLOR_UNBOUNDED, &m->first.color);
	}
	if (!rc && !node_find_property(n, m->uses_albedo ? "albedo" : "sigma_s")) {
		m->second = (struct volume){.grid = NULL};
		rc = color_from_rgb(second, m->uses_albedo ? COLOR_REFLECTANCE : COLOR_UNBOUNDED, &m->second.color);
	}
	return rc;
}

int medium_look_up_measured(const struct scene_node *n, const char *name, bool reduced, double sigma_a[3],
			    double sigma_s[3], struct error *e)
{
	char list[300];
	const struct measured_medium *found = measured_medium_find(name, list, sizeof list);
	if (!found)
		return node_error(n, e, EINVAL, "there is no material '%.64s' (supported: %s)", name, list);
	for (int k = 0; k < 3; k++) {
		sigma_s[k] = MEASURED_MEDIUM_SCALE * found->sigma_s[k] * (reduced ? 1 - found->g[k] : 1);
		sigma_a[k] = MEASURED_MEDIUM_SCALE * found->sigma_a[k];
	}
	return 0;
}

static int read_measured(struct medium *m, const struct scene_node *n, const char *name, struct error *e)
{
	double s[3], a[3];
	int rc = medium_look_up_measured(n, name, !node_find_property(n, "g"), a, s, e);
	if (!rc)
		rc = color_from_rgb(a, COLOR_UNBOUNDED, &m->first.color);
	return rc ? rc : color_from_rgb(s, COLOR_UNBOUNDED, &m->second.color);
}

static int read_sigma_a_and_s(struct medium *m, const struct scene_node *n, const struct volume_build *build,
			      struct error *e)
{
	int rc = volume_from_node(&m->first, n, "sigma_a", 0, COLOR_UNBOUNDED, false, build, e);
	if (!rc)
		rc = volume_from_node(&m->second, n, "sigma_s", 0, COLOR_UNBOUNDED, false, build, e);
	return rc || build->is_dialect_3 ? rc : fill_in_defaults(m, n);
}

static int read_sigma_t_and_albedo(struct medium *m, const struct scene_node *n, const struct volume_build *build,
				   struct error *e)
{
	bool is_heterogeneous = strcmp(n->type, "heterogeneous") == 0;
	int rc = volume_from_node(&m->first, n, "sigma_t", default_sigma_t, COLOR_UNBOUNDED,
				  is_heterogeneous && build->is_dialect_3, build, e);
	if (!rc && !is_heterogeneous && volume_varies(&m->first))
		rc = node_error(n, e, EINVAL, "sigma_t must not vary in space in a homogeneous medium");
	if (!rc)
		rc = volume_from_node(&m->second, n, "albedo", default_albedo, COLOR_REFLECTANCE, false, build, e);
	return rc || is_heterogeneous || build->is_dialect_3 ? rc : fill_in_defaults(m, n);
}

/* Reads `g` of 0.6. Scattering by small angles is neglected: sigma_s is multiplied by 1 - g, with the mean cosine g. */
static int read_forward(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	if (!node_find_property(n, "g"))
		return 0;
	if (build->is_dialect_3)
		return node_error(n, e, EINVAL, "g is a parameter of the phase function in 3.x");
	if (volume_varies(&m->second))
		return node_error(n, e, ENOTSUP, "g is not supported with an albedo that varies in space");
	m->forward_share = node_float(n, "g", 0);
	return 0;
}

int medium_create(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	bool has_sigma_a_or_s = node_find_property(n, "sigma_a") || node_find_property(n, "sigma_s"),
	     has_sigma_t_or_albedo = node_find_property(n, "sigma_t") || node_find_property(n, "albedo");
	const char *material = node_string(n, "material", NULL);
	if (has_sigma_a_or_s + has_sigma_t_or_albedo + (material != NULL) > 1)
		return node_error(n, e, EINVAL,
				  "either sigma_a and sigma_s, or sigma_t and albedo, or a material of 0.6");
	if (!build->is_dialect_3 && strcmp(n->type, "heterogeneous") == 0 &&
	    !(node_find_property(n, "sigma_t") && node_find_property(n, "albedo")))
		return node_error(n, e, EINVAL, "needs a density and an albedo");
	if (!material && !has_sigma_a_or_s && !has_sigma_t_or_albedo && !build->is_dialect_3)
		material = MEASURED_MEDIUM_DEFAULT;
	*m = (struct medium){.uses_albedo = !has_sigma_a_or_s && !material,
			     .per_length = node_float(n, "scale", 1) / build->world_scale};
	int rc = material	    ? read_measured(m, n, material, e)
		 : has_sigma_a_or_s ? read_sigma_a_and_s(m, n, build, e)
				    : read_sigma_t_and_albedo(m, n, build, e);
	if (!rc)
		rc = read_forward(m, n, build, e);
	if (rc)
		return rc;
	const struct scene_node *phase = node_child(n, PLUGIN_PHASE, 0);
	rc = phase_create(&m->phase, phase, build, e);
	if (!rc && m->phase.flakes && m->phase.flakes->has_grid)
		rc = volume_scale_by_area(&m->first, m->phase.flakes->grid, phase, build, e);
	if (rc)
		return rc;
	bool has_first = volume_max(&m->first) > 0, has_second = volume_max(&m->second) > 0,
	     scatters_all = volume_min(&m->second) == 1;
	m->is_absorbing = m->per_length > 0 && has_first && !(m->uses_albedo && scatters_all);
	m->is_scattering = m->per_length > 0 && has_second && (has_first || !m->uses_albedo);
	if (volume_varies(&m->second))
		m->is_absorbing = m->is_scattering = m->is_absorbing || m->is_scattering;
	return 0;
}

int medium_set_emission(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	int rc = emission_create(&m->emission, n, &m->first, build, e);
	m->is_emissive = !rc && emission_max(&m->emission) > 0;
	return rc;
}

bool medium_is_colored(const struct medium *m)
{
	return volume_is_colored(&m->first) || volume_is_colored(&m->second);
}

/* Returns sigma_s, and sets *sigma_t, for the given values of the two volumes, where coefficients that the medium does
 * not have count as 0; 1 / length. */
static spectrum eval_coefficients(const struct medium *m, spectrum first, spectrum second, spectrum *sigma_t)
{
	spectrum sigma_s;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double scattered = m->uses_albedo ? first.v[i] * second.v[i] : second.v[i];
		double absorbed = m->uses_albedo ? first.v[i] - scattered : first.v[i];
		sigma_s.v[i] = m->is_scattering ? scattered * (1 - m->forward_share) * m->per_length : 0;
		sigma_t->v[i] = sigma_s.v[i] + (m->is_absorbing ? absorbed * m->per_length : 0);
	}
	return sigma_s;
}

/* Returns sigma_t. If `second` varies, the medium absorbs and scatters, and sigma_t does not depend on
 * `second`. */
static spectrum eval_extinction(const struct medium *m, spectrum first, const struct wavelengths *w)
{
	spectrum sigma_t;
	eval_coefficients(m, first, volume_varies(&m->second) ? spectrum_constant(0) : color_eval(&m->second.color, w),
			  &sigma_t);
	return sigma_t;
}

spectrum medium_scattering(const struct medium *m, vec3 p, vec3 d, const struct wavelengths *w)
{
	spectrum unused, sigma_s = eval_coefficients(m, volume_eval(&m->first, p, true, w),
						     volume_eval(&m->second, p, false, w), &unused);
	return spectrum_scale((1 - m->phase.absorbed_share) * phase_area(&m->phase, p, d), sigma_s);
}

spectrum medium_extinction(const struct medium *m, vec3 p, vec3 d, const struct wavelengths *w)
{
	return spectrum_scale(phase_area(&m->phase, p, d), eval_extinction(m, volume_eval(&m->first, p, true, w), w));
}

struct medium_lanes medium_lanes_along(const struct medium *m, vec3 d, const struct wavelengths *w)
{
	static const vec3 origin = {0, 0, 0};
	/* Then the grid itself multiplies by the area. */
	bool has_area_grid = m->first.grid && m->first.grid->area_matrix;
	spectrum unit = spectrum_scale(has_area_grid ? 1 : phase_area(&m->phase, origin, d),
				       eval_extinction(m, color_eval(&m->first.color, w), w));
	struct medium_lanes l = {.grid = m->first.grid, .channels = 1, .sigma_t = {unit}};
	if (!l.grid)
		return l;
	l.channels = volume_channel_weights(&m->first, w, l.sigma_t);
	for (int k = 0; k < l.channels; k++)
		l.sigma_t[k] = spectrum_mul(l.sigma_t[k], unit);
	return l;
}

/* Returns the optical depth, given the integral of each channel along a ray. */
static spectrum depth_from_integrals(const struct medium_lanes *m, const double sum[GRID_CHANNELS_MAX])
{
	spectrum depth = spectrum_constant(0);
	for (int k = 0; k < m->channels; k++)
		for (int i = 0; i < SPECTRUM_LANES; i++)
			/* Avoids 0 times infinity. */
			depth.v[i] += m->sigma_t[k].v[i] > 0 ? m->sigma_t[k].v[i] * sum[k] : 0;
	return depth;
}

spectrum medium_optical_depth(const struct medium_lanes *m, const struct grid_ray *r)
{
	double sum[GRID_CHANNELS_MAX] = {fmax(r->t1 - r->t0, 0)};
	if (m->grid)
		grid_integrate(m->grid, r, sum);
	return depth_from_integrals(m, sum);
}

double medium_invert_depth(const struct medium_lanes *m, const struct grid_ray *r, int lane, double target,
			   spectrum *depth)
{
	double weight[GRID_CHANNELS_MAX] = {0}, sum[GRID_CHANNELS_MAX], t;
	for (int k = 0; k < m->channels; k++)
		weight[k] = m->sigma_t[k].v[lane];
	if (m->grid) {
		t = grid_invert_integral(m->grid, r, weight, target, sum);
	} else {
		t = weight[0] > 0 ? r->t0 + target / weight[0] : INFINITY;
		t = t < r->t1 ? t : INFINITY;
		sum[0] = fmax(fmin(t, r->t1) - r->t0, 0);
	}
	*depth = depth_from_integrals(m, sum);
	return t;
}
