/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The relative error of an image from the spread between groups: weights 1 / (B^2 + (0.01 m)^2), with estimates of
 * the brightness B that are as little noisy as possible; sums of weighted errors, with bounds. tile_error.c makes the
 * standard errors of pixels, canvas_interval.c turns the sums into relMSE and its interval. All loops run in a fixed
 * order over exact inputs, so equal films give equal bits.
 */
#include "common/estimate/canvas_error.h"

#include "common/base/mem.h"
#include "common/estimate/cancelling.h"
#include "common/estimate/tile_error.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { FOLDED = ERROR_FOLDED, VALUES = 3 * PLAN_MAX_GROUPS };

/* Of 16 groups, with which limits were calibrated: above this kurtosis one of them has most of a pixel's variance; a
 * single outlier would have 14. A pixel that is brighter than its surroundings by so many of its standard errors
 * received its light in three groups or more. */
static const double one_group_of_16 = 9.6, highlight_of_16 = 1.5;

/* The tail index of errors is estimated from the largest in 128 and in 512, as that of samples when an integrator is
 * chosen (worker/render/choose.h), but from at least 32 and 8. From fewer than ERRORS_LEAST it would be the index of
 * the bulk. */
enum { TAIL = 128, TAIL_LEAST = 32, TAIL_MOST = 1 << 16, EXTREME = 4, ERRORS_LEAST = 2048 };

/* ---- weights: 1 / (B^2 + floor), with an estimate of B that is as little noisy as possible */

/* A square of pixels: sums over all of them, and over those that have no brightness of their own yet. */
struct block {
	uint32_t pixels, waiting[3];
	double all[3], open[3];			      /* of the mean */
	double rare[3], open_rare[3];		      /* of the mean minus the base */
	double all_apart[VALUES], open_apart[VALUES]; /* [3][groups] */
};

/* The squared denominator of errors. Noise in B makes 1 / B^2 too large by three of its variances; two are
 * subtracted from that where brightness comes in rare hits, because errors are then largest where B is too bright:
 * `variances` is 1, or 3 where they are independent. */
static double divisor_square(const struct tile_error *t, double brightness, double square, double variances)
{
	return brightness * brightness + t->floor_square + variances * square;
}

/* A part of the relMSE whose pixels share one brightness, and the uncertainty of that. */
static void add_share(struct tile_error *t, double part, double brightness, double square, double divisor)
{
	double slope = 2 * brightness * part / divisor;
	t->sum.share += part;
	t->sum.doubt += slope * slope * square;
}

/* The pixel's part of the relMSE with each group's deviation divided by the brightness found by the other groups, so
 * that no sample is divided by the brightness it makes itself. This is an upper bound, since light that only one
 * group met is missing in that group's divisor. */
static double by_others(const struct tile_error *t, size_t pixel, size_t k)
{
	const float *apart = tile_error_apart(t, pixel) + k * t->groups;
	double n = t->groups, sum = 0, all = t->square[pixel][k] * n * (n - 1);
	for (uint32_t g = 0; g < t->groups; g++) {
		double d = (double)apart[g], others = t->brightness[pixel][k] - d / (n - 1);
		double square = n > 2 ? fmax(0, all - d * d * n / (n - 1)) / (n - 1) / (n - 2) : all;
		sum += d * d / divisor_square(t, others, square, 3);
	}
	return sum / n / (n - 1);
}

/* Bounds of a part of the relMSE, and what makes it doubtful. The lower bound divides by the pixel's own brightness,
 * with all its fireflies. */
static void add_bounds(struct tile_error *t, size_t pixel, size_t k, double part, double high)
{
	double square = t->square[pixel][k];
	t->sum.low += square / divisor_square(t, t->brightness[pixel][k], square, 1);
	t->sum.high += high;
	t->sum.kurtosis += part * t->kurtosis[pixel][k];
	if (t->kurtosis[pixel][k] > t->one_group_kurtosis)
		t->sum.one_group += part;
}

/* Divides by the pixel's own brightness. Where it is reliable, each group's errors are divided by the brightness
 * that the other groups found, to second order: this removes the correlation of errors and brightness, however rare
 * the light is. */
