/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes chains and meshes from control points. The chain of a linear curve is its control points. That of a spline has
 * points where a tube would have rings, but with a coarser tolerance: a chain has smooth normals and no sides, so that
 * only its outline is approximate.
 *
 * Fails if memory is out, or if there are too many points or triangles.
 */
#include "worker/render/shape/curve.h"

#include "common/base/liveness.h"
#include "worker/render/shape/spline.h"
#include "worker/render/shape/tube.h"

enum { CHAIN_POINTS_MAX = 1 << 28 };
/* Tolerances in units of the radius. */
static const double chain_tolerance = 0.05, tube_tolerance = 0.02;

/* Returns the number of pieces before curve i; for i = c->curve_count, of all pieces. */
static uint32_t pieces_before(const struct curve *c, uint32_t i)
{
	return c->first_point[i] - (c->is_spline ? SPLINE_POINTS - 1 : 1) * i;
}

static int add_rings(const struct curve *c, uint32_t i, struct list *rings, double tolerance)
{
	double step = 1.0 / pieces_before(c, c->curve_count), v = step * pieces_before(c, i);
	const double(*points)[4] = c->point + c->first_point[i];
	uint32_t count = c->first_point[i + 1] - c->first_point[i];
	return c->is_spline ? spline_add_rings(rings, points, count, tolerance, v, step)
			    : tube_add_chain(rings, points, count, v, step);
}

static int add_chain_point(struct list *points, const struct chain_point *p)
{
	struct chain_point *new = list_push(points);
	if (!new)
		return -ENOMEM;
	*new = *p;
	return 0;
}

static int make_linear_chain(const struct curve *c, uint32_t i, struct list *points)
{
	double pieces = pieces_before(c, c->curve_count);
	int rc = 0;
	for (uint32_t k = c->first_point[i]; k < c->first_point[i + 1] && !rc; k++)
		rc = add_chain_point(
			points,
			&(struct chain_point){vec3_load(c->point[k]), {0, 0, 0}, c->point[k][3], (k - i) / pieces});
	return rc;
}

static int make_spline_chain(const struct curve *c, uint32_t i, struct list *points)
{
	struct list rings = {.item_size = sizeof(struct tube_ring)};
	int rc = add_rings(c, i, &rings, chain_tolerance);
	const struct tube_ring *r = rings.items;
	for (size_t k = 0; k < rings.count && !rc; k++)
		rc = add_chain_point(points, &(struct chain_point){r[k].center, r[k].axis, r[k].radius, r[k].v});
	list_fini(&rings);
	return rc;
}

int curve_make_chain(const struct curve *c, uint32_t i, struct list *points)
{
	points->count = 0;
	liveness_tick();
	return c->is_spline ? make_spline_chain(c, i, points) : make_linear_chain(c, i, points);
}

static void extend_bounds(struct curve *c, const struct chain_point *p)
{
	double r = p->radius;
	vec3 q = p->center;
	c->box_min = (vec3){fmin(c->box_min.x, q.x - r), fmin(c->box_min.y, q.y - r), fmin(c->box_min.z, q.z - r)};
	c->box_max = (vec3){fmax(c->box_max.x, q.x + r), fmax(c->box_max.y, q.y + r), fmax(c->box_max.z, q.z + r)};
	c->max_radius = fmax(c->max_radius, r);
}

int curve_measure(struct curve *c)
{
	struct list points = {.item_size = sizeof(struct chain_point)};
	uint64_t sum = 0;
	int rc = 0;
	c->box_min = (vec3){INFINITY, INFINITY, INFINITY};
	c->box_max = vec3_neg(c->box_min);
	c->max_radius = 0;
	for (uint32_t i = 0; i < c->curve_count && !rc; i++) {
		rc = curve_make_chain(c, i, &points);
		for (size_t k = 0; k < points.count && !rc; k++)
			extend_bounds(c, (const struct chain_point *)points.items + k);
		sum += points.count;
		if (!rc && sum > CHAIN_POINTS_MAX)
			rc = -EFBIG;
	}
	c->chain_point_count = (uint32_t)sum;
	list_fini(&points);
	return rc;
}

int curve_make_mesh(const struct curve *c, struct arena *arena, struct mesh *out)
{
	struct list rings = {.item_size = sizeof(struct tube_ring)};
	int rc = 0;
	for (uint32_t i = 0; i < c->curve_count && !rc; i++)
		rc = add_rings(c, i, &rings, tube_tolerance);
	if (!rc)
		rc = tube_make_mesh(&rings, arena, out);
	list_fini(&rings);
	return rc;
}
