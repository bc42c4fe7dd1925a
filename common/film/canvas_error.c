/*
 * The error of an image and the estimate of its relMSE, from the spread between groups. All loops run in a fixed order over
 * exact inputs, so that equal films give equal bits.
 */
#include "common/film/canvas_private.h"
#include "common/film/color.h"
#include "common/film/quantile.h"

#include <math.h>

static void pixel_error(struct making *m, size_t tile, size_t at, size_t pixel, double floor_square)
{
	uint32_t groups = m->c->plan.groups;
	double rgb[PLAN_MAX_GROUPS][3], mean[3] = {0};
	for (uint32_t g = 0; g < groups; g++) {
		double xyz[3];
		for (size_t k = 0; k < 3; k++)
			xyz[k] = canvas_sum(m, g, tile, at + k) * m->factor[g];
		rec709_from_xyz(xyz, rgb[g]);
		for (int k = 0; k < 3; k++)
			mean[k] += rgb[g][k] / groups;
	}
	for (int k = 0; k < 3; k++) {
		double b = (double)m->img->rgb[pixel * 3 + (size_t)k], weight = 1 / (b * b + floor_square), square = 0;
		for (uint32_t g = 0; g < groups; g++) {
			double d = (rgb[g][k] - mean[k]) * (rgb[g][k] - mean[k]);
			square += d;
			m->distance[g] += d * weight;
		}
		m->img->error[pixel * 3 + (size_t)k] = (float)sqrt(square / groups / (groups - 1));
	}
}

static void error_tile(struct making *m, uint32_t tx, uint32_t ty, double floor_square)
{
	const struct plan *p = &m->c->plan;
	size_t tile = (size_t)ty * m->c->tiles_across + tx;
	for (uint32_t y = ty * TILE_SIZE; y < p->crop_height && y < (ty + 1) * TILE_SIZE; y++)
		for (uint32_t x = tx * TILE_SIZE; x < p->crop_width && x < (tx + 1) * TILE_SIZE; x++)
			pixel_error(m, tile, (size_t)(y % TILE_SIZE) * SLOT_ROW + (size_t)(x % TILE_SIZE) * TILE_CHANNELS,
				    (size_t)y * p->crop_width + x, floor_square);
}

/*
 * The estimate: mean over pixels and channels of the squared standard error over B^2 + (0.01 m)^2, with B the pooled image
 * itself. (B's own noise makes the weight a little too small where B is too bright and too large where it is too dark;
 * the floor bounds this. It is no concern while errors are small, which is when the target is met.)
 *
 * It equals the mean over groups of distance[g], over groups - 1. Its degrees of freedom are those of the chi-square with
 * the spread that the distances show among the groups (Satterthwaite 1946): groups - 1 when all pixels err together, as by an
 * error of b; many more when they err apart. (groups + 2) / groups undoes the bias that dividing by the mean distance has
 * in the first case. Two groups have one distance between them, so one degree of freedom is taken.
 */
static void find_rel_mse(struct making *m)
{
	double groups = m->c->plan.groups, mean = 0, square = 0;
	for (uint32_t g = 0; g < m->c->plan.groups; g++)
		mean += m->distance[g] / groups;
	m->img->rel_mse = m->img->rel_mse_upper = mean / (groups - 1);
	if (!(mean > 0))
		return;
	for (uint32_t g = 0; g < m->c->plan.groups; g++)
		square += (m->distance[g] / mean - 1) * (m->distance[g] / mean - 1);
	double spread = square / (groups - 1) * (groups + 2) / groups;
	double own = groups > 2 && spread < 2 ? spread > 2e-6 ? 2 / spread : 1e6 : 1, degrees = own * (groups - 1);
	m->img->rel_mse_degrees = degrees;
	m->img->rel_mse_upper *= degrees / (m->c->plan.groups == 2 ? 0.00393214 : chi_square_5(degrees));
	m->img->rel_mse_95[0] = m->img->rel_mse * f_quantile(0.025, own, degrees);
	m->img->rel_mse_95[1] = m->img->rel_mse * f_quantile(0.975, own, degrees);
}

void canvas_error(struct making *m)
{
	size_t values = (size_t)m->img->width * m->img->height * 3;
	double mean = 0;
	for (size_t i = 0; i < values; i++)
		mean += (double)m->img->rgb[i];
	mean /= (double)values;
	for (uint32_t ty = 0; ty < m->c->tiles_down; ty++)
		for (uint32_t tx = 0; tx < m->c->tiles_across; tx++)
			error_tile(m, tx, ty, 1e-4 * mean * mean);
	for (uint32_t g = 0; g < m->c->plan.groups; g++)
		m->distance[g] /= (double)values;
	if (mean != 0) /* a black image has no relative error */
		find_rel_mse(m);
}
