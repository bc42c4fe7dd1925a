/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A sample's contributions are collected in `current` and added to the cells' sums of x and x^2 when the sample ends,
 * so that the relative standard error sqrt(sum of x^2) / (sum of x) is that of samples, however many splats each has in
 * a cell. When all samples have been added, the sums become scales, either of squares whose brightness is known well
 * enough or of neighbourhoods.
 *
 * brightness_init and brightness_init_from_samples fail if out of memory; nothing else fails. Where everything is black
 * the scales are 0, and so is a scale that would not be finite.
 */
#include "worker/render/path/brightness.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"

enum {
	TICK_INTERVAL = 16, /* samples */
	CELLS_MAX = 256,    /* along a side */
	RADIUS_MIN = 2,	    /* radius of the smallest neighbourhood, in cells */
	RADIUS_MAX = 12,
};
/* Limits on the squared relative standard error up to which the brightness of a quarter, or of a
 * neighbourhood, counts as known. */
static const double max_quarter_error2 = 0.2, max_neighbourhood_error2 = 0.05;
/* Fraction of the mean that is added in quadrature. */
static const double floor_fraction = 0.01;

static void add_splat_to_map(struct splat_target *target, const struct splat *s, double weight)
{
	struct brightness *b = (struct brightness *)(void *)target;
	brightness_add(b, s, weight * b->window.width * b->window.height);
}

int brightness_init(struct brightness *b, const struct film_window *window, uint64_t samples, unsigned samples_per_cell,
		    struct error *e)
{
	*b = (struct brightness){.target = {add_splat_to_map}, .window = *window, .resolution = 1};
	while (4ull * b->resolution * b->resolution * samples_per_cell <= samples && b->resolution < CELLS_MAX)
		b->resolution *= 2;
	size_t n = (size_t)b->resolution * b->resolution;
	b->sum = mem_alloc(n, sizeof *b->sum);
	b->square_sum = mem_alloc(n, sizeof *b->square_sum);
	b->scale = mem_alloc(n, sizeof *b->scale);
	b->current = mem_alloc(n, sizeof *b->current);
	b->touched = mem_alloc(n, sizeof *b->touched);
	if (b->sum && b->square_sum && b->scale && b->current && b->touched)
		return 0;
	brightness_fini(b);
	return error_set(e, ENOMEM, "no memory for a map of brightness");
}

void brightness_fini(struct brightness *b)
{
	mem_free(b->sum);
	mem_free(b->square_sum);
	mem_free(b->scale);
	mem_free(b->current);
	mem_free(b->touched);
	*b = (struct brightness){.resolution = 0};
}

static uint32_t cell_along(double position, double size, uint32_t cells)
{
	double cell = position / size * cells;
	return cell > 0 ? cell < cells ? (uint32_t)cell : cells - 1 : 0;
}

static size_t cell_at(const struct brightness *b, double x, double y)
{
	return (size_t)cell_along(y - b->window.y, b->window.height, b->resolution) * b->resolution +
	       cell_along(x - b->window.x, b->window.width, b->resolution);
}

void brightness_add(struct brightness *b, const struct splat *s, double weight)
{
	double i = (s->xyz[0] + s->xyz[1] + s->xyz[2]) * weight;
	size_t cell = cell_at(b, s->x, s->y);
	if (!(i > 0))
		return;
	if (b->current[cell] == 0)
		b->touched[b->touched_count++] = (uint32_t)cell;
	b->current[cell] += i;
}

void brightness_end_sample(struct brightness *b)
{
	for (size_t k = 0; k < b->touched_count; k++) {
		double *now = &b->current[b->touched[k]];
		b->sum[b->touched[k]] += *now;
		b->square_sum[b->touched[k]] += *now * *now;
		*now = 0;
	}
	b->touched_count = 0;
}

void brightness_add_sample(struct brightness *b, const struct path_sample *sample)
{
	for (uint32_t k = 0; k < sample->splat_count; k++)
		brightness_add(b, &sample->splats[k], 1);
	brightness_end_sample(b);
}

double brightness_inverse_at(const struct brightness *b, double x, double y)
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

