/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A ray visits cells in order, leaving each through the nearest of the three planes ahead (Amanatides and Woo 1987).
 * The crossing of a plane is computed from the number of the plane, so that errors do not accumulate. Empty bricks of
 * cells are crossed in one step. Gauss's rule with two points is exact for the cubic polynomial in a cell; the position
 * at which an integral reaches a value is found by Newton's method, with bisection if a step leaves the bracket.
 *
 * Nothing fails: a ray that misses the box, or is not finite, visits no cell.
 */
#include "worker/render/volume/grid.h"

#include "common/base/liveness.h"

#include <float.h>

/* ---- values ---- */

/* Returns the index of the point that stands for the i-th, which may lie outside the grid. */
static int wrap_index(enum grid_wrap wrap, int i, int n)
{
	if (i >= 0 && i < n)
		return i;
	if (wrap == GRID_REPEAT)
		return (i % n + n) % n;
	if (wrap == GRID_MIRROR) {
		int j = (i % (2 * n) + 2 * n) % (2 * n);
		return j < n ? j : 2 * n - 1 - j;
	}
	return i < 0 ? 0 : n - 1;
}

/* Maps a coordinate outside the grid to an equivalent one near it, so that it fits an int. */
static double wrap_coordinate(enum grid_wrap wrap, double x, int n)
{
	int period = wrap == GRID_REPEAT ? n : 2 * n;
	if (wrap == GRID_REPEAT || wrap == GRID_MIRROR)
		return isfinite(x) ? x - period * floor(x / period) : 0;
	return fmin(fmax(x, -1), n);
}

/* Finds the points around a cell; bits 1, 2 and 4 of an index select the further point along x, y and z. */
static void find_corners(const struct grid *g, const int cell[3], const float *corner[8])
{
	size_t stride[3] = {(size_t)g->channels, (size_t)g->channels * (size_t)g->size[0],
			    (size_t)g->channels * (size_t)g->size[0] * (size_t)g->size[1]};
	size_t offset[3][2];
	for (int i = 0; i < 3; i++) {
		int next = g->is_nearest ? cell[i] : cell[i] + 1;
		bool within = cell[i] >= 0 && next < g->size[i];
		offset[i][0] = stride[i] * (size_t)(within ? cell[i] : wrap_index(g->wrap, cell[i], g->size[i]));
		offset[i][1] = stride[i] * (size_t)(within ? next : wrap_index(g->wrap, next, g->size[i]));
	}
	for (int k = 0; k < 8; k++)
		corner[k] = g->value + offset[2][k >> 2] + offset[1][k >> 1 & 1] + offset[0][k & 1];
}

/* Row k: the weights that select channel k. */
static const double channel_selector[GRID_CHANNELS_MAX][GRID_CHANNELS_MAX] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/* Computes the weighted sum of the channels at each corner. */
static void weigh_corners(const float *const corner[8], int channels, const double weight[GRID_CHANNELS_MAX],
			  double v[8])
{
	for (int i = 0; i < 8; i++) {
		v[i] = weight[0] * (double)corner[i][0];
		for (int k = 1; k < channels; k++)
			v[i] += weight[k] * (double)corner[i][k];
	}
}

static double lerp(double t, double a, double b)
{
	return a + t * (b - a);
}

/* x: position in the cell, from 0 to 1. */
static double interpolate(const double c[8], const double x[3])
{
	double low = lerp(x[1], lerp(x[0], c[0], c[1]), lerp(x[0], c[2], c[3])),
	       high = lerp(x[1], lerp(x[0], c[4], c[5]), lerp(x[0], c[6], c[7]));
	return lerp(x[2], low, high);
}

static bool is_inside(const struct grid *g, vec3 p, const double x[3])
{
	if (g->is_world_aligned)
		return p.x >= g->world_min.x && p.y >= g->world_min.y && p.z >= g->world_min.z &&
		       p.x <= g->world_max.x && p.y <= g->world_max.y && p.z <= g->world_max.z;
	for (int i = 0; i < 3; i++)
		if (!(x[i] >= g->cell_min[i] && x[i] <= g->cell_max[i]))
			return false;
	return true;
}