static void settle_pixel(struct tile_error *t, size_t pixel, size_t k, bool believed_in)
{
	double brightness = t->brightness[pixel][k], square = t->square[pixel][k];
	double divisor = divisor_square(t, brightness, square, believed_in ? 3 : 1);
	float root = (float)(1 / sqrt(divisor)),
	      slope = believed_in ? (float)(brightness / divisor / (t->groups - 1)) : 0;
	float *apart = tile_error_apart(t, pixel) + k * t->groups;
	add_bounds(t, pixel, k, square / divisor, believed_in ? by_others(t, pixel, k) : square / divisor);
	for (uint32_t g = 0; g < t->groups; g++) {
		float x = slope * apart[g];
		apart[g] *= root * (1 + x + x * x);
	}
	add_share(t, square / divisor, brightness, square, divisor);
}

/* The error is weighted over all brightnesses the pixel may have. */
static void settle_cancelling(struct tile_error *t, size_t pixel, size_t k)
{
	double square = t->square[pixel][k];
	struct inverse_square weight = cancelling_weight(t, pixel, k);
	double part = square * weight.mean;
	float *apart = tile_error_apart(t, pixel) + k * t->groups, root = (float)sqrt(weight.mean);
	add_bounds(t, pixel, k, part, part);
	for (uint32_t g = 0; g < t->groups; g++)
		apart[g] *= root;
	t->sum.share += part;
	t->sum.doubt += square * square * weight.variance;
}

static void settle_pixels(struct tile_error *t, size_t first, size_t count)
{
	for (size_t pixel = first; pixel < first + count; pixel++)
		for (size_t k = 0; k < 3; k++)
			if (t->cancels[pixel][k])
				settle_cancelling(t, pixel, k);
			else if (t->settled[pixel][k])
				settle_pixel(t, pixel, k, true);
}

/* Squared relative standard error of the mean of the 2 x 2 pixels around this one, each limited to 1. */
static double noise_around(const struct tile_error *t, uint32_t x, uint32_t y, size_t k)
{
	double sum = 0, n = 0;
	for (uint32_t j = y & ~1u; j < t->height && j <= (y | 1); j++)
		for (uint32_t i = x & ~1u; i < t->width && i <= (x | 1); i++, n++) {
			size_t p = (size_t)j * t->width + i;
			double below = t->brightness[p][k] * t->brightness[p][k] + t->floor_square;
			sum += t->square[p][k] < below ? t->square[p][k] / below : 1;
		}
	return sum / n;
}

/* A pixel keeps its own brightness if its neighbourhood is reliable. Judging each pixel alone would keep those that
 * came out too bright and average those that came out too dark. A pixel that is certain by itself keeps its
 * brightness whatever its neighbours are. */
static uint32_t find_settled(struct tile_error *t)
{
	uint32_t waiting = 0;
	for (uint32_t y = 0; y < t->height; y++)
		for (uint32_t x = 0; x < t->width; x++)
			for (size_t k = 0; k < 3; k++) {
				size_t p = (size_t)y * t->width + x;
				bool certain = brightness_is_known(t, t->brightness[p][k], 8 * t->square[p][k]);
				t->settled[p][k] = certain || noise_around(t, x, y, k) <= BRIGHTNESS_KNOWN;
				t->cancels[p][k] = !certain && cancelling_channel(t, p, k);
				t->settled[p][k] |= t->cancels[p][k];
				waiting += !t->settled[p][k];
			}
	return waiting;
}

static double spread_square(const double *apart, uint32_t groups, double pixels)
{
	double square = 0;
	for (uint32_t g = 0; g < groups; g++)
		square += apart[g] * apart[g];
	return square / (pixels * pixels) / groups / (groups - 1);
}

/* If all groups but a few agree about a pixel, their brightness is used and the excess of the few is spread over the
 * block: `rare` per pixel, with the variance `square`. So a wall beside a lamp stays dark. */
static bool settle_by_base(struct tile_error *t, size_t pixel, size_t k, double rare, double square)
{
	double base = t->base[pixel][k] + rare, doubt = t->base_square[pixel][k] + square;
	if (t->groups < BASE_GROUPS || !brightness_is_known(t, base, doubt))
		return false;
	double divisor = divisor_square(t, base, doubt, 1), part = t->square[pixel][k] / divisor;
	float *apart = tile_error_apart(t, pixel) + k * t->groups, root = (float)(1 / sqrt(divisor));
	add_bounds(t, pixel, k, part, by_others(t, pixel, k));
	for (uint32_t g = 0; g < t->groups; g++)
		apart[g] *= root;
	add_share(t, part, base, doubt, divisor);
	return true;
}

