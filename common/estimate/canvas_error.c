/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The relative error of an image from the spread between groups.
 *
 * The relMSE is a sum over pixels of squared standard errors times the weights 1 / (B^2 + (0.01 m)^2), m the mean of B.
 * The true brightness B is not known, and noise in an estimate of B would bias the weights, so the estimate must be as
 * little noisy as possible. For each tile (compute_tile_error), the standard errors are computed (tile_error.c) and
 * each pixel is settled, that is, its brightness is chosen and its weighted errors are added to the sums:
 * - a pixel whose neighbourhood is reliable keeps its own brightness (settle_pixel);
 * - a channel in which colours cancel is weighted over all brightnesses that it may have (settle_cancelling);
 * - other pixels wait; the smallest square of 2, 4, ... 64 pixels a side whose mean brightness is reliable gives them
 *   its own (settle_square, settle_block).
 * canvas_interval.c turns the sums into the relMSE and its interval.
 *
 * All loops run in a fixed order over exact inputs, so equal films give equal bits. The only failure is -ENOMEM.
 */
#include "common/estimate/canvas_error.h"

#include "common/base/mem.h"
#include "common/estimate/cancelling.h"
#include "common/estimate/tile_error.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { FOLDED_GROUPS = ERROR_GROUPS_FOLDED, VALUES_MAX = 3 * PLAN_GROUPS_MAX };

/* Limits for 16 groups, with which they were calibrated; set_limits derives those for other numbers.
 * one_group_kurtosis_16: kurtosis of the groups' values above which one group has most of a pixel's variance (a single
 * outlier would give 14). highlight_errors_16: a pixel brighter than its surroundings by this many of its standard
 * errors received its light in at least three groups. */
static const double one_group_kurtosis_16 = 9.6, highlight_errors_16 = 1.5;

/* The tail index of errors is the smaller of two estimates, from the largest 1 / TAIL_DIVISOR of the errors and from
 * the largest 1 / (TAIL_DIVISOR * EXTREME_DIVISOR), but from at least 32 and 8 errors;
 * worker/render/choose_integrator.h uses the same shares for samples. With fewer than ERRORS_MIN errors in all, these
 * would not be the tail but the bulk, and no index is estimated. */
enum { TAIL_DIVISOR = 128, TAIL_SIZE_MIN = 32, TAIL_SIZE_MAX = 1 << 16, EXTREME_DIVISOR = 4, ERRORS_MIN = 2048 };

/* ---- weights: 1 / (B^2 + floor), with an estimate of B that is as little noisy as possible */

/* A square of pixels: sums over all its pixels and over the waiting ones (waiting_...), whose brightness is not settled
 * yet. */
struct pixel_block {
	uint32_t pixel_count, waiting_count[3];	 /* numbers of pixels; waiting ones by channel */
	double sum[3], waiting_sum[3];		 /* sums of the brightness */
	double rare_sum[3], waiting_rare_sum[3]; /* sums of the brightness minus the base (tile_error.h) */
	/* sums of the groups' deviations, [3][groups] */
	double deviation_sum[VALUES_MAX], waiting_deviation_sum[VALUES_MAX];
};

/* Returns the squared denominator of errors, B^2 + floor^2 plus a correction for the noise of B: on average, noise
 * makes 1 / B^2 too large by 3 variance / B^4, so three variances are added to the denominator if errors and B are
 * independent. Where light comes in rare hits, errors are largest where B is too bright, which outweighs two of them,
 * and one is added. variance_weight: 3 or 1. */
static double divisor_square(const struct tile_error *t, double brightness, double variance, double variance_weight)
{
	return brightness * brightness + t->floor_square + variance_weight * variance;
}

/* Adds a part of the relMSE whose pixels have one brightness in common, and its uncertainty. variance: of the
 * brightness. */
static void add_error_part(struct tile_error *t, double part, double brightness, double variance, double divisor)
{
	double slope = 2 * brightness * part / divisor;
	t->sum.total += part;
	t->sum.brightness_variance += slope * slope * variance;
}

