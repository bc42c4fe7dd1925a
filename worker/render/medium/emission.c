/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/medium/emission.h"

int emission_create(struct emission *g, const struct scene_node *n, const struct volume *extinction,
		    const struct volume_build *build, struct error *e)
{
	if (!build->is_dialect_3)
		return node_error(n, e, ENOTSUP, "a scene of 0.6 has no \"volumelight\"");
	g->per_length = 1 / build->world_scale;
	int rc = volume_from_node(&g->radiance, n, "radiance", 0, COLOR_ILLUMINANT, false, build, e);
	return rc ? rc : volume_adopt_bounds(&g->radiance, extinction, n, build, e);
}

double emission_max(const struct emission *g)
{
	return volume_max(&g->radiance) * g->per_length;
}

enum color_kind emission_color_kind(const struct emission *g)
{
	const struct grid *grid = g->radiance.grid;
	return grid && grid->channels > 1 ? COLOR_KIND_OTHER : g->radiance.color.kind;
}

spectrum emission_constant(const struct emission *g, const struct wavelengths *w)
{
	return spectrum_scale(g->per_length, color_eval(&g->radiance.color, w));
}

/* Samples t in proportion to the mean of the channels. */
static bool sample_grid(const struct emission *g, const struct grid_ray *r, double u, const struct wavelengths *w,
			double *t, spectrum *l)
{
	const struct grid *grid = g->radiance.grid;
	double weight[GRID_CHANNELS_MAX] = {0}, value[GRID_CHANNELS_MAX], unused[GRID_CHANNELS_MAX], sum = 0,
	       emission_at_t = 0;
	grid_integrate(grid, r, value);
	for (int k = 0; k < grid->channels; k++) {
		weight[k] = 1.0 / grid->channels;
		sum += weight[k] * value[k];
	}
	*t = sum > 0 ? grid_invert_integral(grid, r, weight, u * sum, unused) : INFINITY;
	if (*t == INFINITY)
		return false;
	grid_eval(grid, vec3_madd(r->o, *t, r->d), value);
	for (int k = 0; k < grid->channels; k++)
		emission_at_t += weight[k] * value[k];
	if (!(emission_at_t > 0))
		return false;
	*l = grid->channels > 1 ? color_eval_rgb_illuminant(value, w)
				: spectrum_scale(value[0], color_eval(&g->radiance.color, w));
	*l = spectrum_scale(g->per_length * sum / emission_at_t, *l);
	return true;
}

bool emission_sample(const struct emission *g, const struct grid_ray *r, double u, const struct wavelengths *w,
		     double *t, spectrum *l)
{
	if (g->radiance.grid)
		return sample_grid(g, r, u, w, t, l);
	double length = r->t1 - r->t0;
	*t = r->t0 + u * length;
	*l = spectrum_scale(length, emission_constant(g, w));
	return length > 0 && isfinite(length);
}