/*
 * The largest share of a block's waiting pixels that may be as dark as nothing, by Cantelli's inequality: v / (v + B^2)
 * for a variance v of their brightness around the block's, B, without that of their noise. It is nearly 0 where pixels
 * are alike, however rarely light comes, and large at the edge of something bright before a black background, where a
 * few pixels have a hundredth of the brightness of the others.
 */
static double share_of_dark(const struct tile_error *t, size_t k, uint32_t x, uint32_t y, uint32_t size,
			    double brightness)
{
	double spread = 0, n = 0;
	for (uint32_t j = y; j < y + size && j < t->height; j++)
		for (uint32_t i = x; i < x + size && i < t->width; i++) {
			size_t pixel = (size_t)j * t->width + i;
			double d = t->brightness[pixel][k] - brightness;
			if (t->settled[pixel][k])
				continue;
			spread += d * d - t->square[pixel][k];
			n++;
		}
	return spread > 0 ? spread / (spread + n * (brightness * brightness + t->floor_square)) : 0;
}

/* The error of a pixel that has a block's brightness: the upper bound is that of a pixel which may be darker. The
 * interval counts `dark` once more anyway. */
static void add_dark(struct tile_error *t, size_t pixel, size_t k, double part, double dark_share)
{
	double darker = dark_share * by_others(t, pixel, k);
	add_bounds(t, pixel, k, part, fmax(part, darker - part));
	t->sum.dark += part;
}

/*
 * The block's weight for its waiting pixels. Its brightness is the mean over all its pixels, with and without
 * fireflies. Excluded are pixels that are reliable and more than twice as bright as the waiting ones, such as a lamp
 * beside a wall. A pixel brighter than the block by highlight_errors of its own received its light in three groups or
 * more: that is a highlight, not a firefly (which is one standard error high), and it keeps its own brightness.
 */
static void settle_block(struct tile_error *t, struct block *b, size_t k, uint32_t x, uint32_t y, uint32_t size)
{
	double n = b->pixels, waiting = b->waiting[k], part = 0;
	bool other = b->all[k] / n > 2 * b->open[k] / waiting;
	n = other ? waiting : n;
	double rare = (other ? b->open_rare[k] : b->rare[k]) / n;
	double brightness = (other ? b->open[k] : b->all[k]) / n;
	const double *apart = (other ? b->open_apart : b->all_apart) + k * t->groups;
	double square = spread_square(apart, t->groups, n);
	if (!brightness_is_known(t, brightness, square) && size < TILE_SIZE)
		return;
	double divisor = divisor_square(t, brightness, square, 1);
	double dark = share_of_dark(t, k, x, y, size, brightness);
	float root = (float)(1 / sqrt(divisor));
	for (uint32_t j = y; j < y + size && j < t->height; j++)
		for (uint32_t i = x; i < x + size && i < t->width; i++) {
			size_t pixel = (size_t)j * t->width + i;
			if (t->settled[pixel][k])
				continue;
			t->settled[pixel][k] = true;
			if (t->brightness[pixel][k] - brightness > t->highlight_errors * sqrt(t->square[pixel][k])) {
				settle_pixel(t, pixel, k, false);
				continue;
			}
			float *own = tile_error_apart(t, pixel) + k * t->groups;
			if (settle_by_base(t, pixel, k, rare, square))
				continue;
			double own_part = t->square[pixel][k] / divisor;
			add_dark(t, pixel, k, own_part, dark);
			for (uint32_t g = 0; g < t->groups; g++)
				own[g] *= root;
			part += t->square[pixel][k];
		}
	add_share(t, part / divisor, brightness, square, divisor);
	b->waiting[k] = 0;
	b->open[k] = b->open_rare[k] = 0;
	memset(b->open_apart + k * t->groups, 0, t->groups * sizeof *b->open_apart);
}