/* Returns the pixel's part of the relMSE, with each group's deviation divided by the brightness found by the other
 * groups, so that no sample is divided by a brightness to which it contributed. This is an upper bound, since light
 * that only one group met is missing in that group's divisor. */
static double error_by_other_groups(const struct tile_error *t, size_t pixel, size_t k)
{
	const float *deviations = tile_error_deviations(t, pixel) + k * t->groups;
	double n = t->groups, sum = 0, all = t->variance[pixel][k] * n * (n - 1);
	for (uint32_t g = 0; g < t->groups; g++) {
		double d = (double)deviations[g], others = t->brightness[pixel][k] - d / (n - 1);
		double variance = n > 2 ? fmax(0, all - d * d * n / (n - 1)) / (n - 1) / (n - 2) : all;
		sum += d * d / divisor_square(t, others, variance, 3);
	}
	return sum / n / (n - 1);
}

/* Adds a pixel's part of the relMSE to the sums of lower and upper bounds and of doubtful parts. high: the upper bound.
 * The lower bound divides by the pixel's own brightness, which includes all its fireflies. */
static void add_bounds(struct tile_error *t, size_t pixel, size_t k, double part, double high)
{
	double variance = t->variance[pixel][k];
	t->sum.lower_bound += variance / divisor_square(t, t->brightness[pixel][k], variance, 1);
	t->sum.upper_bound += high;
	t->sum.kurtosis_total += part * t->kurtosis[pixel][k];
	if (t->kurtosis[pixel][k] > t->one_group_kurtosis)
		t->sum.one_group_total += part;
}

/* Settles a pixel by its own brightness. If that is reliable (is_reliable), each group's errors are divided by the
 * brightness that the other groups found, to second order: this removes the correlation between errors and brightness,
 * however rare the light is. */
static void settle_pixel(struct tile_error *t, size_t pixel, size_t k, bool is_reliable)
{
	double brightness = t->brightness[pixel][k], variance = t->variance[pixel][k];
	double divisor = divisor_square(t, brightness, variance, is_reliable ? 3 : 1);
	float root = (float)(1 / sqrt(divisor)),
	      slope = is_reliable ? (float)(brightness / divisor / (t->groups - 1)) : 0;
	float *deviations = tile_error_deviations(t, pixel) + k * t->groups;
	add_bounds(t, pixel, k, variance / divisor,
		   is_reliable ? error_by_other_groups(t, pixel, k) : variance / divisor);
	for (uint32_t g = 0; g < t->groups; g++) {
		float x = slope * deviations[g];
		deviations[g] *= root * (1 + x + x * x);
	}
	add_error_part(t, variance / divisor, brightness, variance, divisor);
}

/* Settles a channel in which colours cancel: its error is weighted over all brightnesses that it may have. */
static void settle_cancelling(struct tile_error *t, size_t pixel, size_t k)
{
	double variance = t->variance[pixel][k];
	struct inverse_square weight = cancelling_weight(t, pixel, k);
	double part = variance * weight.mean;
	float *deviations = tile_error_deviations(t, pixel) + k * t->groups, root = (float)sqrt(weight.mean);
	add_bounds(t, pixel, k, part, part);
	for (uint32_t g = 0; g < t->groups; g++)
		deviations[g] *= root;
	t->sum.total += part;
	t->sum.brightness_variance += variance * variance * weight.variance;
}

/* Settles those pixels that keep their own brightness. */
static void settle_pixels(struct tile_error *t, size_t first, size_t count)
{
	for (size_t pixel = first; pixel < first + count; pixel++)
		for (size_t k = 0; k < 3; k++)
			if (t->is_cancelling[pixel][k])
				settle_cancelling(t, pixel, k);
			else if (t->is_settled[pixel][k])
				settle_pixel(t, pixel, k, true);
}

/* Returns the mean, over the 2 x 2 pixels to which this one belongs, of the squared relative standard error, each
 * limited to 1. */
