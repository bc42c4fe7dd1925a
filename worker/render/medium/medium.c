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
#define VARIES VALUE_VOLUME, PARAM_UNDERSTOOD, 0

/* The scene does not choose how distances are sampled, so these parameters are ignored. */
#define SAMPLING_PARAMS                                                                            \
	{"has_spectral_extinction", IGNORED}, {"sample_emitters", IGNORED}, {"strategy", IGNORED}, \
		{"sampling_density", IGNORED}, {"sigma_n", IGNORED},                               \
	{                                                                                          \
		"medium_sampling_mode", IGNORED                                                    \
	}

const struct plugin_decl medium_decls[] = {
	{PLUGIN_MEDIUM, "homogeneous",
	 PARAMS({"sigma_a", COEFFICIENT}, {"sigma_s", COEFFICIENT}, {"sigma_t", VARIES, 1e30, NULL},
		{"albedo", VARIES, 1, NULL}, {"scale", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, 1e30, NULL},
		{"material", VALUE_STRING, PARAM_UNDERSTOOD, 0, 0, NULL},	       /* of 0.6: measured_media.h */
		{"g", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, -0.999, 0.999, NULL}, /* of 0.6 */
		SAMPLING_PARAMS),
	 1u << PLUGIN_PHASE, PARAM_UNDERSTOOD},
	{PLUGIN_MEDIUM, "heterogeneous",
	 PARAMS({"sigma_t", VARIES, 1e30, NULL}, /* density in 0.6 */
		{"albedo", VARIES, 1, NULL}, {"scale", VALUE_FLOAT | VALUE_INT, PARAM_UNDERSTOOD, 0, 1e30, NULL},
		{"method", IGNORED}, {"step_size", IGNORED}, {"majorant_resolution_factor", IGNORED},
		{"majorant_factor", IGNORED}, SAMPLING_PARAMS),
	 1u << PLUGIN_PHASE, PARAM_UNDERSTOOD},
	{0, NULL, NULL, 0, 0},
};

/* Mitsuba 3's defaults. */
static const double default_sigma_t = 1, default_albedo = 0.75;

/* In a file of 0.6, a missing one of sigma_a and sigma_s, or of sigma_t and albedo, is that of skin1. */
static int fill_in(struct medium *m, const struct scene_node *n)
{
	char list[2];
	const struct measured_medium *skin = measured_find(MEASURED_DEFAULT, list, sizeof list);
	double first[3], second[3];
	int rc = 0;
	for (int k = 0; k < 3; k++) {
		double s = MEASURED_SCALE * skin->sigma_s[k], a = MEASURED_SCALE * skin->sigma_a[k];
		first[k] = m->by_albedo ? s + a : a;
		second[k] = m->by_albedo ? s / (s + a) : s;
	}
	if (!node_find(n, m->by_albedo ? "sigma_t" : "sigma_a")) {
		m->first = (struct volume){.grid = NULL};
		rc = color_from_rgb(first, COLOR_UNBOUNDED, &m->first.color);
	}
	if (!rc && !node_find(n, m->by_albedo ? "albedo" : "sigma_s")) {
		m->second = (struct volume){.grid = NULL};
		rc = color_from_rgb(second, m->by_albedo ? COLOR_REFLECTANCE : COLOR_UNBOUNDED, &m->second.color);
	}
	return rc;
}

int medium_measured(const struct scene_node *n, const char *name, bool reduced, double sigma_a[3], double sigma_s[3],
		    struct error *e)
{
	char list[300];
	const struct measured_medium *found = measured_find(name, list, sizeof list);
	if (!found)
		return node_error(n, e, EINVAL, "there is no material '%.64s' (supported: %s)", name, list);
	for (int k = 0; k < 3; k++) {
		sigma_s[k] = MEASURED_SCALE * found->sigma_s[k] * (reduced ? 1 - found->g[k] : 1);
		sigma_a[k] = MEASURED_SCALE * found->sigma_a[k];
	}
	return 0;
}