bool grid_eval(const struct grid *g, vec3 p, double value[GRID_CHANNELS_MAX])
{
	vec3 cells = mat4_point(&g->to_cells, p);
	double x[3] = {cells.x, cells.y, cells.z};
	int cell[3];
	bool inside = is_inside(g, p, x);
	for (int k = 0; k < GRID_CHANNELS_MAX; k++)
		value[k] = 0;
	if (!inside && g->wrap == GRID_ZERO)
		return false;
	for (int i = 0; i < 3; i++) {
		x[i] = wrap_coordinate(g->wrap, x[i], g->size[i]);
		cell[i] = (int)floor(x[i]);
		x[i] -= cell[i];
	}
	const float *corner[8];
	find_corners(g, cell, corner);
	for (int k = 0; k < GRID_CHANNELS_MAX; k++) {
		double v[8];
		weigh_corners(corner, g->channels, channel_selector[k < g->channels ? k : 0], v);
		value[k] = interpolate(v, x);
	}
	return inside;
}

/* ---- bricks ---- */

static int brick_count_along(const struct grid *g, int i)
{
	return (int)((unsigned)g->size[i] / GRID_BRICK + 1);
}

size_t grid_brick_count(const struct grid *g)
{
	return (size_t)brick_count_along(g, 0) * (size_t)brick_count_along(g, 1) * (size_t)brick_count_along(g, 2);
}

/* Returns the brick that contains a cell; cell numbers begin at -1. */
static size_t brick_of(const struct grid *g, const int cell[3])
{
	size_t brick[3];
	for (int i = 0; i < 3; i++)
		brick[i] = (unsigned)(cell[i] + 1) / GRID_BRICK;
	return (brick[2] * (size_t)brick_count_along(g, 1) + brick[1]) * (size_t)brick_count_along(g, 0) + brick[0];
}

/* Lists, along axis i, one cell of each brick in which the value of a point counts: the cells before and behind the
 * point, and those at the other end of the grid, in case it repeats. Returns their number. */
static int list_cells_around(const struct grid *g, int i, int point, int cell[3])
{
	int n = 0;
	cell[n++] = point;
	if ((point + 1) % GRID_BRICK == 0)
		cell[n++] = point - 1;
	if (point == 0 || point == g->size[i] - 1)
		cell[n++] = point == 0 ? g->size[i] - 1 : -1;
	return n;
}

void grid_find_occupied_bricks(const struct grid *g, unsigned char *occupied)
{
	const float *v = g->value;
	int x[3], y[3], z[3];
	for (int k = 0; k < g->size[2]; k++) {
		int nz = list_cells_around(g, 2, k, z);
		liveness_tick();
		for (int j = 0; j < g->size[1]; j++) {
			int ny = list_cells_around(g, 1, j, y);
			for (int i = 0; i < g->size[0]; i++, v += g->channels) {
				if (v[0] == 0 && (g->channels == 1 || (v[1] == 0 && v[2] == 0)))
					continue;
				int nx = list_cells_around(g, 0, i, x);
				for (int m = 0; m < nx * ny * nz; m++)
					occupied[brick_of(
						g, (const int[3]){x[m % nx], y[m / nx % ny], z[m / nx / ny]})] = 1;
			}
		}
	}
}

/* ---- rays ---- */

/* Cells that are crossed in one step: a single cell; an empty brick; or, outside the points of a grid whose border
 * values continue, all cells along an axis, since values there change along the other axes only. */
struct cell_block {
	int first[3], last[3];
	bool is_empty, is_wide; /* is_wide: possibly more than one cell */
};

/* The state of a ray on its way through the cells. */
struct grid_walk {
	const struct grid *g;
	double o[3], d[3], inverse_d[3]; /* origin in cells, direction in cells per unit of t, and its inverse */
	double t, t_end;
	int cell[3], end_cell[3], step[3]; /* end_cell: the first cell beyond the box, in the direction of the ray */
	struct cell_block block;	   /* the block that contains `cell` */
	double t_exit[3];		   /* the t at which the ray leaves the block along each axis */
	double corner_area_squared[8]; /* if the grid has an area_matrix: the squared factor at the cell's corners */
};