static double neighbourhood_noise(const struct tile_error *t, uint32_t x, uint32_t y, size_t k)
{
	double sum = 0, n = 0;
	for (uint32_t j = y & ~1u; j < t->height && j <= (y | 1); j++)
		for (uint32_t i = x & ~1u; i < t->width && i <= (x | 1); i++, n++) {
			size_t p = (size_t)j * t->width + i;
			double below = t->brightness[p][k] * t->brightness[p][k] + t->floor_square;
			sum += t->variance[p][k] < below ? t->variance[p][k] / below : 1;
		}
	return sum / n;
}

/* Decides which pixels keep their own brightness, and returns how many values (pixels times channels) wait. A pixel
 * keeps its brightness if its neighbourhood is reliable: judging each pixel alone would keep those that came out too
 * bright and average those that came out too dark. A pixel that is certain by itself keeps its brightness whatever its
 * neighbours are. */
static uint32_t find_settled(struct tile_error *t)
{
	uint32_t waiting = 0;
	for (uint32_t y = 0; y < t->height; y++)
		for (uint32_t x = 0; x < t->width; x++)
			for (size_t k = 0; k < 3; k++) {
				size_t p = (size_t)y * t->width + x;
				bool certain = brightness_is_reliable(t, t->brightness[p][k], 8 * t->variance[p][k]);
				t->is_settled[p][k] =
					certain || neighbourhood_noise(t, x, y, k) <= RELIABLE_VARIANCE_MAX;
				t->is_cancelling[p][k] = !certain && channel_is_cancelling(t, p, k);
				t->is_settled[p][k] |= t->is_cancelling[p][k];
				waiting += !t->is_settled[p][k];
			}
	return waiting;
}

/* Returns the variance of a block's mean brightness, from the sums of the groups' deviations over its pixels. */
static double block_variance(const double *deviations, uint32_t groups, double pixels)
{
	double square = 0;
	for (uint32_t g = 0; g < groups; g++)
		square += deviations[g] * deviations[g];
	return square / (pixels * pixels) / groups / (groups - 1);
}

/* If all groups but a few agree about a pixel, settles it by the brightness that they agree on, plus the block's mean
 * excess of the few, `rare` per pixel with the variance `variance`. In this way a wall beside a lamp stays dark.
 * Returns false if that brightness is not reliable either. */
static bool settle_by_base(struct tile_error *t, size_t pixel, size_t k, double rare, double variance)
{
	double base = t->base[pixel][k] + rare, base_variance = t->base_variance[pixel][k] + variance;
	if (t->groups < BASE_GROUPS_MIN || !brightness_is_reliable(t, base, base_variance))
		return false;
	double divisor = divisor_square(t, base, base_variance, 1), part = t->variance[pixel][k] / divisor;
	float *deviations = tile_error_deviations(t, pixel) + k * t->groups, root = (float)(1 / sqrt(divisor));
	add_bounds(t, pixel, k, part, error_by_other_groups(t, pixel, k));
	for (uint32_t g = 0; g < t->groups; g++)
		deviations[g] *= root;
	add_error_part(t, part, base, base_variance, divisor);
	return true;
}

/*
 * Returns an upper bound, by Cantelli's inequality, on the share of a block's waiting pixels that may be entirely dark:
 * v / (v + B^2), where B is the block's brightness and v the variance of the pixels' brightness around it, without the
 * variance of their noise. The bound is nearly 0 where pixels are alike, however rarely light comes, and large at the
 * edge of something bright before a black background, where a few pixels have a hundredth of the brightness of the
 * others.
 */
static double dark_share_bound(const struct tile_error *t, size_t k, uint32_t x, uint32_t y, uint32_t size,
			       double brightness)
{
	double spread = 0, n = 0;
	for (uint32_t j = y; j < y + size && j < t->height; j++)
		for (uint32_t i = x; i < x + size && i < t->width; i++) {
			size_t pixel = (size_t)j * t->width + i;
			double d = t->brightness[pixel][k] - brightness;
			if (t->is_settled[pixel][k])
				continue;
			spread += d * d - t->variance[pixel][k];
			n++;
		}
	return spread > 0 ? spread / (spread + n * (brightness * brightness + t->floor_square)) : 0;
}

