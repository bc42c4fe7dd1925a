/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/slow_grid.h"

#include <math.h>
#include <stdlib.h>

enum { CUTS_MAX = 256 };

static int wrapped_index(const struct grid *g, int i, int n)
{
	while (i < 0 || i >= n) {
		if (g->wrap == GRID_REPEAT)
			i += i < 0 ? n : -n;
		else if (g->wrap == GRID_MIRROR)
			i = i < 0 ? -1 - i : 2 * n - 1 - i;
		else
			i = i < 0 ? 0 : n - 1;
	}
	return i;
}

static double point_weight(const struct grid *g, int point, double x)
{
	return g->is_nearest ? x >= point && x < point + 1 : fmax(1 - fabs(x - point), 0);
}

double slow_grid_value(const struct grid *g, const double x[3], int channel)
{
	double sum = 0;
	for (int k = (int)x[2] - 2; k <= x[2] + 2; k++) {
		double z = point_weight(g, k, x[2]);
		for (int j = (int)x[1] - 2; j <= x[1] + 2 && z > 0; j++) {
			double y = z * point_weight(g, j, x[1]);
			for (int i = (int)x[0] - 2; i <= x[0] + 2 && y > 0; i++) {
				size_t row = (size_t)(wrapped_index(g, k, g->size[2]) * g->size[1] +
						      wrapped_index(g, j, g->size[1])),
				       at = row * (size_t)g->size[0] + (size_t)wrapped_index(g, i, g->size[0]);
				double value = (double)g->value[at * (size_t)g->channels + (size_t)channel];
				sum += y * point_weight(g, i, x[0]) * value;
			}
		}
	}
	return sum;
}

void slow_grid_position(const struct grid *g, const struct grid_ray *r, double t, double x[3])
{
	vec3 p = mat4_point(&g->to_cells, vec3_madd(r->o, t, r->d));
	x[0] = p.x;
	x[1] = p.y;
	x[2] = p.z;
}

static int ascending(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

bool slow_grid_contains(const struct grid *g, vec3 p)
{
	double x[3];
	const double at[3] = {p.x, p.y, p.z}, min[3] = {g->world_min.x, g->world_min.y, g->world_min.z},
		     max[3] = {g->world_max.x, g->world_max.y, g->world_max.z};
	slow_grid_position(g, &(struct grid_ray){p, {0, 0, 0}, 0, 0}, 0, x);
	for (int i = 0; i < 3; i++)
		if (g->is_world_aligned ? at[i] < min[i] || at[i] > max[i]
					: x[i] < g->cell_min[i] || x[i] > g->cell_max[i])
			return false;
	return true;
}

static size_t add_cut(double *cut, size_t cuts, double t)
{
	if (t > cut[0] && t < cut[1])
		cut[cuts++] = t;
	return cuts;
}

double slow_grid_integral(const struct grid *g, const struct grid_ray *r, int channel)
{
	double cut[CUTS_MAX], sum = 0, a[3], b[3];
	size_t cuts = 0;
	cut[cuts++] = r->t0;
	cut[cuts++] = fmin(r->t1, 1000);
	slow_grid_position(g, r, 0, a);
	slow_grid_position(g, r, 1, b);
	for (int i = 0; i < 3; i++)
		for (double plane = -1; plane <= g->size[i] + 1; plane += 0.5) {
			cuts = add_cut(cut, cuts, (plane - a[i]) / (b[i] - a[i]));
		}
	for (int i = 0; i < 2 && g->is_world_aligned; i++) {
		vec3 p = i ? g->world_max : g->world_min;
		cuts = add_cut(cut, cuts, (p.x - r->o.x) / r->d.x);
		cuts = add_cut(cut, cuts, (p.y - r->o.y) / r->d.y);
		cuts = add_cut(cut, cuts, (p.z - r->o.z) / r->d.z);
	}
	qsort(cut, cuts, sizeof *cut, ascending);
	for (size_t i = 0; i + 1 < cuts; i++) {
		double x[3], v[3], length = cut[i + 1] - cut[i];
		if (!slow_grid_contains(g, vec3_madd(r->o, cut[i] + length / 2, r->d)))
			continue;
		/* Points halfway towards the ends, because a value may jump there: any three points are exact for a
		 * cubic. */
		for (int k = 0; k < 3; k++) {
			slow_grid_position(g, r, cut[i] + length * (k + 1) / 4, x);
			v[k] = slow_grid_value(g, x, channel);
		}
		sum += length * (2 * v[0] - v[1] + 2 * v[2]) / 3;
	}
	return sum;
}