/* Returns the t at which the ray meets the plane with the given number across axis i. */
static double crossing_of_plane(const struct grid_walk *c, int i, double plane)
{
	return (plane - c->o[i]) * c->inverse_d[i];
}

/* Clips the range of t to the part of the ray o + t d between two planes across an axis; Returns false if no part is
 * left. */
static bool clip_to_slab(struct grid_walk *c, double o, double d, double low, double high)
{
	if (d == 0)
		return o >= low && o <= high;
	double a = (low - o) / d, b = (high - o) / d;
	c->t = fmax(c->t, fmin(a, b));
	c->t_end = fmin(c->t_end, fmax(a, b));
	return c->t < c->t_end;
}

static bool clip_to_box(struct grid_walk *c, const struct grid_ray *r)
{
	const struct grid *g = c->g;
	if (g->is_world_aligned)
		return clip_to_slab(c, r->o.x, r->d.x, g->world_min.x, g->world_max.x) &&
		       clip_to_slab(c, r->o.y, r->d.y, g->world_min.y, g->world_max.y) &&
		       clip_to_slab(c, r->o.z, r->d.z, g->world_min.z, g->world_max.z);
	for (int i = 0; i < 3; i++)
		if (!clip_to_slab(c, c->o[i], c->d[i], g->cell_min[i], g->cell_max[i]))
			return false;
	return true;
}

static void update_exit(struct grid_walk *c, int i)
{
	int plane = c->step[i] > 0 ? c->block.last[i] + 1 : c->block.first[i];
	c->t_exit[i] = c->step[i] ? crossing_of_plane(c, i, plane) : INFINITY;
}

/* Finds the block of a cell that is outside the points or in an empty brick; nearest: the nearest cell inside. */
static void find_wide_block(struct grid_walk *c, const int nearest[3], bool outside)
{
	const struct grid *g = c->g;
	struct cell_block *b = &c->block;
	b->is_empty = !g->occupied_bricks[brick_of(g, nearest)];
	for (int i = 0; i < 3; i++) {
		b->first[i] = b->last[i] = c->cell[i];
		if (c->cell[i] < -1 || nearest[i] < c->cell[i]) {
			bool below = c->cell[i] < 0;
			b->first[i] = below ? (int)floor(g->cell_min[i]) : g->size[i];
			b->last[i] = below ? -1 : (int)ceil(g->cell_max[i]) - 1;
		} else if (b->is_empty && !outside) {
			b->first[i] = (c->cell[i] + 1) / GRID_BRICK * GRID_BRICK - 1;
			b->last[i] = b->first[i] + GRID_BRICK - 1;
		}
		update_exit(c, i);
	}
	b->is_wide = true;
}

/* Updates the block for the new cell. crossed: the axis along which the ray entered; 3: the ray begins in the cell. */
static void enter_cell(struct grid_walk *c, int crossed)
{
	const struct grid *g = c->g;
	struct cell_block *b = &c->block;
	bool outside = false;
	int nearest[3];
	for (int i = 0; i < 3; i++) {
		int last = g->size[i] - 1, x = c->cell[i];
		nearest[i] = x < -1 ? -1 : x > last ? last : x;
		outside = outside || nearest[i] != x;
	}
	if (outside || !g->occupied_bricks[brick_of(g, nearest)]) {
		find_wide_block(c, nearest, outside);
		return;
	}
	bool all_axes = b->is_wide || crossed == 3;
	b->is_empty = b->is_wide = false;
	for (int i = 0; i < 3; i++)
		if (all_axes || i == crossed) {
			b->first[i] = b->last[i] = c->cell[i];
			update_exit(c, i);
		}
}