/* Adds the error of a pixel that is settled by a block's brightness. Its upper bound allows for the share of pixels
 * that are darker than the block; since canvas_compute_interval adds `dark_total` to the upper bound once more, that
 * part is subtracted here. */
static void add_dark(struct tile_error *t, size_t pixel, size_t k, double part, double dark_share)
{
	double darker = dark_share * error_by_other_groups(t, pixel, k);
	add_bounds(t, pixel, k, part, fmax(part, darker - part));
	t->sum.dark_total += part;
}

/*
 * Settles the waiting pixels of a block by the block's brightness, unless that is not reliable and a larger block
 * remains to be tried. The brightness is the mean over all pixels, with and without fireflies; only over the waiting
 * ones if the mean of all is more than twice as bright, such as for a wall beside a lamp. A pixel that is brighter than
 * the block by highlight_errors of its own standard errors keeps its own brightness: it received its light in three
 * groups or more, so it is a highlight and not a firefly (whose brightness is one standard error).
 */
static void settle_block(struct tile_error *t, struct pixel_block *b, size_t k, uint32_t x, uint32_t y, uint32_t size)
{
	double n = b->pixel_count, waiting = b->waiting_count[k], part = 0;
	bool only_waiting = b->sum[k] / n > 2 * b->waiting_sum[k] / waiting;
	n = only_waiting ? waiting : n;
	double rare = (only_waiting ? b->waiting_rare_sum[k] : b->rare_sum[k]) / n;
	double brightness = (only_waiting ? b->waiting_sum[k] : b->sum[k]) / n;
	const double *deviations = (only_waiting ? b->waiting_deviation_sum : b->deviation_sum) + k * t->groups;
	double variance = block_variance(deviations, t->groups, n);
	if (!brightness_is_reliable(t, brightness, variance) && size < TILE_SIZE)
		return;
	double divisor = divisor_square(t, brightness, variance, 1);
	double dark = dark_share_bound(t, k, x, y, size, brightness);
	float root = (float)(1 / sqrt(divisor));
	for (uint32_t j = y; j < y + size && j < t->height; j++)
		for (uint32_t i = x; i < x + size && i < t->width; i++) {
			size_t pixel = (size_t)j * t->width + i;
			if (t->is_settled[pixel][k])
				continue;
			t->is_settled[pixel][k] = true;
			if (t->brightness[pixel][k] - brightness > t->highlight_errors * sqrt(t->variance[pixel][k])) {
				settle_pixel(t, pixel, k, false);
				continue;
			}
			float *pixel_deviations = tile_error_deviations(t, pixel) + k * t->groups;
			if (settle_by_base(t, pixel, k, rare, variance))
				continue;
			double pixel_part = t->variance[pixel][k] / divisor;
			add_dark(t, pixel, k, pixel_part, dark);
			for (uint32_t g = 0; g < t->groups; g++)
				pixel_deviations[g] *= root;
			part += t->variance[pixel][k];
		}
	add_error_part(t, part / divisor, brightness, variance, divisor);
	b->waiting_count[k] = 0;
	b->waiting_sum[k] = b->waiting_rare_sum[k] = 0;
	memset(b->waiting_deviation_sum + k * t->groups, 0, t->groups * sizeof *b->waiting_deviation_sum);
}

static void add_pixel(struct tile_error *t, struct pixel_block *b, size_t pixel)
{
	const float *deviations = tile_error_deviations(t, pixel);
	size_t groups = t->groups;
	b->pixel_count++;
	for (size_t i = 0; i < 3 * groups; i++)
		b->deviation_sum[i] += (double)deviations[i];
	for (size_t k = 0; k < 3; k++) {
		double rare = t->brightness[pixel][k] - t->base[pixel][k];
		b->rare_sum[k] += rare;
		b->sum[k] += t->brightness[pixel][k];
		if (t->is_settled[pixel][k])
			continue;
		b->waiting_rare_sum[k] += rare;
		b->waiting_count[k]++;
		b->waiting_sum[k] += t->brightness[pixel][k];
		for (size_t i = k * groups; i < (k + 1) * groups; i++)
			b->waiting_deviation_sum[i] += (double)deviations[i];
	}
}

