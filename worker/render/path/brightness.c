/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/brightness.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"

enum {
	TICK_INTERVAL = 16, /* samples */
	SAMPLES_A_CELL = 8,
	CELLS_MOST = 256, /* cells along a side */
};
/* Squared relative standard error up to which a quarter's brightness is used. */
static const double believed = 0.2;
/* Share of the mean that is added in squares. */
static const double least = 0.01;

int brightness_init(struct brightness *b, const struct film_window *window, uint64_t samples, struct error *e)
{
	*b = (struct brightness){.window = *window, .across = 1};
	while (4ull * b->across * b->across * SAMPLES_A_CELL <= samples && b->across < CELLS_MOST)
		b->across *= 2;
	size_t n = (size_t)b->across * b->across;
	b->sum = mem_alloc(n, sizeof *b->sum);
	b->square = mem_alloc(n, sizeof *b->square);
	b->scale = mem_alloc(n, sizeof *b->scale);
	if (b->sum && b->square && b->scale)
		return 0;
	brightness_fini(b);
	return error_set(e, ENOMEM, "no memory for a map of brightness");
}

void brightness_fini(struct brightness *b)
{
	mem_free(b->sum);
	mem_free(b->square);
	mem_free(b->scale);
	*b = (struct brightness){.across = 0};
}

static uint32_t along(double position, double size, uint32_t cells)
{
	double cell = position / size * cells;
	return cell > 0 ? cell < cells ? (uint32_t)cell : cells - 1 : 0;
}

static size_t cell_at(const struct brightness *b, double x, double y)
{
	return (size_t)along(y - b->window.y, b->window.height, b->across) * b->across +
	       along(x - b->window.x, b->window.width, b->across);
}

void brightness_add(struct brightness *b, const struct splat *s)
{
	double i = s->xyz[0] + s->xyz[1] + s->xyz[2];
	size_t cell = cell_at(b, s->x, s->y);
	b->sum[cell] += i;
	b->square[cell] += i * i;
}

double brightness_scale(const struct brightness *b, double x, double y)
{
	return b->scale[cell_at(b, x, y)];
}

/* ---- squares of cells */

struct square {
	uint32_t x, y, size;
};

struct sums {
	double sum, square;
};

static struct sums sums_of(const struct brightness *b, struct square q)
{
	struct sums s = {0, 0};
	for (uint32_t j = q.y; j < q.y + q.size; j++)
		for (uint32_t i = q.x; i < q.x + q.size; i++) {
			s.sum += b->sum[(size_t)j * b->across + i];
			s.square += b->square[(size_t)j * b->across + i];
		}
	return s;
}

/* The square of a sum, with the minimum for a square of that size. */
static double lifted(const struct brightness *b, double all, struct sums s, struct square q)
{
	double floor = least * all * q.size * q.size / ((double)b->across * b->across);
	return s.sum * s.sum + floor * floor;
}

static struct square quarter(struct square q, uint32_t k)
{
	return (struct square){q.x + k % 2 * (q.size / 2), q.y + k / 2 * (q.size / 2), q.size / 2};
}

static bool knows(const struct brightness *b, double all, struct square q)
{
	struct sums s = sums_of(b, q);
	return s.square <= believed * lifted(b, all, s, q);
}

/* At most eight levels deep. */
static void settle_square(struct brightness *b, double all, double samples, struct square q)
{
	bool quartered = q.size > 1;
	for (uint32_t k = 0; k < 4 && quartered; k++)
		quartered = knows(b, all, quarter(q, k));
	for (uint32_t k = 0; k < 4 && quartered; k++)
		settle_square(b, all, samples, quarter(q, k));
	if (quartered)
		return;
	double sum = sqrt(lifted(b, all, sums_of(b, q), q)), cells = (double)b->across * b->across;
	double scale = samples * q.size * q.size / (cells * sum);
	if (!isfinite(scale)) /* fainter than squares of doubles can tell */
		scale = 0;
	for (uint32_t j = q.y; j < q.y + q.size; j++)
		for (uint32_t i = q.x; i < q.x + q.size; i++)
			b->scale[(size_t)j * b->across + i] = scale;
}

void brightness_settle(struct brightness *b, uint64_t samples)
{
	struct square whole = {0, 0, b->across};
	double all = sums_of(b, whole).sum;
	if (all > 0)
		settle_square(b, all, (double)samples, whole);
}

int brightness_of_samples(struct brightness *b, struct path_context *c, path_tracer *trace, uint64_t seed,
			  enum rng_stream stream, uint64_t step, uint64_t samples, struct error *e)
{
	struct path_sample sample;
	int rc = brightness_init(b, &c->window, samples, e);
	if (rc)
		return rc;
	for (uint64_t i = 0; i < samples; i++) {
		struct sampler_random s;
		if (i % TICK_INTERVAL == 0)
			tick();
		sampler_random_init(&s, seed, stream, i, step);
		trace(c, &s.base, &sample);
		for (uint32_t k = 0; k < sample.count; k++)
			brightness_add(b, &sample.splats[k]);
	}
	brightness_settle(b, samples);
	return 0;
}