static int read_measured(struct medium *m, const struct scene_node *n, const char *name, struct error *e)
{
	double s[3], a[3];
	int rc = medium_measured(n, name, !node_find(n, "g"), a, s, e);
	if (!rc)
		rc = color_from_rgb(a, COLOR_UNBOUNDED, &m->first.color);
	return rc ? rc : color_from_rgb(s, COLOR_UNBOUNDED, &m->second.color);
}

static int read_apart(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	int rc = volume_from_node(&m->first, n, "sigma_a", 0, COLOR_UNBOUNDED, false, build, e);
	if (!rc)
		rc = volume_from_node(&m->second, n, "sigma_s", 0, COLOR_UNBOUNDED, false, build, e);
	return rc || build->dialect_3 ? rc : fill_in(m, n);
}

static int read_together(struct medium *m, const struct scene_node *n, const struct volume_build *build,
			 struct error *e)
{
	bool uneven = strcmp(n->type, "heterogeneous") == 0;
	int rc = volume_from_node(&m->first, n, "sigma_t", default_sigma_t, COLOR_UNBOUNDED, uneven && build->dialect_3,
				  build, e);
	if (!rc && !uneven && volume_varies(&m->first))
		rc = node_error(n, e, EINVAL, "sigma_t must not vary in space in a homogeneous medium");
	if (!rc)
		rc = volume_from_node(&m->second, n, "albedo", default_albedo, COLOR_REFLECTANCE, false, build, e);
	return rc || uneven || build->dialect_3 ? rc : fill_in(m, n);
}

/* Reads `g` of 0.6. Scattering by small angles is neglected: sigma_s is multiplied by 1 - g, with the mean cosine g. */
static int read_forward(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	if (!node_find(n, "g"))
		return 0;
	if (build->dialect_3)
		return node_error(n, e, EINVAL, "g is a parameter of the phase function in 3.x");
	if (volume_varies(&m->second))
		return node_error(n, e, ENOTSUP, "g is not supported with an albedo that varies in space");
	m->forward = node_float(n, "g", 0);
	return 0;
}

int medium_create(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	bool apart = node_find(n, "sigma_a") || node_find(n, "sigma_s"),
	     together = node_find(n, "sigma_t") || node_find(n, "albedo");
	const char *material = node_string(n, "material", NULL);
	if (apart + together + (material != NULL) > 1)
		return node_error(n, e, EINVAL,
				  "either sigma_a and sigma_s, or sigma_t and albedo, or a material of 0.6");
	if (!build->dialect_3 && strcmp(n->type, "heterogeneous") == 0 &&
	    !(node_find(n, "sigma_t") && node_find(n, "albedo")))
		return node_error(n, e, EINVAL, "needs a density and an albedo");
	if (!material && !apart && !together && !build->dialect_3)
		material = MEASURED_DEFAULT;
	*m = (struct medium){.by_albedo = !apart && !material, .per_length = node_float(n, "scale", 1) / build->scale};
	int rc = material ? read_measured(m, n, material, e)
		 : apart  ? read_apart(m, n, build, e)
			  : read_together(m, n, build, e);
	if (!rc)
		rc = read_forward(m, n, build, e);
	if (rc)
		return rc;
	const struct scene_node *phase = node_child(n, PLUGIN_PHASE, 0);
	rc = phase_create(&m->phase, phase, build, e);
	if (!rc && m->phase.flakes && m->phase.flakes->uneven)
		rc = volume_by_area(&m->first, m->phase.flakes->grid, phase, build, e);
	if (rc)
		return rc;
	bool first = volume_max(&m->first) > 0, second = volume_max(&m->second) > 0,
	     all = volume_least(&m->second) == 1;
	m->absorbs = m->per_length > 0 && first && !(m->by_albedo && all);
	m->scatters = m->per_length > 0 && second && (first || !m->by_albedo);
	if (volume_varies(&m->second))
		m->absorbs = m->scatters = m->absorbs || m->scatters;
	return 0;
}

int medium_light(struct medium *m, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	int rc = emission_create(&m->emission, n, &m->first, build, e);
	m->shines = !rc && emission_max(&m->emission) > 0;
	return rc;
}

bool medium_is_coloured(const struct medium *m)
{
	return volume_is_coloured(&m->first) || volume_is_coloured(&m->second);
}

