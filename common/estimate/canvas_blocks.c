/* SPDX-License-Identifier: Apache-2.0 */
#include "common/estimate/canvas_blocks.h"

#include "common/base/color.h"
#include "common/film/canvas_films.h"

static double ratio_or_zero(double a, double b)
{
	return b > 0 ? a / b : 0;
}

/* Returns the factor from sums on the grid to X, Y, Z of the group's image. The image of chains is scaled by the
 * group's own b. */
static double group_factor(const struct canvas *c, uint32_t group)
{
	const struct plan *p = &c->plan;
	if (p->kind != PLAN_CHAINS)
		return ratio_or_zero(c->quantum, (double)p->epoch * (double)c->rounds);
	struct exact_sum sum = c->prefix_tally.groups[group].independent_sum;
	exact_sum_merge(&sum, &c->bootstrap_tally.groups[group].independent_sum);
	uint64_t independent = c->prefix_tally.groups[group].independent + c->bootstrap_tally.groups[group].independent;
	return ratio_or_zero(exact_sum_value(&sum), (double)independent) *
	       ratio_or_zero(c->quantum, (double)c->prefix_tally.groups[group].samples);
}

/* Returns X, Y, Z of a pixel on the grid; NULL if nothing was added to its tile. */
static const int64_t *pixel_channels(const struct canvas *c, size_t film, uint32_t x, uint32_t y)
{
	size_t tile = (size_t)(y / TILE_SIZE) * c->tiles_across + x / TILE_SIZE;
	if (!(*canvas_tile_flags(c, film, tile) & TILE_USED))
		return NULL;
	return canvas_slot(c, film, tile) + (size_t)(y % TILE_SIZE) * SLOT_ROW_VALUES +
	       (size_t)(x % TILE_SIZE) * TILE_CHANNELS;
}

static double pixel_sum(const struct canvas *c, size_t film, uint32_t x, uint32_t y)
{
	const int64_t *v = pixel_channels(c, film, x, y);
	return v ? (double)v[0] + (double)v[1] + (double)v[2] : 0;
}

void canvas_group_blocks(const struct canvas *c, uint32_t across, uint32_t down, double *out)
{
	uint32_t width = c->plan.crop_width, height = c->plan.crop_height;
	for (uint32_t g = 0; g < c->plan.groups; g++) {
		double *block = out + (size_t)g * (across * down + 1), factor = group_factor(c, g), total = 0;
		for (uint32_t k = 0; k < across * down; k++) {
			uint64_t x0 = (uint64_t)width * (k % across) / across,
				 x1 = (uint64_t)width * (k % across + 1) / across;
			uint64_t y0 = (uint64_t)height * (k / across) / down,
				 y1 = (uint64_t)height * (k / across + 1) / down;
			double sum = 0;
			for (uint64_t y = y0; y < y1; y++)
				for (uint64_t x = x0; x < x1; x++)
					sum += pixel_sum(c, canvas_film_index(g, FILM_PREFIX), (uint32_t)x,
							 (uint32_t)y);
			total += sum;
			block[k] = factor * sum / (double)((x1 - x0) * (y1 - y0));
		}
		block[across * down] = factor * total / ((double)width * height);
	}
}

void canvas_group_distances(const struct canvas *c, const double *weight, double *out)
{
	uint32_t groups = c->plan.groups, width = c->plan.crop_width, height = c->plan.crop_height;
	double factor[PLAN_GROUPS_MAX], rgb[PLAN_GROUPS_MAX][3];
	for (uint32_t g = 0; g < groups; g++) {
		factor[g] = group_factor(c, g);
		out[g] = 0;
	}
	for (size_t i = 0; i < (size_t)width * height; i++) {
		double mean[3] = {0};
		for (uint32_t g = 0; g < groups; g++) {
			const int64_t *v = pixel_channels(c, canvas_film_index(g, FILM_PREFIX), (uint32_t)(i % width),
							  (uint32_t)(i / width));
			double xyz[3] = {0};
			for (int k = 0; v && k < 3; k++)
				xyz[k] = factor[g] * (double)v[k];
			rec709_from_xyz(xyz, rgb[g]);
			for (int k = 0; k < 3; k++)
				mean[k] += rgb[g][k] / groups;
		}
		for (uint32_t g = 0; g < groups; g++)
			for (size_t k = 0; k < 3; k++)
				out[g] += weight[3 * i + k] * (rgb[g][k] - mean[k]) * (rgb[g][k] - mean[k]);
	}
}
