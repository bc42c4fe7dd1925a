/*
 * The error of an image and the estimate of its relMSE, from the spread between groups. All loops run in a fixed order over
 * exact inputs, so that equal films give equal bits.
 */
#include "common/film/canvas_private.h"
#include "common/film/color.h"
#include "common/film/quantile.h"

#include "common/base/mem.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { FOLDED = 16, VALUES = 3 * PLAN_MAX_GROUPS };

/* Squared relative standard error below which a brightness is believed. */
static const double believed = 0.08;

/* A tile at work. Rows of `apart` hold three channels of `groups` values. */
struct tile_error {
	const struct canvas *c;
	uint32_t groups, x, y, width, height; /* the tile's place and size in the crop */
	double floor_square;
	float *apart;                         /* [height][width][3][groups]: a group's image less the groups' mean */
	double brightness[TILE_SIZE * TILE_SIZE][3], square[TILE_SIZE * TILE_SIZE][3]; /* of the mean: value, variance */
	bool settled[TILE_SIZE * TILE_SIZE][3];
	double share, doubt; /* sums over settled squares: their part of the relMSE; its square times its weight's variance */
	double gram[FOLDED][FOLDED];
	double distance[PLAN_MAX_GROUPS]; /* a group's weighted error, squared, summed over the image */
};

/* ---- standard errors */

static float *apart_at(const struct tile_error *t, size_t pixel)
{
	return t->apart + pixel * 3 * t->groups;
}

/* Loops over groups inside, none of which depends on another's: the compiler makes vectors of them. */
static void pixel_error(struct making *m, struct tile_error *t, const int64_t *const *slot, size_t at, size_t pixel)
{
	uint32_t groups = t->groups;
	double rgb[3][PLAN_MAX_GROUPS];
	for (uint32_t g = 0; g < groups; g++) {
		const int64_t *s = slot[g] + at;
		double xyz[3] = {(double)s[0] * m->factor[g], (double)s[1] * m->factor[g], (double)s[2] * m->factor[g]}, out[3];
		rec709_from_xyz(xyz, out);
		for (int k = 0; k < 3; k++)
			rgb[k][g] = out[k];
	}
	float *apart = apart_at(t, pixel);
	for (size_t k = 0; k < 3; k++) {
		double mean = 0, square = 0;
		for (uint32_t g = 0; g < groups; g++)
			mean += rgb[k][g];
		mean /= groups;
		for (uint32_t g = 0; g < groups; g++) {
			rgb[k][g] -= mean;
			apart[k * groups + g] = (float)rgb[k][g];
		}
		for (uint32_t g = 0; g < groups; g++)
			square += rgb[k][g] * rgb[k][g];
		t->square[pixel][k] = square / groups / (groups - 1);
	}
}

static void tile_errors(struct making *m, struct tile_error *t)
{
	static const int64_t nothing[SLOT];
	const int64_t *slot[PLAN_MAX_GROUPS];
	size_t tile = (size_t)(t->y / TILE_SIZE) * m->c->tiles_across + t->x / TILE_SIZE;
	for (uint32_t g = 0; g < t->groups; g++) {
		size_t film = canvas_film(g, FILM_PREFIX);
		slot[g] = *canvas_flags(m->c, film, tile) & TILE_USED ? canvas_slot(m->c, film, tile) : nothing;
	}
	for (uint32_t y = 0; y < t->height; y++)
		for (uint32_t x = 0; x < t->width; x++) {
			size_t pixel = (size_t)y * t->width + x, out = ((size_t)(t->y + y) * m->img->width + t->x + x) * 3;
			pixel_error(m, t, slot, (size_t)y * SLOT_ROW + (size_t)x * TILE_CHANNELS, pixel);
			for (size_t k = 0; k < 3; k++) {
				t->brightness[pixel][k] = (double)m->img->rgb[out + k];
				m->img->error[out + k] = (float)sqrt(t->square[pixel][k]);
			}
		}
}

/* ---- weights: 1 / (B^2 + floor) with a B that is no noisier than need be */

/* A square of pixels: sums over all of them, and over those that wait for a weight. */
struct block {
	uint32_t pixels, waiting[3];
	double all[3], open[3];                       /* of the mean */
	double all_apart[VALUES], open_apart[VALUES]; /* [3][groups] */
};

/* What the errors are divided by, squared. B's own noise makes 1 / B^2 too large by three of its variances, less two because
 * errors are largest where B came out too bright, if brightness comes in hits: `variances` are 1, or 3 where they are apart. */
