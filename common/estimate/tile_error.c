/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Standard errors of pixels. tile_error_load computes the spread between groups for each pixel of a tile. Where a
 * pixel's brightness is not reliable, this spread is usually too small, because rare light has not arrived yet: then
 * tile_error_write also uses the spread of the neighbours, and the rare light that they received (find_rare). Pixels
 * that no chain visited get the errors of their neighbourhood. All loops run in a fixed order over exact inputs, so
 * equal films give equal bits. Nothing fails.
 */
#include "common/estimate/tile_error.h"

#include "common/base/color.h"

#include <math.h>
#include <string.h>

/* A pixel's rare light is estimated from squares of up to RARE_SIDE_MAX pixels a side, and only from pixels that are
 * brighter by at most RARE_POWERS_MAX powers of two. */
enum { RARE_SIDE_MAX = 16, RARE_POWERS_MAX = 3 };

/* Computes a pixel's deviations, variance and kurtosis from the sums at offset `offset` of the groups' slots. The inner
 * loops run over groups, so that the compiler vectorises them. */
static void compute_pixel_error(struct image_builder *m, struct tile_error *t, const int64_t *const *slot,
				size_t offset, size_t pixel)
{
	uint32_t groups = t->groups;
	double rgb[3][PLAN_GROUPS_MAX];
	for (uint32_t g = 0; g < groups; g++) {
		const int64_t *s = slot[g] + offset;
		double xyz[3] = {(double)s[0] * m->factor[g], (double)s[1] * m->factor[g], (double)s[2] * m->factor[g]},
		       out[3];
		rec709_from_xyz(xyz, out);
		for (int k = 0; k < 3; k++)
			rgb[k][g] = out[k];
	}
	float *deviations = tile_error_deviations(t, pixel);
	for (size_t k = 0; k < 3; k++) {
		double mean = 0, square = 0;
		for (uint32_t g = 0; g < groups; g++)
			mean += rgb[k][g];
		mean /= groups;
		for (uint32_t g = 0; g < groups; g++) {
			rgb[k][g] -= mean;
			deviations[k * groups + g] = (float)rgb[k][g];
		}
		double fourth = 0;
		for (uint32_t g = 0; g < groups; g++) {
			double q = rgb[k][g] * rgb[k][g];
			square += q;
			fourth += q * q;
		}
		t->variance[pixel][k] = square / groups / (groups - 1);
		t->kurtosis[pixel][k] = square > 0 ? fourth / (square * square) * groups : 0;
	}
}

/* Computes the trimmed mean: an eighth of the groups is dropped, one after the other, each time the one farthest from
 * the mean of the rest. */
static void find_base(struct tile_error *t, size_t pixel, size_t k, double floor)
{
	double d[PLAN_GROUPS_MAX], mean = 0, square = 0;
	const float *deviations = tile_error_deviations(t, pixel) + k * t->groups;
	uint32_t n = t->groups, drop = t->groups / 8;
	for (uint32_t g = 0; g < n; g++)
		d[g] = (double)deviations[g];
	for (; drop > 0; drop--) {
		uint32_t farthest = 0;
		for (uint32_t g = 1; g < n; g++)
			farthest = fabs(d[g] - mean) > fabs(d[farthest] - mean) ? g : farthest;
		mean = (mean * n - d[farthest]) / (n - 1);
		d[farthest] = d[--n];
	}
	for (uint32_t g = 0; g < n; g++)
		square += (d[g] - mean) * (d[g] - mean);
	t->base[pixel][k] = t->brightness[pixel][k] + mean;
	t->base_variance[pixel][k] = square / n / (n - 1);
	double ratio = t->base[pixel][k] / floor;
	int power = ratio >= 1 ? ilogb(ratio) : 0;
	t->base_power[pixel][k] = (uint8_t)(power < BASE_POWERS ? power : BASE_POWERS - 1);
}

void tile_error_find_bases(struct tile_error *t)
{
	double floor = sqrt(t->floor_square);
	for (size_t pixel = 0; pixel < (size_t)t->width * t->height; pixel++)
		for (size_t k = 0; k < 3; k++)
			find_base(t, pixel, k, floor);
}

static bool is_dark(const struct tile_error *t, size_t pixel)
{
	return t->variance[pixel][0] + t->variance[pixel][1] + t->variance[pixel][2] == 0;
}

void tile_error_load(struct image_builder *m, struct tile_error *t)
{
	bool chains = m->c->plan.kind == PLAN_CHAINS;
	t->is_lit = false;
	memset(t->mean_variance, 0, sizeof t->mean_variance);
	static const int64_t zeros[SLOT_VALUES];
	const int64_t *slot[PLAN_GROUPS_MAX];
	size_t tile = (size_t)(t->y / TILE_SIZE) * m->c->tiles_across + t->x / TILE_SIZE;
	for (uint32_t g = 0; g < t->groups; g++) {
		size_t film = canvas_film_index(g, FILM_PREFIX);
		slot[g] = *canvas_tile_flags(m->c, film, tile) & TILE_USED ? canvas_slot(m->c, film, tile) : zeros;
	}
	for (uint32_t y = 0; y < t->height; y++)
		for (uint32_t x = 0; x < t->width; x++) {
			size_t pixel = (size_t)y * t->width + x,
			       out = ((size_t)(t->y + y) * m->img->width + t->x + x) * 3;
			compute_pixel_error(m, t, slot, (size_t)y * SLOT_ROW_VALUES + (size_t)x * TILE_CHANNELS, pixel);
			for (size_t k = 0; k < 3; k++) {
				t->brightness[pixel][k] = (double)m->img->rgb[out + k];
				t->mean_variance[k] += t->variance[pixel][k] / t->width / t->height;
			}
			bool dark = is_dark(t, pixel);
			m->img->unvisited_count += chains && dark;
			t->is_lit |= chains && !dark;
		}
}

