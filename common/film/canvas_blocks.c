#include "common/film/canvas_private.h"

static double ratio(double a, double b)
{
	return b > 0 ? a / b : 0;
}

/* From sums on the grid to X+Y+Z of the group's image, which has the group's own b. */
static double factor_of(const struct canvas *c, uint32_t group)
{
	const struct plan *p = &c->plan;
	if (p->kind != PLAN_CHAINS)
		return ratio(c->quantum, (double)p->epoch * (double)c->rounds);
	struct exact_sum sum = c->prefix.group[group].sum;
	exact_sum_merge(&sum, &c->bootstrap.group[group].sum);
	uint64_t independent = c->prefix.group[group].independent + c->bootstrap.group[group].independent;
	return ratio(exact_sum_value(&sum), (double)independent) * ratio(c->quantum, (double)c->prefix.group[group].samples);
}

static double pixel_sum(const struct canvas *c, size_t film, uint32_t x, uint32_t y)
{
	size_t tile = (size_t)(y / TILE_SIZE) * c->tiles_across + x / TILE_SIZE;
	if (!(*canvas_flags(c, film, tile) & TILE_USED))
		return 0;
	const int64_t *v = canvas_slot(c, film, tile) + (size_t)(y % TILE_SIZE) * SLOT_ROW + (size_t)(x % TILE_SIZE) * TILE_CHANNELS;
	return (double)v[0] + (double)v[1] + (double)v[2];
}

void canvas_group_blocks(const struct canvas *c, uint32_t across, uint32_t down, double *out)
{
	uint32_t width = c->plan.crop_width, height = c->plan.crop_height;
	for (uint32_t g = 0; g < c->plan.groups; g++) {
		double *block = out + (size_t)g * (across * down + 1), factor = factor_of(c, g), all = 0;
		for (uint32_t k = 0; k < across * down; k++) {
			uint64_t x0 = (uint64_t)width * (k % across) / across, x1 = (uint64_t)width * (k % across + 1) / across;
			uint64_t y0 = (uint64_t)height * (k / across) / down, y1 = (uint64_t)height * (k / across + 1) / down;
			double sum = 0;
			for (uint64_t y = y0; y < y1; y++)
				for (uint64_t x = x0; x < x1; x++)
					sum += pixel_sum(c, canvas_film(g, FILM_PREFIX), (uint32_t)x, (uint32_t)y);
			all += sum;
			block[k] = factor * sum / (double)((x1 - x0) * (y1 - y0));
		}
		block[across * down] = factor * all / ((double)width * height);
	}
}