static double divisor_square(const struct tile_error *t, double brightness, double square, double variances)
{
	return brightness * brightness + t->floor_square + variances * square;
}

static bool believe(double brightness, double square, double floor_square)
{
	return square <= believed * (brightness * brightness + floor_square);
}

/* A part of the relMSE whose pixels share one brightness, and how sure that is. */
static void add_share(struct tile_error *t, double part, double brightness, double square, double divisor)
{
	double slope = 2 * brightness * part / divisor;
	t->share += part;
	t->doubt += slope * slope * square;
}

/* By the pixel's own brightness. Where it is believed, a group's errors are divided by the brightness that the other groups found,
 * to second order: what errors and brightness have in common is taken out, however clumped they come. */
static void settle_pixel(struct tile_error *t, size_t pixel, size_t k, bool believed_in)
{
	double brightness = t->brightness[pixel][k], square = t->square[pixel][k];
	double divisor = divisor_square(t, brightness, square, believed_in ? 3 : 1);
	float root = (float)(1 / sqrt(divisor)), slope = believed_in ? (float)(brightness / divisor / (t->groups - 1)) : 0;
	float *apart = apart_at(t, pixel) + k * t->groups;
	for (uint32_t g = 0; g < t->groups; g++) {
		float x = slope * apart[g];
		apart[g] *= root * (1 + x + x * x);
	}
	add_share(t, square / divisor, brightness, square, divisor);
}

static void settle_pixels(struct tile_error *t, size_t first, size_t count)
{
	for (size_t pixel = first; pixel < first + count; pixel++)
		for (size_t k = 0; k < 3; k++)
			if (t->settled[pixel][k])
				settle_pixel(t, pixel, k, true);
}

/* Squared relative standard error of the mean pixel of the 2 x 2 that this one lies in, each no more than 1. */
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

/* A pixel keeps its own brightness where its neighbourhood is believed: by itself alone, those that came out bright would keep it
 * and those that came out dark would not. Or where it is out of doubt, whatever is beside it. */