static struct sums block_sums(const struct brightness *b, struct block q)
{
	struct sums s = {0, 0};
	for (uint32_t j = q.y0; j < q.y1; j++)
		for (uint32_t i = q.x0; i < q.x1; i++) {
			s.sum += b->sum[(size_t)j * b->resolution + i];
			s.square += b->square_sum[(size_t)j * b->resolution + i];
		}
	return s;
}

/* The fraction of the film that the block covers. */
static double block_share(const struct brightness *b, struct block q)
{
	return (double)(q.x1 - q.x0) * (q.y1 - q.y0) / ((double)b->resolution * b->resolution);
}

/* Returns the square of the block's sum plus the square of its minimum, which is in proportion to its size. */
static double squared_with_floor(const struct brightness *b, double total, struct sums s, struct block q)
{
	double floor = floor_fraction * total * block_share(b, q);
	return s.sum * s.sum + floor * floor;
}

static double block_scale(const struct brightness *b, double total, double samples, struct sums s, struct block q)
{
	double scale = samples * block_share(b, q) / sqrt(squared_with_floor(b, total, s, q));
	return isfinite(scale) ? scale : 0; /* fainter than squares of doubles can represent */
}

/* ---- known squares */

static struct block block_quarter(struct block q, uint32_t k)
{
	uint32_t half = (q.x1 - q.x0) / 2, x = q.x0 + k % 2 * half, y = q.y0 + k / 2 * half;
	return (struct block){x, y, x + half, y + half};
}

static bool is_reliable(const struct brightness *b, double total, struct block q)
{
	struct sums s = block_sums(b, q);
	return s.square <= max_quarter_error2 * squared_with_floor(b, total, s, q);
}

/* Recursion is at most eight levels deep. */
static void compute_square_scales(struct brightness *b, double total, double samples, struct block q)
{
	bool quartered = q.x1 - q.x0 > 1;
	for (uint32_t k = 0; k < 4 && quartered; k++)
		quartered = is_reliable(b, total, block_quarter(q, k));
	for (uint32_t k = 0; k < 4 && quartered; k++)
		compute_square_scales(b, total, samples, block_quarter(q, k));
	if (quartered)
		return;
	double scale = block_scale(b, total, samples, block_sums(b, q), q);
	for (uint32_t j = q.y0; j < q.y1; j++)
		for (uint32_t i = q.x0; i < q.x1; i++)
			b->scale[(size_t)j * b->resolution + i] = scale;
}

void brightness_compute_scales(struct brightness *b, uint64_t samples)
{
	struct block whole = {0, 0, b->resolution, b->resolution};
	double total = block_sums(b, whole).sum;
	if (total > 0)
		compute_square_scales(b, total, (double)samples, whole);
}

/* ---- neighbourhoods */

/* Returns the square block of that radius around a cell, cut off at the edges of the film. */
static struct block block_around(const struct brightness *b, uint32_t x, uint32_t y, uint32_t radius)
{
	return (struct block){x > radius ? x - radius : 0, y > radius ? y - radius : 0,
			      x + radius < b->resolution ? x + radius + 1 : b->resolution,
			      y + radius < b->resolution ? y + radius + 1 : b->resolution};
}

void brightness_compute_nearby_scales(struct brightness *b, uint64_t samples)
{
	const double total = block_sums(b, (struct block){0, 0, b->resolution, b->resolution}).sum;
	for (uint32_t y = 0; y < b->resolution && total > 0; y++)
		for (uint32_t x = 0; x < b->resolution; x++) {
			uint32_t radius = RADIUS_MIN;
			struct block q = block_around(b, x, y, radius);
			struct sums s = block_sums(b, q);
			while (radius < RADIUS_MAX &&
			       !(s.sum > 0 && s.square <= max_neighbourhood_error2 * s.sum * s.sum)) {
				q = block_around(b, x, y, ++radius);
				s = block_sums(b, q);
			}
			b->scale[(size_t)y * b->resolution + x] = block_scale(b, total, (double)samples, s, q);
		}
}

int brightness_init_from_samples(struct brightness *b, struct path_context *c, path_tracer *trace, uint64_t seed,
				 enum rng_stream stream, uint64_t step, uint64_t samples, struct error *e)
{
	struct path_sample sample;
	int rc = brightness_init(b, &c->window, samples, BRIGHTNESS_SAMPLES_PER_CELL, e);
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
	brightness_compute_scales(b, samples);
	return 0;
}