/* Returns the axis along which the ray leaves the block first. */
static int exit_axis(const struct grid_walk *c)
{
	int axis = c->t_exit[1] < c->t_exit[0] ? 1 : 0;
	return c->t_exit[2] < c->t_exit[axis] ? 2 : axis;
}

/* Advances to the next block. Returns false at the end of the ray or of the box. */
static bool advance(struct grid_walk *c, int axis)
{
	const struct cell_block *b = &c->block;
	if (!(c->t_exit[axis] < c->t_end))
		return false;
	c->t = c->t_exit[axis];
	for (int i = 0; i < 3 && b->is_wide; i++) {
		double x = floor(c->o[i] + c->t * c->d[i]);
		c->cell[i] = x < b->last[i] ? (x > b->first[i] ? (int)x : b->first[i]) : b->last[i];
	}
	c->cell[axis] = c->step[axis] > 0 ? b->last[axis] + 1 : b->first[axis] - 1;
	if (c->step[axis] > 0 ? c->cell[axis] >= c->end_cell[axis] : c->cell[axis] <= c->end_cell[axis])
		return false;
	enter_cell(c, axis);
	return true;
}

/* Returns d, or 0 if its inverse overflows. */
static double flush_tiny(double d)
{
	return fabs(d) >= DBL_MIN ? d : 0;
}

static bool begin_walk(struct grid_walk *c, const struct grid *g, const struct grid_ray *r)
{
	vec3 o = mat4_point(&g->to_cells, r->o), d = mat4_vector(&g->to_cells, r->d);
	*c = (struct grid_walk){.g = g,
				.o = {o.x, o.y, o.z},
				.d = {flush_tiny(d.x), flush_tiny(d.y), flush_tiny(d.z)},
				.t = r->t0,
				.t_end = r->t1};
	if (!vec3_is_finite(vec3_add(o, d)) || !clip_to_box(c, r) || !isfinite(c->t_end))
		return false;
	for (int i = 0; i < 3; i++) {
		c->inverse_d[i] = c->d[i] != 0 ? 1 / c->d[i] : 0;
		int first = (int)floor(g->cell_min[i]), last = (int)ceil(g->cell_max[i]) - 1;
		double x = c->o[i] + c->t * c->d[i];
		c->cell[i] = x < last ? (x > first ? (int)floor(x) : first) : last;
		c->step[i] = c->d[i] > 0 ? 1 : c->d[i] < 0 ? -1 : 0;
		c->end_cell[i] = c->d[i] > 0 ? last + 1 : first - 1;
	}
	enter_cell(c, 3);
	return true;
}

static double value_at(const struct grid_walk *c, const double corner[8], double t)
{
	double x[3];
	for (int i = 0; i < 3; i++)
		x[i] = c->o[i] + t * c->d[i] - c->cell[i];
	double value = interpolate(corner, x);
	return c->g->area_matrix ? value * sqrt(fmax(interpolate(c->corner_area_squared, x), 0)) : value;
}

/* Integrates values times the factor by Gauss's rule with eight points. The factor is the square root of a cubic
 * polynomial: the relative error is 1e-9 where it changes by half within a cell, and 1e-4 at worst, where it falls to
 * 0. */
static double integral_with_area(const struct grid_walk *c, const double corner[8], double a, double b)
{
	static const double abscissa[] = {0.18343464249564980, 0.52553240991632899, 0.79666647741362674,
					  0.96028985649753623},
			    weight[] = {0.36268378337836198, 0.31370664587788729, 0.22238103445337447,
					0.10122853629037626};
	double half = (b - a) / 2, middle = a + half, sum = 0;
	for (int i = 0; i < 4; i++)
		sum += weight[i] * (value_at(c, corner, middle - abscissa[i] * half) +
				    value_at(c, corner, middle + abscissa[i] * half));
	return half * sum;
}

/* Returns the integral over t from a to b within the current cell. */
static double integral(const struct grid_walk *c, const double corner[8], double a, double b)
{
	static const double gauss = 0.57735026918962576; /* 1 / sqrt 3 */
	if (c->g->area_matrix)
		return integral_with_area(c, corner, a, b);
	double half = (b - a) / 2, middle = a + half;
	return half * (value_at(c, corner, middle - gauss * half) + value_at(c, corner, middle + gauss * half));
}