static uint32_t find_settled(struct tile_error *t)
{
	uint32_t waiting = 0;
	for (uint32_t y = 0; y < t->height; y++)
		for (uint32_t x = 0; x < t->width; x++)
			for (size_t k = 0; k < 3; k++) {
				size_t p = (size_t)y * t->width + x;
				t->settled[p][k] = believe(t->brightness[p][k], 8 * t->square[p][k], t->floor_square) ||
						   noise_around(t, x, y, k) <= believed;
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

/*
 * The block's weight for what waits in it. Its brightness is the mean of all its pixels: those without a firefly count as
 * those with one. But pixels that were believed and are more than twice as bright as what waits, a lamp beside a wall, are
 * something else and are left out. And a pixel that is brighter than the block by 1.5 of its standard errors has met its light in
 * three groups or more: that is no firefly (which is one standard error high) but a glint, and keeps its own brightness.
 */
static void settle_block(struct tile_error *t, struct block *b, size_t k, uint32_t x, uint32_t y, uint32_t size)
{
	double n = b->pixels, waiting = b->waiting[k], part = 0;
	bool other = b->all[k] / n > 2 * b->open[k] / waiting;
	n = other ? waiting : n;
	double brightness = (other ? b->open[k] : b->all[k]) / n;
	const double *apart = (other ? b->open_apart : b->all_apart) + k * t->groups;
	double square = spread_square(apart, t->groups, n);
	if (!believe(brightness, square, t->floor_square) && size < TILE_SIZE)
		return;
	double divisor = divisor_square(t, brightness, square, 1);
	float root = (float)(1 / sqrt(divisor));
	for (uint32_t j = y; j < y + size && j < t->height; j++)
		for (uint32_t i = x; i < x + size && i < t->width; i++) {
			size_t pixel = (size_t)j * t->width + i;
			if (t->settled[pixel][k])
				continue;
			t->settled[pixel][k] = true;
			if (t->brightness[pixel][k] - brightness > 1.5 * sqrt(t->square[pixel][k])) {
				settle_pixel(t, pixel, k, false);
				continue;
			}
			float *own = apart_at(t, pixel) + k * t->groups;
			for (uint32_t g = 0; g < t->groups; g++)
				own[g] *= root;
			part += t->square[pixel][k];
		}
	add_share(t, part / divisor, brightness, square, divisor);
	b->waiting[k] = 0;
	b->open[k] = 0;
	memset(b->open_apart + k * t->groups, 0, t->groups * sizeof *b->open_apart);
}

static void add_pixel(const struct tile_error *t, struct block *b, size_t pixel)
{
	const float *apart = apart_at(t, pixel);
	size_t groups = t->groups;
	b->pixels++;
	for (size_t i = 0; i < 3 * groups; i++)
		b->all_apart[i] += (double)apart[i];
	for (size_t k = 0; k < 3; k++) {
		b->all[k] += t->brightness[pixel][k];
		if (t->settled[pixel][k])
			continue;
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
		b->open[k] += part->open[k];
	}
	for (size_t i = 0; i < 3 * (size_t)groups; i++)
		b->all_apart[i] += part->all_apart[i];
	if (part->waiting[0] + part->waiting[1] + part->waiting[2])
		for (size_t i = 0; i < 3 * (size_t)groups; i++)
			b->open_apart[i] += part->open_apart[i];
}

/* The square of `size` pixels at (x, y) of the tile, from its quarters; at most six levels deep. */
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

/* FOLDED groups from `first` on, or as many as there are. */
static void fold(struct tile_error *t, uint32_t first, const float *apart, float *folded)
{
	uint32_t count = t->groups - first < FOLDED ? t->groups - first : FOLDED;
	float v[FOLDED] = {0};
	for (uint32_t g = 0; g < count; g++)
		v[g] = apart[g];
	for (uint32_t g = 0; g < FOLDED; g++)
		folded[g] += v[g];
	for (uint32_t g = 0; g < FOLDED && t->groups > FOLDED; g++)
		t->distance[first + g] += (double)v[g] * (double)v[g];
}

/* Products of the groups' weighted errors. More than FOLDED groups are folded onto so many: errors that add up are alike. A
 * lane is a pair of groups, so that the order within a sum is the pixels'. */
static void add_row(struct tile_error *t, size_t first)
{
	float gram[FOLDED][FOLDED] = {{0}};
	for (size_t pixel = first; pixel < first + t->width; pixel++) {
		const float *apart = apart_at(t, pixel);
		float folded[3][FOLDED] = {{0}};
		for (size_t k = 0; k < 3; k++) {
			for (uint32_t g = 0; g < t->groups; g += FOLDED)
				fold(t, g, apart + k * t->groups + g, folded[k]);
		}
		for (size_t i = 0; i < FOLDED; i++)
			for (size_t j = i / 4 * 4; j < FOLDED; j++)
				gram[i][j] += folded[0][i] * folded[0][j] + folded[1][i] * folded[1][j] + folded[2][i] * folded[2][j];
	}
	for (size_t i = 0; i < FOLDED; i++)
		for (size_t j = i; j < FOLDED; j++)
			t->gram[i][j] += (double)gram[i][j];
}

static void error_tile(struct making *m, struct tile_error *t, uint32_t x, uint32_t y)
{
	t->x = x;
	t->y = y;
	t->width = m->img->width - x < TILE_SIZE ? m->img->width - x : TILE_SIZE;
	t->height = m->img->height - y < TILE_SIZE ? m->img->height - y : TILE_SIZE;
	tile_errors(m, t);
	if (find_settled(t)) {
		struct block whole;
		settle_square(t, 0, 0, TILE_SIZE, &whole);
	} else {
		settle_pixels(t, 0, (size_t)t->width * t->height);
	}
	for (uint32_t row = 0; row < t->height; row++)
		add_row(t, (size_t)row * t->width);
}

/* ---- degrees of freedom */

/*
 * How many errors move apart in one error image: (sum l)^2 / sum l^2 over the eigenvalues l of the covariance of a group's
 * error; 1 when all pixels err together, as by an error of b. Both sums without bias from differences of disjoint pairs of
 * groups: |e1 - e2|^2 |e3 - e4|^2 / 4 and ((e1 - e2) . (e3 - e4))^2 / 4, averaged over all four groups. No fourth power of a
 * group's own error enters, so that a firefly does not pass for an error of everything; the second is never above the first.
 */
static double own_degrees(const struct tile_error *t)
{
	uint32_t n = t->groups < FOLDED ? t->groups : FOLDED;
	double total = 0, square = 0, k[FOLDED][FOLDED];
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t j = i; j < n; j++)
			k[i][j] = k[j][i] = t->gram[i][j];
	for (uint32_t a = 0; a < n; a++)
		for (uint32_t b = a + 1; b < n; b++)
			for (uint32_t c = a + 1; c < n; c++)
				for (uint32_t d = c + 1; d < n; d++) {
					if (c == b || d == b)
						continue;
					double cross = k[a][c] - k[a][d] - k[b][c] + k[b][d];
					square += cross * cross;
					total += (k[a][a] + k[b][b] - 2 * k[a][b]) * (k[c][c] + k[d][d] - 2 * k[c][d]);
				}
	double most = 1e6;
	return !(total > square) ? 1 : total < most * square ? total / square : most;
}

/* Spread of the distances among the groups, relative, squared: 2 over the degrees of one group. The factor undoes the bias of
 * dividing by the mean distance, which is there when all pixels err together. */
static double distance_spread(const struct tile_error *t, double mean)
{
	double groups = t->groups, square = 0;
	for (uint32_t g = 0; g < t->groups; g++)
		square += (t->distance[g] / mean - 1) * (t->distance[g] / mean - 1);
	square /= groups - 1;
	return square * (1 + fmin(square, 2) / groups);
}

/*
 * The estimate: mean over pixels and channels of the squared standard error over B^2 + (0.01 m)^2. It equals the mean over
 * groups of their squared distance from the mean, over groups - 1.
 *
 * Of its expectation it is about chi-square over its degrees of freedom, those with the spread that the distances show
 * (Satterthwaite 1946), but no more than own_degrees allows: 16 distances may lie together by chance, the products of pairs
 * hardly. The error at hand over the estimate is F with own_degrees and (groups - 1) times as many: heavy tails are in both. Own
 * degrees are fewer by (groups - 1) / (groups + 2), since they come from so many groups themselves: intervals are wider by as much as
 * Student's t is than the normal. The doubt of the weights adds to both, to own degrees
 * twice, since brightness that comes in hits is skewed. Where there are too few groups to tell, one degree of
 * freedom is taken.
 */
static void find_rel_mse(struct making *m, struct tile_error *t)
{
	double groups = t->groups, mean = 0;
	for (uint32_t g = 0; g < t->groups && t->groups <= FOLDED; g++)
		t->distance[g] = t->gram[g][g];
	for (uint32_t g = 0; g < t->groups; g++)
		mean += t->distance[g] / groups;
	struct canvas_image *img = m->img;
	img->rel_mse = img->rel_mse_upper = img->rel_mse_95[0] = img->rel_mse_95[1] = mean / (groups - 1) / (3.0 * img->width * img->height);
	if (!(mean > 0))
		return;
	double doubt = t->share > 0 ? t->doubt / (t->share * t->share) : 0, own = own_degrees(t);
	double degrees = 1 / (0.5 * doubt + fmax(1 / own, 0.5 * distance_spread(t, mean)) / (groups - 1));
	own = fmax(1, (groups - 1) / (groups + 2) / (1 / own + doubt));
	img->rel_mse_degrees = degrees;
	img->rel_mse_upper *= degrees / (t->groups == 2 ? 0.00393214 : chi_square_5(degrees));
	img->rel_mse_95[0] *= f_quantile(0.025, own, own * (groups - 1));
	img->rel_mse_95[1] *= f_quantile(0.975, own, own * (groups - 1));
}

int canvas_error(struct making *m, struct error *e)
{
	assert(m->c->plan.groups > 1 && !m->open_rounds);
	struct tile_error *t = mem_alloc(1, sizeof *t);
	size_t values = (size_t)m->img->width * m->img->height * 3;
	if (t)
		t->apart = mem_alloc((size_t)TILE_SIZE * TILE_SIZE * 3 * m->c->plan.groups, sizeof *t->apart);
	if (!t || !t->apart) {
		mem_free(t);
		return error_set(e, ENOMEM, "no memory for the error of an image of %ux%u", m->img->width, m->img->height);
	}
	double mean = 0;
	for (size_t i = 0; i < values; i++)
		mean += (double)m->img->rgb[i];
	mean /= (double)values;
	t->groups = m->c->plan.groups;
	t->floor_square = 1e-4 * mean * mean;
	for (uint32_t y = 0; y < m->img->height; y += TILE_SIZE)
		for (uint32_t x = 0; x < m->img->width; x += TILE_SIZE)
			error_tile(m, t, x, y);
	if (mean != 0) /* a black image has no relative error */
		find_rel_mse(m, t);
	mem_free(t->apart);
	mem_free(t);
	return 0;
}