/* Returns the mean variance of the 3 x 3 pixels around one, within the tile. */
static double variance_around(const struct tile_error *t, uint32_t x, uint32_t y, size_t k)
{
	double sum = 0, n = 0;
	for (uint32_t j = y > 0 ? y - 1 : 0; j < t->height && j <= y + 1; j++)
		for (uint32_t i = x > 0 ? x - 1 : 0; i < t->width && i <= x + 1; i++, n++)
			sum += t->variance[(size_t)j * t->width + i][k];
	return sum / n;
}

/*
 * Raises `rare`, for the pixels of a square, to the square of the rare light per pixel found in it: the mean of
 * brightness minus base, which is light that only few groups found.
 *
 * Pixels that rare light has not reached look certain: their groups agree, on a value that is too small by this mean on
 * average. Pixels that it has reached have a larger error of their own anyway, and where light is frequent, brightness
 * and base differ in either direction and the mean is near zero. For each pixel, the mean is only over pixels whose
 * base is at most about ten times as bright (8 to 16 times: RARE_POWERS_MAX powers of two), since rare light in a
 * highlight says nothing about the dark wall beside it.
 */
static void raise_rare_square(const struct tile_error *t, size_t k, uint32_t x, uint32_t y, uint32_t size, double *rare)
{
	uint32_t right = x + size < t->width ? x + size : t->width,
		 bottom = y + size < t->height ? y + size : t->height;
	double excess[BASE_POWERS] = {0}, count[BASE_POWERS] = {0};
	for (uint32_t j = y; j < bottom; j++)
		for (uint32_t i = x; i < right; i++) {
			size_t pixel = (size_t)j * t->width + i;
			unsigned b = t->base_power[pixel][k];
			excess[b] += t->brightness[pixel][k] - t->base[pixel][k];
			count[b]++;
		}
	for (int b = 1; b < BASE_POWERS; b++) {
		excess[b] += excess[b - 1];
		count[b] += count[b - 1];
	}
	for (uint32_t j = y; j < bottom; j++)
		for (uint32_t i = x; i < right; i++) {
			size_t pixel = (size_t)j * t->width + i;
			unsigned max_power = t->base_power[pixel][k] + RARE_POWERS_MAX;
			max_power = max_power < BASE_POWERS ? max_power : BASE_POWERS - 1;
			double missing = excess[max_power] / count[max_power];
			rare[pixel] = fmax(rare[pixel], missing * missing);
		}
}

/* Sets `rare` of each pixel to the largest value over the squares of 2, 4, ... RARE_SIDE_MAX pixels a side that contain
 * it. */
static void find_rare(const struct tile_error *t, double rare[3][TILE_SIZE * TILE_SIZE])
{
	for (size_t k = 0; k < 3; k++)
		for (uint32_t size = 2; size <= RARE_SIDE_MAX; size *= 2)
			for (uint32_t y = 0; y < t->height; y += size)
				for (uint32_t x = 0; x < t->width; x += size)
					raise_rare_square(t, k, x, y, size, rare[k]);
}

/*
 * If the brightness of a pixel is not reliable, its variance between few groups is usually too small, because rare
 * light has not arrived yet. Such a variance is averaged with those of its neighbours, and is at least that of the rare
 * light around the pixel. A pixel that no chain visited would claim a variance of 0; it gets the variance of its
 * neighbours, of its tile, or (tile_error_fill_unvisited) of the image.
 */
void tile_error_write(struct image_builder *m, const struct tile_error *t, bool have_bases)
{
	double rare[3][TILE_SIZE * TILE_SIZE];
	memset(rare, 0, sizeof rare);
	if (have_bases)
		find_rare(t, rare);
	for (uint32_t y = 0; y < t->height; y++)
		for (uint32_t x = 0; x < t->width; x++)
			for (size_t k = 0; k < 3; k++) {
				size_t pixel = (size_t)y * t->width + x;
				double own = t->variance[pixel][k], variance = own;
				if (!t->is_settled[pixel][k] || own == 0)
					variance = (own + variance_around(t, x, y, k)) / 2;
				if (variance == 0 && t->is_lit)
					variance = t->mean_variance[k];
				variance = fmax(variance, rare[k][pixel]);
				m->img->error[((size_t)(t->y + y) * m->img->width + t->x + x) * 3 + k] =
					(float)sqrt(variance);
			}
}

void tile_error_fill_unvisited(struct canvas_image *img)
{
	size_t values = (size_t)img->width * img->height * 3;
	double mean[3] = {0};
	for (size_t i = 0; i < values; i++)
		mean[i % 3] += (double)img->error[i] * (double)img->error[i] * 3 / (double)values;
	for (size_t i = 0; i < values; i += 3) {
		if (img->error[i] + img->error[i + 1] + img->error[i + 2] > 0)
			continue;
		for (size_t k = 0; k < 3; k++)
			img->error[i + k] = (float)sqrt(mean[k]);
	}
}