/* Computes the squared factor at the cell's corners. d: direction of the ray in the world. */
static void compute_corner_area(struct grid_walk *c, vec3 d)
{
	const float *even[8], *mixed[8];
	find_corners(&c->g->area_matrix[0], c->cell, even);
	find_corners(&c->g->area_matrix[1], c->cell, mixed);
	const double squares[] = {d.x * d.x, d.y * d.y, d.z * d.z},
		     products[] = {2 * d.x * d.y, 2 * d.x * d.z, 2 * d.y * d.z};
	for (int k = 0; k < 8; k++) {
		c->corner_area_squared[k] = 0;
		for (int i = 0; i < 3; i++)
			c->corner_area_squared[k] +=
				squares[i] * (double)even[k][i] + products[i] * (double)mixed[k][i];
	}
}

/* Computes the integral of each channel over the cell, from the current t to `t_end`. */
static void integrate_cell(const struct grid_walk *c, const float *const corner[8], double t_end,
			   double part[GRID_CHANNELS_MAX])
{
	for (int k = 0; k < c->g->channels; k++) {
		double v[8];
		bool empty = true;
		for (int i = 0; i < 8; i++) {
			v[i] = (double)corner[i][k];
			empty = empty && v[i] == 0;
		}
		part[k] = empty ? 0 : integral(c, v, c->t, t_end);
	}
}

/* Returns the t in [a,b] at which the integral from a reaches `target`, which is at most the integral up to b. */
static double invert_in_cell(const struct grid_walk *c, const double corner[8], double a, double b, double target)
{
	enum { STEPS_MAX = 100 };
	double low = a, high = b, t = a + (b - a) / 2;
	for (int i = 0; i < STEPS_MAX; i++) {
		double excess = integral(c, corner, a, t) - target;
		if (excess < 0)
			low = t;
		else
			high = t;
		double slope = value_at(c, corner, t), next = slope > 0 ? t - excess / slope : low;
		if (!(next > low && next < high))
			next = low + (high - low) / 2;
		if (next == t || next == low || next == high)
			break;
		t = next;
	}
	return t;
}

double grid_invert_integral(const struct grid *g, const struct grid_ray *r, const double weight[GRID_CHANNELS_MAX],
			    double target, double sum[GRID_CHANNELS_MAX])
{
	struct grid_walk c;
	int axis;
	for (int k = 0; k < GRID_CHANNELS_MAX; k++)
		sum[k] = 0;
	if (!begin_walk(&c, g, r))
		return INFINITY;
	do {
		axis = exit_axis(&c);
		double end = fmin(c.t_exit[axis], c.t_end), part[GRID_CHANNELS_MAX], cell_integral = 0;
		const float *corner[8];
		if (!(end > c.t) || c.block.is_empty)
			continue;
		find_corners(g, c.cell, corner);
		if (g->area_matrix)
			compute_corner_area(&c, r->d);
		integrate_cell(&c, corner, end, part);
		for (int k = 0; k < g->channels; k++)
			cell_integral += weight[k] * part[k];
		bool is_reached = cell_integral >= target && cell_integral > 0;
		if (is_reached) {
			double v[8];
			weigh_corners(corner, g->channels, weight, v);
			end = invert_in_cell(&c, v, c.t, end, target);
			integrate_cell(&c, corner, end, part);
		}
		for (int k = 0; k < g->channels; k++)
			sum[k] += part[k];
		if (is_reached)
			return end;
		target -= cell_integral;
	} while (advance(&c, axis));
	return INFINITY;
}

void grid_integrate(const struct grid *g, const struct grid_ray *r, double sum[GRID_CHANNELS_MAX])
{
	static const double zero_weights[GRID_CHANNELS_MAX];
	grid_invert_integral(g, r, zero_weights, INFINITY, sum);
}
