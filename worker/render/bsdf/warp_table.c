/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Every density is scaled to an integral of 1 before densities are mixed, so the integral of a mixture is 1, and its
 * cumulative distributions are mixtures of those of the slices. Nothing has to be stored for parameters between the
 * given values.
 *
 * Failures: see warp_table_init.
 */
#include "worker/render/bsdf/warp_table.h"

#include "common/base/liveness.h"
#include "worker/render/math/minmax.h"
#include "worker/render/math/search.h"

#include <errno.h>
#include <math.h>

static struct warp_cell bracket(uint32_t count, const double *value, double x)
{
	if (count < 2 || !(x > value[0]))
		return (struct warp_cell){0, 0};
	if (!(x < value[count - 1]))
		return (struct warp_cell){count - 2, 1};
	uint32_t i = search_find_cell(value, count - 1, x);
	return (struct warp_cell){i, (x - value[i]) / (value[i + 1] - value[i])};
}

struct warp_mix warp_mix_at(const struct warp_axes *axes, const double parameter[2])
{
	struct warp_mix mix = {.count = 0};
	struct warp_cell c[2];
	for (int k = 0; k < 2; k++)
		c[k] = bracket(axes->count[k], axes->value[k], parameter[k]);
	for (unsigned k = 0; k < 4; k++) {
		unsigned next[2] = {k / 2, k % 2};
		double weight =
			(next[0] ? c[0].fraction : 1 - c[0].fraction) * (next[1] ? c[1].fraction : 1 - c[1].fraction);
		if (weight > 0) {
			mix.slice[mix.count] = (c[0].i + next[0]) * axes->count[1] + c[1].i + next[1];
			mix.weight[mix.count++] = weight;
		}
	}
	return mix;
}

/* Scales the values of a slice to an integral of 1, and computes their cumulative sums. */
static int make_slice(uint32_t width, uint32_t height, double *value, double *row_cdf, double *marginal_cdf)
{
	double sum = 1, previous_total = 0;
	size_t count = (size_t)width * height;
	for (size_t i = 0; i < count; i++)
		if (!(value[i] >= 0 && value[i] <= 0x1p+500))
			return -EINVAL;
	for (int pass = 0; pass < 2; pass++) {
		for (size_t i = 0; i < count; i++)
			value[i] /= sum;
		for (uint32_t y = 0; y < height; y++) {
			const double *row = value + (size_t)y * width;
			double *cdf = row_cdf + (size_t)y * width;
			cdf[0] = 0;
			for (uint32_t x = 1; x < width; x++)
				cdf[x] = cdf[x - 1] + 0.5 * (row[x - 1] + row[x]) / (width - 1);
			marginal_cdf[y] =
				y ? marginal_cdf[y - 1] + 0.5 * (previous_total + cdf[width - 1]) / (height - 1) : 0;
			previous_total = cdf[width - 1];
		}
		sum = marginal_cdf[height - 1];
		if (!(sum >= 0x1p-500))
			return -EINVAL;
	}
	return 0;
}

int warp_table_init(struct warp_table *t, uint32_t slices, uint32_t width, uint32_t height, double *value,
		    struct arena *arena)
{
	size_t nodes = (size_t)width * height;
	double *row_cdf = arena_alloc(arena, slices * nodes, sizeof *row_cdf),
	       *marginal_cdf = arena_alloc(arena, (size_t)slices * height, sizeof *marginal_cdf);
	if (!row_cdf || !marginal_cdf)
		return -ENOMEM;
	for (uint32_t s = 0; s < slices; s++) {
		int rc = make_slice(width, height, value + s * nodes, row_cdf + s * nodes,
				    marginal_cdf + (size_t)s * height);
		if (rc)
			return rc;
		liveness_tick();
	}
	*t = (struct warp_table){width, height, value, row_cdf, marginal_cdf};
	return 0;
}

/* Returns the mixture of the slices' entries i of a table; stride: number of entries per slice. */
static double mix_slices(const struct warp_mix *mix, const double *table, size_t stride, size_t i)
{
	double sum = 0;
	for (int k = 0; k < mix->count; k++)
		sum += mix->weight[k] * table[mix->slice[k] * stride + i];
	return sum;
}

