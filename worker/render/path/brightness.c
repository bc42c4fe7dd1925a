/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A sample's contributions are collected in `now` and added to the cells' sums of x and x^2 when the sample ends, so
 * that the relative standard error sqrt(sum of x^2) / (sum of x) is that of samples, however many splats each has in a
 * cell. When all samples have been added, the sums become scales, either of squares whose brightness is known well
 * enough or of neighbourhoods.
 *
 * brightness_init and brightness_of_samples fail if out of memory; nothing else fails. Where everything is black the
 * scales are 0, and so is a scale that would not be finite.
 */
#include "worker/render/path/brightness.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"

enum {
	TICK_INTERVAL = 16, /* samples */
	CELLS_MOST = 256,   /* along a side */
	NEAR_LEAST = 2,	    /* radius of the smallest neighbourhood, in cells */
	NEAR_MOST = 12,
};
/* Limits on the squared relative standard error up to which the brightness of a quarter, or of a
 * neighbourhood, counts as known. */
static const double believed = 0.2, believed_near = 0.05;
/* Fraction of the mean that is added in quadrature. */
static const double least = 0.01;

static void splat_on_map(struct splat_target *to, const struct splat *s, double weight)
{
	struct brightness *b = (struct brightness *)(void *)to;
	brightness_add(b, s, weight * b->window.width * b->window.height);
}

int brightness_init(struct brightness *b, const struct film_window *window, uint64_t samples, unsigned a_cell,
		    struct error *e)
{
	*b = (struct brightness){.target = {splat_on_map}, .window = *window, .across = 1};
	while (4ull * b->across * b->across * a_cell <= samples && b->across < CELLS_MOST)
		b->across *= 2;
	size_t n = (size_t)b->across * b->across;
	b->sum = mem_alloc(n, sizeof *b->sum);
	b->square = mem_alloc(n, sizeof *b->square);
	b->scale = mem_alloc(n, sizeof *b->scale);
	b->now = mem_alloc(n, sizeof *b->now);
	b->touched = mem_alloc(n, sizeof *b->touched);
	if (b->sum && b->square && b->scale && b->now && b->touched)
		return 0;
	brightness_fini(b);
	return error_set(e, ENOMEM, "no memory for a map of brightness");
}

void brightness_fini(struct brightness *b)
{
	mem_free(b->sum);
	mem_free(b->square);
	mem_free(b->scale);
	mem_free(b->now);
	mem_free(b->touched);
	*b = (struct brightness){.across = 0};
}

static uint32_t cell_along(double position, double size, uint32_t cells)
{
	double cell = position / size * cells;
	return cell > 0 ? cell < cells ? (uint32_t)cell : cells - 1 : 0;
}

static size_t cell_at(const struct brightness *b, double x, double y)
{
	return (size_t)cell_along(y - b->window.y, b->window.height, b->across) * b->across +
	       cell_along(x - b->window.x, b->window.width, b->across);
}

void brightness_add(struct brightness *b, const struct splat *s, double weight)
{
	double i = (s->xyz[0] + s->xyz[1] + s->xyz[2]) * weight;
	size_t cell = cell_at(b, s->x, s->y);
	if (!(i > 0))
		return;
	if (b->now[cell] == 0)
		b->touched[b->touched_count++] = (uint32_t)cell;
	b->now[cell] += i;
}

void brightness_end_sample(struct brightness *b)
{
	for (size_t k = 0; k < b->touched_count; k++) {
		double *now = &b->now[b->touched[k]];
		b->sum[b->touched[k]] += *now;
		b->square[b->touched[k]] += *now * *now;
		*now = 0;
	}
	b->touched_count = 0;
}

void brightness_add_sample(struct brightness *b, const struct path_sample *sample)
{
	for (uint32_t k = 0; k < sample->count; k++)
		brightness_add(b, &sample->splats[k], 1);
	brightness_end_sample(b);
}

double brightness_scale(const struct brightness *b, double x, double y)
{
	return b->scale[cell_at(b, x, y)];
}

/* ---- blocks of cells */

/* The cells (x, y) with x0 <= x < x1 and y0 <= y < y1. */
struct block {
	uint32_t x0, y0, x1, y1;
};

struct sums {
	double sum, square;
};

