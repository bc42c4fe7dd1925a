/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/displace_grid.h"

#include <stdlib.h>

struct position {
	double p[3];
	uint32_t vertex;
};

static int compare_coordinates(const struct position *a, const struct position *b)
{
	for (int k = 0; k < 3; k++)
		if (a->p[k] != b->p[k])
			return a->p[k] < b->p[k] ? -1 : 1;
	return 0;
}

static int compare_positions(const void *a, const void *b)
{
	const struct position *x = a, *y = b;
	int order = compare_coordinates(x, y);
	return order ? order : x->vertex < y->vertex ? -1 : x->vertex > y->vertex;
}

static bool weld_positions(struct displace_grid *g, const struct mesh *base, struct arena *arena)
{
	uint32_t n = base->vertex_count;
	struct position *sorted = arena_alloc(arena, n, sizeof *sorted);
	g->place = arena_alloc(arena, n, sizeof *g->place);
	if (!sorted || !g->place)
		return false;
	for (uint32_t i = 0; i < n; i++) {
		const double *p = base->position[i];
		sorted[i] = (struct position){{p[0], p[1], p[2]}, i};
	}
	qsort(sorted, n, sizeof *sorted, compare_positions);
	for (uint32_t i = 0; i < n; i++) {
		g->base_place_count += i == 0 || compare_coordinates(&sorted[i - 1], &sorted[i]) != 0;
		g->place[sorted[i].vertex] = g->base_place_count - 1;
	}
	return true;
}

/* The edge of a triangle's side: its two places in ascending order, then the vertices there. */
struct edge {
	uint32_t ends[4];
	uint32_t side;
	bool is_reversed;
};

static int compare_ends(const struct edge *a, const struct edge *b, int count)
{
	for (int k = 0; k < count; k++)
		if (a->ends[k] != b->ends[k])
			return a->ends[k] < b->ends[k] ? -1 : 1;
	return 0;
}

static int compare_edges(const void *a, const void *b)
{
	const struct edge *x = a, *y = b;
	int order = compare_ends(x, y, 4);
	return order ? order : x->side < y->side ? -1 : x->side > y->side;
}

static bool number_edges(struct displace_grid *g, const struct mesh *base, struct arena *arena)
{
	size_t n = 3 * (size_t)base->triangle_count;
	struct edge *sorted = arena_alloc(arena, n, sizeof *sorted);
	g->side = arena_alloc(arena, n, sizeof *g->side);
	if (!sorted || !g->side)
		return false;
	for (size_t s = 0; s < n; s++) {
		uint32_t a = base->index[s / 3][s % 3], b = base->index[s / 3][(s + 1) % 3];
		bool backwards = g->place[a] > g->place[b];
		uint32_t from = backwards ? b : a, to = backwards ? a : b;
		sorted[s] = (struct edge){{g->place[from], g->place[to], from, to}, (uint32_t)s, backwards};
	}
	qsort(sorted, n, sizeof *sorted, compare_edges);
	for (size_t s = 0; s < n; s++) {
		g->place_edge_count += s == 0 || compare_ends(&sorted[s - 1], &sorted[s], 2) != 0;
		g->vertex_edge_count += s == 0 || compare_ends(&sorted[s - 1], &sorted[s], 4) != 0;
		g->side[sorted[s].side] = (struct displace_side){g->vertex_edge_count - 1, g->place_edge_count - 1,
								 sorted[s].is_reversed};
	}
	return true;
}

bool displace_grid_init(struct displace_grid *g, const struct mesh *base, uint32_t parts, struct arena *arena)
{
	*g = (struct displace_grid){.parts_per_edge = parts,
				    .base_vertex_count = base->vertex_count,
				    .index = (const uint32_t(*)[3])base->index};
	if (!weld_positions(g, base, arena) || (parts > 1 && !number_edges(g, base, arena)))
		return false;
	uint64_t points_per_edge = parts - 1, points_per_triangle = parts > 2 ? points_per_edge * (parts - 2) / 2 : 0;
	g->border_vertex_count = base->vertex_count + g->vertex_edge_count * points_per_edge;
	g->vertex_count = g->border_vertex_count + base->triangle_count * points_per_triangle;
	g->place_count = g->base_place_count + g->place_edge_count * points_per_edge;
	return true;
}

static struct displace_point point_on_side(const struct displace_grid *g, uint32_t triangle, uint32_t k, uint32_t step)
{
	const struct displace_side *s = &g->side[3 * (size_t)triangle + k];
	uint32_t inner = g->parts_per_edge - 1, offset = (s->is_reversed ? g->parts_per_edge - step : step) - 1;
	return (struct displace_point){g->base_vertex_count + s->vertex_edge * inner + offset,
				       g->base_place_count + s->place_edge * inner + offset, false};
}

struct displace_point displace_grid_point(const struct displace_grid *g, uint32_t triangle, uint32_t i, uint32_t j)
{
	uint32_t n = g->parts_per_edge, corner = i == n ? 1 : j == n ? 2 : 0;
	if (corner || i + j == 0) {
		uint32_t v = g->index[triangle][corner];
		return (struct displace_point){v, g->place[v], false};
	}
	if (j == 0)
		return point_on_side(g, triangle, 0, i);
	if (i + j == n)
		return point_on_side(g, triangle, 1, j);
	if (i == 0)
		return point_on_side(g, triangle, 2, n - j);
	/* Row i has n - 1 - i points inside the triangle; those of earlier rows come first. */
	uint64_t points_in_earlier_rows = (uint64_t)(i - 1) * (2 * n - 2 - i) / 2,
		 points_per_triangle = (uint64_t)(n - 1) * (n - 2) / 2;
	return (struct displace_point){
		(uint32_t)(g->border_vertex_count + triangle * points_per_triangle + points_in_earlier_rows + j - 1), 0,
		true};
}
