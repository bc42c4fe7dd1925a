/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/displace_grid.h"

#include <stdlib.h>

struct position {
	double p[3];
	uint32_t vertex;
};

static int compare_places(const struct position *a, const struct position *b)
{
	for (int k = 0; k < 3; k++)
		if (a->p[k] != b->p[k])
			return a->p[k] < b->p[k] ? -1 : 1;
	return 0;
}

static int compare_positions(const void *a, const void *b)
{
	const struct position *x = a, *y = b;
	int order = compare_places(x, y);
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
		g->base_places += i == 0 || compare_places(&sorted[i - 1], &sorted[i]) != 0;
		g->place[sorted[i].vertex] = g->base_places - 1;
	}
	return true;
}

/* The edge of a triangle's side: its two places in ascending order, then the vertices there. */
struct edge {
	uint32_t end[4];
	uint32_t side;
	bool backwards;
};

static int compare_ends(const struct edge *a, const struct edge *b, int count)
{
	for (int k = 0; k < count; k++)
		if (a->end[k] != b->end[k])
			return a->end[k] < b->end[k] ? -1 : 1;
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
		g->place_edges += s == 0 || compare_ends(&sorted[s - 1], &sorted[s], 2) != 0;
		g->vertex_edges += s == 0 || compare_ends(&sorted[s - 1], &sorted[s], 4) != 0;
		g->side[sorted[s].side] =
			(struct displace_side){g->vertex_edges - 1, g->place_edges - 1, sorted[s].backwards};
	}
	return true;
}

bool displace_grid_init(struct displace_grid *g, const struct mesh *base, uint32_t parts, struct arena *arena)
{
	*g = (struct displace_grid){
		.parts = parts, .base_vertices = base->vertex_count, .index = (const uint32_t(*)[3])base->index};
	if (!weld_positions(g, base, arena) || (parts > 1 && !number_edges(g, base, arena)))
		return false;
	uint64_t inner = parts - 1, inside = parts > 2 ? inner * (parts - 2) / 2 : 0;
	g->border = base->vertex_count + g->vertex_edges * inner;
	g->vertices = g->border + base->triangle_count * inside;
	g->places = g->base_places + g->place_edges * inner;
	return true;
}

static struct displace_point on_side(const struct displace_grid *g, uint32_t triangle, uint32_t k, uint32_t step)
{
	const struct displace_side *s = &g->side[3 * (size_t)triangle + k];
	uint32_t inner = g->parts - 1, at = (s->backwards ? g->parts - step : step) - 1;
	return (struct displace_point){g->base_vertices + s->vertices * inner + at,
				       g->base_places + s->places * inner + at, false};
}

struct displace_point displace_grid_at(const struct displace_grid *g, uint32_t triangle, uint32_t i, uint32_t j)
{
	uint32_t n = g->parts, corner = i == n ? 1 : j == n ? 2 : 0;
	if (corner || i + j == 0) {
		uint32_t v = g->index[triangle][corner];
		return (struct displace_point){v, g->place[v], false};
	}
	if (j == 0)
		return on_side(g, triangle, 0, i);
	if (i + j == n)
		return on_side(g, triangle, 1, j);
	if (i == 0)
		return on_side(g, triangle, 2, n - j);
	/* Row i has n - 1 - i points inside the triangle; those of earlier rows come first. */
	uint64_t before = (uint64_t)(i - 1) * (2 * n - 2 - i) / 2, inside = (uint64_t)(n - 1) * (n - 2) / 2;
	return (struct displace_point){(uint32_t)(g->border + triangle * inside + before + j - 1), 0, true};
}