static void add_block(struct pixel_block *b, const struct pixel_block *part, uint32_t groups)
{
	b->pixel_count += part->pixel_count;
	for (int k = 0; k < 3; k++) {
		b->waiting_count[k] += part->waiting_count[k];
		b->sum[k] += part->sum[k];
		b->rare_sum[k] += part->rare_sum[k];
		b->waiting_rare_sum[k] += part->waiting_rare_sum[k];
		b->waiting_sum[k] += part->waiting_sum[k];
	}
	for (size_t i = 0; i < 3 * (size_t)groups; i++)
		b->deviation_sum[i] += part->deviation_sum[i];
	if (part->waiting_count[0] + part->waiting_count[1] + part->waiting_count[2])
		for (size_t i = 0; i < 3 * (size_t)groups; i++)
			b->waiting_deviation_sum[i] += part->waiting_deviation_sum[i];
}

/* Settles the pixels in the square of `size` pixels a side at (x, y) of the tile, as far as it is reliable, after its
 * quarters. Returns its sums in *b. The recursion is at most six levels deep. */
static void settle_square(struct tile_error *t, uint32_t x, uint32_t y, uint32_t size, struct pixel_block *b)
{
	*b = (struct pixel_block){0};
	for (uint32_t i = 0; i < 4; i++) {
		uint32_t half = size / 2, px = x + i % 2 * half, py = y + i / 2 * half;
		struct pixel_block part;
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
		if (b->waiting_count[k])
			settle_block(t, b, k, x, y, size);
}

/* ---- sums over the image */

/* Adds the values of up to FOLDED_GROUPS groups, from `first` on, to the folded values; with more than FOLDED_GROUPS
 * groups also their squares to the groups' distances. deviations: the values, beginning with group `first`. */
static void fold_groups(struct tile_error *t, uint32_t first, const float *deviations, float *folded)
{
	uint32_t count = t->groups - first < FOLDED_GROUPS ? t->groups - first : FOLDED_GROUPS;
	float v[FOLDED_GROUPS] = {0};
	for (uint32_t g = 0; g < count; g++)
		v[g] = deviations[g];
	for (uint32_t g = 0; g < FOLDED_GROUPS; g++)
		folded[g] += v[g];
	for (uint32_t g = 0; g < FOLDED_GROUPS && t->groups > FOLDED_GROUPS; g++)
		t->sum.distance[first + g] += (double)v[g] * (double)v[g];
}

/* Adds each group's error of a pixel, summed over the channels. */
static void add_to_tail(struct tile_error *t, const float *deviations)
{
	for (size_t g = 0; g < t->groups; g++)
		tail_add(&t->tail, (double)deviations[g] + (double)deviations[t->groups + g] +
					   (double)deviations[2 * t->groups + g]);
}

static size_t tail_size(size_t errors)
{
	size_t size = errors / TAIL_DIVISOR;
	return size < TAIL_SIZE_MIN ? TAIL_SIZE_MIN : size > TAIL_SIZE_MAX ? TAIL_SIZE_MAX : size;
}

/* Returns the tail index of the errors; INFINITY if there are too few of them. */
static double estimate_tail_index(struct tail *t, size_t errors)
{
	size_t size = tail_size(errors);
	tail_select_largest(t);
	if (errors < ERRORS_MIN || t->count <= size)
		return INFINITY;
	return fmin(tail_index(t, size), tail_index(t, size / EXTREME_DIVISOR));
}

/* Adds the products of the groups' weighted errors over a row of pixels. More than FOLDED_GROUPS groups are folded onto
 * FOLDED_GROUPS: groups are identically distributed, and so are sums of equally many. Vectorisation runs over pairs of
 * groups, so each sum is in the order of pixels on any machine. */
static void add_row_products(struct tile_error *t, size_t first)
{
	float gram[FOLDED_GROUPS][FOLDED_GROUPS] = {{0}};
	for (size_t pixel = first; pixel < first + t->width; pixel++) {
		const float *deviations = tile_error_deviations(t, pixel);
		float folded[3][FOLDED_GROUPS] = {{0}};
		add_to_tail(t, deviations);
		for (size_t k = 0; k < 3; k++) {
			for (uint32_t g = 0; g < t->groups; g += FOLDED_GROUPS)
				fold_groups(t, g, deviations + k * t->groups + g, folded[k]);
		}
		for (size_t i = 0; i < FOLDED_GROUPS; i++)
			for (size_t j = i / 4 * 4; j < FOLDED_GROUPS; j++)
				gram[i][j] += folded[0][i] * folded[0][j] + folded[1][i] * folded[1][j] +
					      folded[2][i] * folded[2][j];
	}
	for (size_t i = 0; i < FOLDED_GROUPS; i++)
		for (size_t j = i; j < FOLDED_GROUPS; j++)
			t->sum.gram[i][j] += (double)gram[i][j];
}

static void compute_tile_error(struct image_builder *m, struct tile_error *t, uint32_t x, uint32_t y)
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
		struct pixel_block block;
		settle_square(t, 0, 0, TILE_SIZE, &block);
	} else {
		settle_pixels(t, 0, (size_t)t->width * t->height);
	}
	for (uint32_t row = 0; row < t->height; row++)
		add_row_products(t, (size_t)row * t->width);
}