static void add_pixel(struct tile_error *t, struct block *b, size_t pixel)
{
	const float *apart = tile_error_apart(t, pixel);
	size_t groups = t->groups;
	b->pixels++;
	for (size_t i = 0; i < 3 * groups; i++)
		b->all_apart[i] += (double)apart[i];
	for (size_t k = 0; k < 3; k++) {
		double rare = t->brightness[pixel][k] - t->base[pixel][k];
		b->rare[k] += rare;
		b->all[k] += t->brightness[pixel][k];
		if (t->settled[pixel][k])
			continue;
		b->open_rare[k] += rare;
		b->waiting[k]++;
		b->open[k] += t->brightness[pixel][k];
		for (size_t i = k * groups; i < (k + 1) * groups; i++)
			b->open_apart[i] += (double)apart[i];
	}
}

static void add_block(struct block *b, const struct block *part, uint32_t groups)
{
	b->pixels += part->pixels;
	for (int k = 0; k < 3; k++) {
		b->waiting[k] += part->waiting[k];
		b->all[k] += part->all[k];
		b->rare[k] += part->rare[k];
		b->open_rare[k] += part->open_rare[k];
		b->open[k] += part->open[k];
	}
	for (size_t i = 0; i < 3 * (size_t)groups; i++)
		b->all_apart[i] += part->all_apart[i];
	if (part->waiting[0] + part->waiting[1] + part->waiting[2])
		for (size_t i = 0; i < 3 * (size_t)groups; i++)
			b->open_apart[i] += part->open_apart[i];
}

/* The square of `size` pixels at (x, y) of the tile, built from its quarters; recursion is at most six levels deep. */
static void settle_square(struct tile_error *t, uint32_t x, uint32_t y, uint32_t size, struct block *b)
{
	*b = (struct block){0};
	for (uint32_t i = 0; i < 4; i++) {
		uint32_t half = size / 2, px = x + i % 2 * half, py = y + i / 2 * half;
		struct block part;
		if (px >= t->width || py >= t->height)
			continue;
		if (half == 1) {
			add_pixel(t, b, (size_t)py * t->width + px);
			settle_pixels(t, (size_t)py * t->width + px, 1);
			continue;
		}
		settle_square(t, px, py, half, &part);
		add_block(b, &part, t->groups);
	}
	for (size_t k = 0; k < 3; k++)
		if (b->waiting[k])
			settle_block(t, b, k, x, y, size);
}

/* ---- sums over the image */

/* FOLDED groups from `first` on, or as many as remain. */
static void fold_groups(struct tile_error *t, uint32_t first, const float *apart, float *folded)
{
	uint32_t count = t->groups - first < FOLDED ? t->groups - first : FOLDED;
	float v[FOLDED] = {0};
	for (uint32_t g = 0; g < count; g++)
		v[g] = apart[g];
	for (uint32_t g = 0; g < FOLDED; g++)
		folded[g] += v[g];
	for (uint32_t g = 0; g < FOLDED && t->groups > FOLDED; g++)
		t->sum.distance[first + g] += (double)v[g] * (double)v[g];
}

static void add_to_tail(struct tile_error *t, const float *apart)
{
	for (size_t g = 0; g < t->groups; g++)
		tail_add(&t->tail, (double)apart[g] + (double)apart[t->groups + g] + (double)apart[2 * t->groups + g]);
}

static size_t tail_size(size_t errors)
{
	size_t size = errors / TAIL;
	return size < TAIL_LEAST ? TAIL_LEAST : size > TAIL_MOST ? TAIL_MOST : size;
}

/* INFINITY: too few errors. */
static double find_tail(struct tail *t, size_t errors)
{
	size_t size = tail_size(errors);
	tail_settle(t);
	if (errors < ERRORS_LEAST || t->held <= size)
		return INFINITY;
	return fmin(tail_index(t, size), tail_index(t, size / EXTREME));
}

/* Products of the groups' weighted errors. More than FOLDED groups are folded onto FOLDED, which is valid because
 * errors that add up are alike. A lane is a pair of groups, so each sum is in the order of pixels. */
