/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Every density is scaled to an integral of 1 before densities are mixed, so the integral of a mixture is 1, and its
 * cumulative distributions are mixtures of those of the slices. Nothing has to be stored for parameters between the
 * given values.
 *
 * Failures: see warp_table_make.
 */
#include "worker/render/bsdf/warp_table.h"

#include "common/base/liveness.h"
#include "worker/render/math/minmax.h"
#include "worker/render/math/search.h"

#include <errno.h>
#include <math.h>

static struct warp_cell bracket(uint32_t count, const double *at, double x)
{
	if (count < 2 || !(x > at[0]))
		return (struct warp_cell){0, 0};
	if (!(x < at[count - 1]))
		return (struct warp_cell){count - 2, 1};
	uint32_t i = search_cell(at, count - 1, x);
	return (struct warp_cell){i, (x - at[i]) / (at[i + 1] - at[i])};
}

struct warp_mix warp_mix_at(const struct warp_axes *axes, const double parameter[2])
{
	struct warp_mix mix = {.count = 0};
	struct warp_cell c[2];
	for (int k = 0; k < 2; k++)
		c[k] = bracket(axes->count[k], axes->at[k], parameter[k]);
	for (unsigned k = 0; k < 4; k++) {
		unsigned far[2] = {k / 2, k % 2};
		double weight = (far[0] ? c[0].part : 1 - c[0].part) * (far[1] ? c[1].part : 1 - c[1].part);
		if (weight > 0) {
			mix.slice[mix.count] = (c[0].i + far[0]) * axes->count[1] + c[1].i + far[1];
			mix.weight[mix.count++] = weight;
		}
	}
	return mix;
}

/* Scales the values of a slice to an integral of 1, and computes their cumulative sums. */
static int make_slice(uint32_t width, uint32_t height, double *value, double *below_node, double *below_row)
{
	double sum = 1, before = 0;
	size_t count = (size_t)width * height;
	for (size_t i = 0; i < count; i++)
		if (!(value[i] >= 0 && value[i] <= 0x1p+500))
			return -EINVAL;
	for (int pass = 0; pass < 2; pass++) {
		for (size_t i = 0; i < count; i++)
			value[i] /= sum;
		for (uint32_t y = 0; y < height; y++) {
			const double *row = value + (size_t)y * width;
			double *below = below_node + (size_t)y * width;
			below[0] = 0;
			for (uint32_t x = 1; x < width; x++)
				below[x] = below[x - 1] + 0.5 * (row[x - 1] + row[x]) / (width - 1);
			below_row[y] = y ? below_row[y - 1] + 0.5 * (before + below[width - 1]) / (height - 1) : 0;
			before = below[width - 1];
		}
		sum = below_row[height - 1];
		if (!(sum >= 0x1p-500))
			return -EINVAL;
	}
	return 0;
}

int warp_table_make(struct warp_table *t, uint32_t slices, uint32_t width, uint32_t height, double *value,
		    struct arena *arena)
{
	size_t nodes = (size_t)width * height;
	double *below_node = arena_alloc(arena, slices * nodes, sizeof *below_node),
	       *below_row = arena_alloc(arena, (size_t)slices * height, sizeof *below_row);
	if (!below_node || !below_row)
		return -ENOMEM;
	for (uint32_t s = 0; s < slices; s++) {
		int rc = make_slice(width, height, value + s * nodes, below_node + s * nodes,
				    below_row + (size_t)s * height);
		if (rc)
			return rc;
		liveness_tick();
	}
	*t = (struct warp_table){width, height, value, below_node, below_row};
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
struct row {
	const struct warp_table *t;
	const struct warp_mix *mix;
	struct warp_cell y;
};

static double row_mixed(const struct row *r, const double *table, uint32_t x)
{
	size_t stride = (size_t)r->t->width * r->t->height, i = (size_t)r->y.i * r->t->width + x;
	double near = mix_slices(r->mix, table, stride, i), far = mix_slices(r->mix, table, stride, i + r->t->width);
	return near + r->y.part * (far - near);
}

/* Returns the integral over x along row y of the grid. */
static double row_total(const struct warp_table *t, const struct warp_mix *mix, uint32_t y)
{
	return mix_slices(mix, t->below_node, (size_t)t->width * t->height, (size_t)y * t->width + t->width - 1);
}

/* Returns the position in a cell of width 1 at which the integral of a density that changes linearly from a to b is
 * `area`. */
static double cross(double a, double b, double area)
{
	double root = a + sqrt(max_of(a * a + 2 * (b - a) * area, 0));
	return root > 0 ? min_of(2 * area / root, 1) : 0;
}

double warp_table_sample(const struct warp_table *t, const struct warp_mix *mix, const double u[2], double where[2])
{
	struct row r = {t, mix, {0, 0}};
	uint32_t high = t->height - 1;
	while (high - r.y.i > 1) {
		uint32_t middle = r.y.i + (high - r.y.i) / 2;
		if (mix_slices(mix, t->below_row, t->height, middle) <= u[1])
			r.y.i = middle;
		else
			high = middle;
	}
	double rest = u[1] - mix_slices(mix, t->below_row, t->height, r.y.i);
	r.y.part = cross(row_total(t, mix, r.y.i), row_total(t, mix, r.y.i + 1), max_of(rest, 0) * (t->height - 1));

	struct warp_cell x = {0, 0};
	double wanted = u[0] * row_mixed(&r, t->below_node, t->width - 1);
	high = t->width - 1;
	while (high - x.i > 1) {
		uint32_t middle = x.i + (high - x.i) / 2;
		if (row_mixed(&r, t->below_node, middle) <= wanted)
			x.i = middle;
		else
			high = middle;
	}
	double a = row_mixed(&r, t->value, x.i), b = row_mixed(&r, t->value, x.i + 1);
	rest = wanted - row_mixed(&r, t->below_node, x.i);
	x.part = cross(a, b, max_of(rest, 0) * (t->width - 1));
	where[0] = (x.i + x.part) / (t->width - 1);
	where[1] = (r.y.i + r.y.part) / (t->height - 1);
	return a + x.part * (b - a);
}

double warp_table_invert(const struct warp_table *t, const struct warp_mix *mix, const double where[2], double u[2])
{
	struct row r = {t, mix, warp_cell_at(t->height, where[1])};
	struct warp_cell x = warp_cell_at(t->width, where[0]);
	double near = row_total(t, mix, r.y.i), far = row_total(t, mix, r.y.i + 1);
	double part = r.y.part * (near + 0.5 * r.y.part * (far - near));
	u[1] = min_of(mix_slices(mix, t->below_row, t->height, r.y.i) + part / (t->height - 1), 1);

	double a = row_mixed(&r, t->value, x.i), b = row_mixed(&r, t->value, x.i + 1),
	       total = row_mixed(&r, t->below_node, t->width - 1);
	part = x.part * (a + 0.5 * x.part * (b - a));
	u[0] = total > 0 ? min_of((row_mixed(&r, t->below_node, x.i) + part / (t->width - 1)) / total, 1) : 0;
	return a + x.part * (b - a);
}

double warp_table_density(const struct warp_table *t, const struct warp_mix *mix, const double where[2])
{
	struct row r = {t, mix, warp_cell_at(t->height, where[1])};
	struct warp_cell x = warp_cell_at(t->width, where[0]);
	double a = row_mixed(&r, t->value, x.i), b = row_mixed(&r, t->value, x.i + 1);
	return a + x.part * (b - a);
}