static struct sums sums_of(const struct brightness *b, struct block q)
{
	struct sums s = {0, 0};
	for (uint32_t j = q.y0; j < q.y1; j++)
		for (uint32_t i = q.x0; i < q.x1; i++) {
			s.sum += b->sum[(size_t)j * b->across + i];
			s.square += b->square[(size_t)j * b->across + i];
		}
	return s;
}

/* The fraction of the film that the block covers. */
static double share_of(const struct brightness *b, struct block q)
{
	return (double)(q.x1 - q.x0) * (q.y1 - q.y0) / ((double)b->across * b->across);
}

/* Returns the square of the block's sum plus the square of its minimum, which is in proportion to its size. */
static double squared_with_floor(const struct brightness *b, double all, struct sums s, struct block q)
{
	double floor = least * all * share_of(b, q);
	return s.sum * s.sum + floor * floor;
}

static double scale_of(const struct brightness *b, double all, double samples, struct sums s, struct block q)
{
	double scale = samples * share_of(b, q) / sqrt(squared_with_floor(b, all, s, q));
	return isfinite(scale) ? scale : 0; /* fainter than squares of doubles can represent */
}

/* ---- known squares */

static struct block quarter_of(struct block q, uint32_t k)
{
	uint32_t half = (q.x1 - q.x0) / 2, x = q.x0 + k % 2 * half, y = q.y0 + k / 2 * half;
	return (struct block){x, y, x + half, y + half};
}

static bool is_known(const struct brightness *b, double all, struct block q)
{
	struct sums s = sums_of(b, q);
	return s.square <= believed * squared_with_floor(b, all, s, q);
}

/* Recursion is at most eight levels deep. */
static void settle_square(struct brightness *b, double all, double samples, struct block q)
{
	bool quartered = q.x1 - q.x0 > 1;
	for (uint32_t k = 0; k < 4 && quartered; k++)
		quartered = is_known(b, all, quarter_of(q, k));
	for (uint32_t k = 0; k < 4 && quartered; k++)
		settle_square(b, all, samples, quarter_of(q, k));
	if (quartered)
		return;
	double scale = scale_of(b, all, samples, sums_of(b, q), q);
	for (uint32_t j = q.y0; j < q.y1; j++)
		for (uint32_t i = q.x0; i < q.x1; i++)
			b->scale[(size_t)j * b->across + i] = scale;
}

void brightness_settle(struct brightness *b, uint64_t samples)
{
	struct block whole = {0, 0, b->across, b->across};
	double all = sums_of(b, whole).sum;
	if (all > 0)
		settle_square(b, all, (double)samples, whole);
}

/* ---- neighbourhoods */

/* Returns the square block of that radius around a cell, cut off at the edges of the film. */
static struct block block_around(const struct brightness *b, uint32_t x, uint32_t y, uint32_t radius)
{
	return (struct block){x > radius ? x - radius : 0, y > radius ? y - radius : 0,
			      x + radius < b->across ? x + radius + 1 : b->across,
			      y + radius < b->across ? y + radius + 1 : b->across};
}

void brightness_settle_near(struct brightness *b, uint64_t samples)
{
	const double all = sums_of(b, (struct block){0, 0, b->across, b->across}).sum;
	for (uint32_t y = 0; y < b->across && all > 0; y++)
		for (uint32_t x = 0; x < b->across; x++) {
			uint32_t radius = NEAR_LEAST;
			struct block q = block_around(b, x, y, radius);
			struct sums s = sums_of(b, q);
			while (radius < NEAR_MOST && !(s.sum > 0 && s.square <= believed_near * s.sum * s.sum)) {
				q = block_around(b, x, y, ++radius);
				s = sums_of(b, q);
			}
			b->scale[(size_t)y * b->across + x] = scale_of(b, all, (double)samples, s, q);
		}
}

int brightness_of_samples(struct brightness *b, struct path_context *c, path_tracer *trace, uint64_t seed,
			  enum rng_stream stream, uint64_t step, uint64_t samples, struct error *e)
{
	struct path_sample sample;
	int rc = brightness_init(b, &c->window, samples, BRIGHTNESS_A_CELL, e);
	if (rc)
		return rc;
	for (uint64_t i = 0; i < samples; i++) {
		struct sampler_random s;
		if (i % TICK_INTERVAL == 0)
			liveness_tick();
		sampler_random_init(&s, seed, stream, i, step);
		trace(c, &s.base, &sample);
		brightness_add_sample(b, &sample);
	}
	brightness_settle(b, samples);
	return 0;
}