/* A row of the mixture, between two rows of the grid. */
struct mixed_row {
	const struct warp_table *t;
	const struct warp_mix *mix;
	struct warp_cell y;
};

static double mixed_row_value(const struct mixed_row *r, const double *table, uint32_t x)
{
	size_t stride = (size_t)r->t->width * r->t->height, i = (size_t)r->y.i * r->t->width + x;
	double near = mix_slices(r->mix, table, stride, i), far = mix_slices(r->mix, table, stride, i + r->t->width);
	return near + r->y.fraction * (far - near);
}

/* Returns the integral over x along row y of the grid. */
static double row_total(const struct warp_table *t, const struct warp_mix *mix, uint32_t y)
{
	return mix_slices(mix, t->row_cdf, (size_t)t->width * t->height, (size_t)y * t->width + t->width - 1);
}

/* Returns the position in a cell of width 1 at which the integral of a density that changes linearly from a to b is
 * `area`. */
static double invert_linear_density(double a, double b, double area)
{
	double root = a + sqrt(max_of(a * a + 2 * (b - a) * area, 0));
	return root > 0 ? min_of(2 * area / root, 1) : 0;
}

double warp_table_sample(const struct warp_table *t, const struct warp_mix *mix, const double u[2], double point[2])
{
	struct mixed_row r = {t, mix, {0, 0}};
	uint32_t high = t->height - 1;
	while (high - r.y.i > 1) {
		uint32_t middle = r.y.i + (high - r.y.i) / 2;
		if (mix_slices(mix, t->marginal_cdf, t->height, middle) <= u[1])
			r.y.i = middle;
		else
			high = middle;
	}
	double rest = u[1] - mix_slices(mix, t->marginal_cdf, t->height, r.y.i);
	r.y.fraction = invert_linear_density(row_total(t, mix, r.y.i), row_total(t, mix, r.y.i + 1),
					     max_of(rest, 0) * (t->height - 1));

	struct warp_cell x = {0, 0};
	double target = u[0] * mixed_row_value(&r, t->row_cdf, t->width - 1);
	high = t->width - 1;
	while (high - x.i > 1) {
		uint32_t middle = x.i + (high - x.i) / 2;
		if (mixed_row_value(&r, t->row_cdf, middle) <= target)
			x.i = middle;
		else
			high = middle;
	}
	double a = mixed_row_value(&r, t->value, x.i), b = mixed_row_value(&r, t->value, x.i + 1);
	rest = target - mixed_row_value(&r, t->row_cdf, x.i);
	x.fraction = invert_linear_density(a, b, max_of(rest, 0) * (t->width - 1));
	point[0] = (x.i + x.fraction) / (t->width - 1);
	point[1] = (r.y.i + r.y.fraction) / (t->height - 1);
	return a + x.fraction * (b - a);
}

double warp_table_invert(const struct warp_table *t, const struct warp_mix *mix, const double point[2], double u[2])
{
	struct mixed_row r = {t, mix, warp_cell_at(t->height, point[1])};
	struct warp_cell x = warp_cell_at(t->width, point[0]);
	double near = row_total(t, mix, r.y.i), far = row_total(t, mix, r.y.i + 1);
	double part = r.y.fraction * (near + 0.5 * r.y.fraction * (far - near));
	u[1] = min_of(mix_slices(mix, t->marginal_cdf, t->height, r.y.i) + part / (t->height - 1), 1);

	double a = mixed_row_value(&r, t->value, x.i), b = mixed_row_value(&r, t->value, x.i + 1),
	       total = mixed_row_value(&r, t->row_cdf, t->width - 1);
	part = x.fraction * (a + 0.5 * x.fraction * (b - a));
	u[0] = total > 0 ? min_of((mixed_row_value(&r, t->row_cdf, x.i) + part / (t->width - 1)) / total, 1) : 0;
	return a + x.fraction * (b - a);
}

double warp_table_density(const struct warp_table *t, const struct warp_mix *mix, const double point[2])
{
	struct mixed_row r = {t, mix, warp_cell_at(t->height, point[1])};
	struct warp_cell x = warp_cell_at(t->width, point[0]);
	double a = mixed_row_value(&r, t->value, x.i), b = mixed_row_value(&r, t->value, x.i + 1);
	return a + x.fraction * (b - a);
}