static void add_row(struct tile_error *t, size_t first)
{
	float gram[FOLDED][FOLDED] = {{0}};
	for (size_t pixel = first; pixel < first + t->width; pixel++) {
		const float *apart = tile_error_apart(t, pixel);
		float folded[3][FOLDED] = {{0}};
		add_to_tail(t, apart);
		for (size_t k = 0; k < 3; k++) {
			for (uint32_t g = 0; g < t->groups; g += FOLDED)
				fold_groups(t, g, apart + k * t->groups + g, folded[k]);
		}
		for (size_t i = 0; i < FOLDED; i++)
			for (size_t j = i / 4 * 4; j < FOLDED; j++)
				gram[i][j] += folded[0][i] * folded[0][j] + folded[1][i] * folded[1][j] +
					      folded[2][i] * folded[2][j];
	}
	for (size_t i = 0; i < FOLDED; i++)
		for (size_t j = i; j < FOLDED; j++)
			t->sum.gram[i][j] += (double)gram[i][j];
}

static void error_tile(struct image_builder *m, struct tile_error *t, uint32_t x, uint32_t y)
{
	t->x = x;
	t->y = y;
	t->width = m->img->width - x < TILE_SIZE ? m->img->width - x : TILE_SIZE;
	t->height = m->img->height - y < TILE_SIZE ? m->img->height - y : TILE_SIZE;
	tile_error_load(m, t);
	bool all_settled = find_settled(t) == 0;
	cancelling_find_spread(t);
	if (!all_settled)
		tile_error_find_bases(t);
	tile_error_write(m, t, !all_settled);
	if (!all_settled) {
		struct block whole;
		settle_square(t, 0, 0, TILE_SIZE, &whole);
	} else {
		settle_pixels(t, 0, (size_t)t->width * t->height);
	}
	for (uint32_t row = 0; row < t->height; row++)
		add_row(t, (size_t)row * t->width);
}

/* The kurtosis of n values of which all but one are equal: the largest that n values can have. */
static double outlier_kurtosis(double n)
{
	return (n * n - 3 * n + 3) / (n - 1);
}

/* The square of how many of its standard errors a pixel is bright that two of n groups hit alike. */
static double two_hits_square(double n)
{
	return 2 * (n - 1) / (n - 2);
}

/* Other numbers of groups have limits at the same share of the largest kurtosis, and above two hits by the same factor.
 * With the limits of 16, two hits of nine were a highlight, and a kurtosis of four groups was never too large. Of so
 * few groups any spread looks like this: canvas_interval.c asks the tail of the errors instead. */
static void find_limits(struct tile_error *t)
{
	double n = t->groups, two = n > 2 ? two_hits_square(n) : INFINITY;
	t->one_group_kurtosis =
		n < ERROR_GROUPS ? INFINITY : one_group_of_16 * (outlier_kurtosis(n) / outlier_kurtosis(16));
	t->highlight_errors = highlight_of_16 * sqrt(two / two_hits_square(16));
}

static void free_tile(struct tile_error *t)
{
	if (t) {
		tail_fini(&t->tail);
		mem_free(t->apart);
	}
	mem_free(t);
}

int canvas_error(struct image_builder *m, struct error *e)
{
	assert(m->c->plan.groups > 1 && !m->open_rounds);
	struct tile_error *t = mem_alloc(1, sizeof *t);
	size_t values = (size_t)m->img->width * m->img->height * 3, errors = values / 3 * m->c->plan.groups;
	if (t)
		t->apart = mem_alloc((size_t)TILE_SIZE * TILE_SIZE * 3 * m->c->plan.groups, sizeof *t->apart);
	if (!t || !t->apart || tail_init(&t->tail, tail_size(errors) + 1)) {
		free_tile(t);
		return error_set(e, ENOMEM, "no memory for the error of an image of %ux%u", m->img->width,
				 m->img->height);
	}
	double mean = 0;
	for (size_t i = 0; i < values; i++)
		mean += (double)m->img->rgb[i];
	mean /= (double)values;
	t->groups = m->c->plan.groups;
	t->floor_square = 1e-4 * mean * mean;
	find_limits(t);
	for (uint32_t y = 0; y < m->img->height; y += TILE_SIZE)
		for (uint32_t x = 0; x < m->img->width; x += TILE_SIZE)
			error_tile(m, t, x, y);
	if (m->img->unvisited)
		tile_error_fill_unvisited(m->img);
	t->sum.groups = t->groups;
	t->sum.tail = find_tail(&t->tail, errors);
	t->sum.tail_errors = tail_size(errors);
	if (mean != 0) /* a black image has no relative error */
		canvas_interval(&t->sum, m->img);
	free_tile(t);
	return 0;
}