/* Returns sigma_s, and sets *sigma_t, for the given values of the two volumes, where coefficients that the medium does
 * not have count as 0; 1 / length. */
static spectrum coefficients(const struct medium *m, spectrum first, spectrum second, spectrum *sigma_t)
{
	spectrum sigma_s;
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double scattered = m->by_albedo ? first.v[i] * second.v[i] : second.v[i];
		double absorbed = m->by_albedo ? first.v[i] - scattered : first.v[i];
		sigma_s.v[i] = m->scatters ? scattered * (1 - m->forward) * m->per_length : 0;
		sigma_t->v[i] = sigma_s.v[i] + (m->absorbs ? absorbed * m->per_length : 0);
	}
	return sigma_s;
}

/* Returns sigma_t. If `second` varies, the medium absorbs and scatters, and sigma_t does not depend on `second`. */
static spectrum extinction(const struct medium *m, spectrum first, const struct wavelengths *w)
{
	spectrum sigma_t;
	coefficients(m, first, volume_varies(&m->second) ? spectrum_of(0) : color_eval(&m->second.color, w), &sigma_t);
	return sigma_t;
}

spectrum medium_scattering(const struct medium *m, vec3 p, vec3 d, const struct wavelengths *w)
{
	spectrum unused, sigma_s = coefficients(m, volume_at(&m->first, p, true, w), volume_at(&m->second, p, false, w),
						&unused);
	return spectrum_scale((1 - m->phase.absorbed) * phase_area(&m->phase, p, d), sigma_s);
}

spectrum medium_extinction(const struct medium *m, vec3 p, vec3 d, const struct wavelengths *w)
{
	return spectrum_scale(phase_area(&m->phase, p, d), extinction(m, volume_at(&m->first, p, true, w), w));
}

struct medium_lanes medium_at(const struct medium *m, vec3 d, const struct wavelengths *w)
{
	static const vec3 anywhere = {0, 0, 0};
	bool uneven = m->first.grid && m->first.grid->area; /* then the grid itself multiplies by the area */
	spectrum unit = spectrum_scale(uneven ? 1 : phase_area(&m->phase, anywhere, d),
				       extinction(m, color_eval(&m->first.color, w), w));
	struct medium_lanes l = {.grid = m->first.grid, .channels = 1, .sigma_t = {unit}};
	if (!l.grid)
		return l;
	l.channels = volume_weights(&m->first, w, l.sigma_t);
	for (int k = 0; k < l.channels; k++)
		l.sigma_t[k] = spectrum_mul(l.sigma_t[k], unit);
	return l;
}

/* Returns the optical depth, given the integral of each channel along a ray. */
static spectrum depth_of(const struct medium_lanes *m, const double sum[GRID_CHANNELS_MAX])
{
	spectrum depth = spectrum_of(0);
	for (int k = 0; k < m->channels; k++)
		for (int i = 0; i < SPECTRUM_LANES; i++)
			depth.v[i] +=
				m->sigma_t[k].v[i] > 0 ? m->sigma_t[k].v[i] * sum[k] : 0; /* avoids 0 times infinity */
	return depth;
}

spectrum medium_depth(const struct medium_lanes *m, const struct grid_ray *r)
{
	double sum[GRID_CHANNELS_MAX] = {fmax(r->t1 - r->t0, 0)};
	if (m->grid)
		grid_integrate(m->grid, r, sum);
	return depth_of(m, sum);
}

double medium_reach(const struct medium_lanes *m, const struct grid_ray *r, int lane, double least, spectrum *depth)
{
	double weight[GRID_CHANNELS_MAX] = {0}, sum[GRID_CHANNELS_MAX], t;
	for (int k = 0; k < m->channels; k++)
		weight[k] = m->sigma_t[k].v[lane];
	if (m->grid) {
		t = grid_reach(m->grid, r, weight, least, sum);
	} else {
		t = weight[0] > 0 ? r->t0 + least / weight[0] : INFINITY;
		t = t < r->t1 ? t : INFINITY;
		sum[0] = fmax(fmin(t, r->t1) - r->t0, 0);
	}
	*depth = depth_of(m, sum);
	return t;
}