/* Returns the kurtosis of n values of which all but one are equal, the largest that n values can have. */
static double outlier_kurtosis(double n)
{
	return (n * n - 3 * n + 3) / (n - 1);
}

/* Returns (brightness / standard error)^2 of a pixel that two of n groups hit with equal light and the others not. */
static double two_hits_square(double n)
{
	return 2 * (n - 1) / (n - 2);
}

/* Sets the limits for this number of groups: the same share of the largest possible kurtosis as for 16 groups, and the
 * same factor above two hits. With the limits of 16 groups, two hits in nine groups would count as a highlight, and no
 * kurtosis of four groups would be too large. With fewer than ERROR_GROUPS_MIN groups any spread looks like one
 * group's, so canvas_interval.c judges the tail of the errors instead. */
static void set_limits(struct tile_error *t)
{
	double n = t->groups, two = n > 2 ? two_hits_square(n) : INFINITY;
	t->one_group_kurtosis =
		n < ERROR_GROUPS_MIN ? INFINITY : one_group_kurtosis_16 * (outlier_kurtosis(n) / outlier_kurtosis(16));
	t->highlight_errors = highlight_errors_16 * sqrt(two / two_hits_square(16));
}

static void free_tile(struct tile_error *t)
{
	if (t) {
		tail_fini(&t->tail);
		mem_free(t->deviations);
	}
	mem_free(t);
}

int canvas_estimate_error(struct image_builder *m, struct error *e)
{
	assert(m->c->plan.groups > 1 && !m->includes_open_rounds);
	struct tile_error *t = mem_alloc(1, sizeof *t);
	size_t values = (size_t)m->img->width * m->img->height * 3, errors = values / 3 * m->c->plan.groups;
	if (t)
		t->deviations = mem_alloc((size_t)TILE_SIZE * TILE_SIZE * 3 * m->c->plan.groups, sizeof *t->deviations);
	if (!t || !t->deviations || tail_init(&t->tail, tail_size(errors) + 1)) {
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
	set_limits(t);
	for (uint32_t y = 0; y < m->img->height; y += TILE_SIZE)
		for (uint32_t x = 0; x < m->img->width; x += TILE_SIZE)
			compute_tile_error(m, t, x, y);
	if (m->img->unvisited_count)
		tile_error_fill_unvisited(m->img);
	t->sum.groups = t->groups;
	t->sum.tail_index = estimate_tail_index(&t->tail, errors);
	t->sum.tail_count = tail_size(errors);
	if (mean != 0) /* a black image has no relative error */
		canvas_compute_interval(&t->sum, m->img);
	free_tile(t);
	return 0;
}
