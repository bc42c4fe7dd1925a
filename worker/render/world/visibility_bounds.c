/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds shapes inside closed opaque ones, first by their boxes, then by planes; and scenes in which nothing emits.
 *
 * Shapes are sorted by where they start along x, so that for each container only those between its ends are examined.
 * Those whose boxes are inside the container's box are compared with each of its planes. Nothing fails: a shape counts
 * as visible if the opposite cannot be proved, for example if it moves or if the camera may be inside the container;
 * that costs time but loses no light.
 */
#include "worker/render/world/visibility_bounds.h"

#include "worker/render/geom/curves.h"
#include "worker/render/world/displacement.h"
#include "worker/render/world/world_origin.h"

#include <stdlib.h>
#include <string.h>

/* Shapes count as apart at this distance, in scene radii; floats have a precision of 2^-24. */
#define MARGIN 0x1p-16
static vec3 load_vertex(const struct geom_shape *g, uint32_t i)
{
	vec3 p = triangle_vertex((const float(*)[3])g->position, i);
	return g->placement ? placement_point(g->placement, p) : p;
}

/* Returns the unit normal of a triangle's plane, and its height over the origin. */
static vec3 triangle_plane(const struct geom_shape *g, uint32_t triangle, double *height)
{
	const uint32_t *t = g->index[triangle];
	vec3 v0 = load_vertex(g, t[0]);
	vec3 n = vec3_normalize(vec3_cross(vec3_sub(load_vertex(g, t[1]), v0), vec3_sub(load_vertex(g, t[2]), v0)));
	*height = vec3_dot(n, v0);
	return n;
}

/* Computes the smallest and the largest n.p over a shape. */
static void extent_along(const struct geom_shape *g, vec3 n, double *low, double *high)
{
	if (g->is_sphere) {
		*low = vec3_dot(n, g->center) - g->radius;
		*high = vec3_dot(n, g->center) + g->radius;
		return;
	}
	*low = INFINITY;
	*high = -INFINITY;
	for (uint32_t i = 0; g->curves && i < g->curves->point_count; i++) {
		double h = vec3_dot(n, curves_center(g->curves, i)), r = (double)g->curves->points[i][3];
		*low = fmin(*low, h - r);
		*high = fmax(*high, h + r);
	}
	for (uint32_t i = 0; i < g->triangle_count; i++)
		for (int k = 0; k < 3; k++) {
			double h = vec3_dot(n, load_vertex(g, g->index[i][k]));
			*low = fmin(*low, h);
			*high = fmax(*high, h);
		}
}

static double farthest_distance(const struct geom_shape *g, vec3 from)
{
	if (g->is_sphere)
		return vec3_length(vec3_sub(g->center, from)) + g->radius;
	double max_distance2 = 0, max_distance = 0;
	for (uint32_t i = 0; g->curves && i < g->curves->point_count; i++)
		max_distance = fmax(max_distance, vec3_length(vec3_sub(curves_center(g->curves, i), from)) +
							  (double)g->curves->points[i][3]);
	for (uint32_t i = 0; i < g->triangle_count; i++)
		for (int k = 0; k < 3; k++) {
			vec3 d = vec3_sub(load_vertex(g, g->index[i][k]), from);
			max_distance2 = fmax(max_distance2, vec3_dot(d, d));
		}
	return fmax(max_distance, sqrt(max_distance2));
}

/* Whether a shape is known to be convex, closed and opaque. An ellipsoid is, too, but it is a mesh whose triangles
 * would have to be checked one by one. */
static bool is_container(const struct world *w, const struct scene_node *node, uint32_t shape)
{
	const struct geom_shape *g = &w->shapes[shape];
	bool convex = strcmp(node->type, "cube") == 0 || g->is_sphere;
	return convex && !surface_is_moving(g) && !displacement_property(node) &&
	       !(w->bsdfs[w->shape_bindings[shape].bsdf].modes & BSDF_TRANSMIT);
}

/* Whether no camera path can start inside the shape: all of it is beyond the near plane, or behind the
 * camera and its aperture. */
static bool camera_is_outside(const struct world *w, const struct geom_shape *g)
{
	const struct camera *c = &w->camera;
	double low, high, camera_height = vec3_dot(c->axes.n, c->position);
	if (c->motion)
		return false;
	extent_along(g, c->axes.n, &low, &high);
	return low > camera_height + c->near_clip + MARGIN || high < camera_height - MARGIN;
}

static bool contains(const struct geom_shape *outer, const struct geom_shape *inner)
{
	if (outer->is_sphere)
		return farthest_distance(inner, outer->center) < outer->radius - MARGIN;
	for (uint32_t i = 0; i < outer->triangle_count; i++) {
		double height, unused, low, high, inner_low, inner_high;
		vec3 n = triangle_plane(outer, i, &height);
		extent_along(outer, n, &low, &high);
		/* A convex shape lies on one side of the plane of each of its triangles. */
		if (high > height + MARGIN)
			n = vec3_neg(n), height = -height;
		extent_along(inner, n, &inner_low, &inner_high);
		extent_along(outer, n, &unused, &high);
		if (high > height + MARGIN || inner_high > height - MARGIN)
			return false;
	}
	return true;
}

static bool box_contains(const struct box *outer, const struct box *inner)
{
	return inner->min.x >= outer->min.x && inner->max.x <= outer->max.x && inner->min.y >= outer->min.y &&
	       inner->max.y <= outer->max.y && inner->min.z >= outer->min.z && inner->max.z <= outer->max.z;
}

/* Returns the index of the first of n sorted numbers that is not below x. */
static uint32_t find_lower_bound(const struct weighted_value *sorted, uint32_t n, double x)
{
	uint32_t low = 0, high = n;
	while (low < high) {
		uint32_t middle = low + (high - low) / 2;
		if (sorted[middle].value < x)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

/* Finds enclosed shapes. Only shapes that start between a container's ends along x and whose boxes are inside its
 * box are checked closely. */
static void find_enclosed(const struct world *w, const struct effects_source *src, enum visibility *shape)
{
	struct weighted_value *by_x = src->scratch;
	uint32_t n = w->shape_count;
	for (uint32_t i = 0; i < n; i++)
		by_x[i] = (struct weighted_value){src->boxes[i].min.x, i};
	if (n > 0)
		qsort(by_x, n, sizeof *by_x, weighted_value_compare);
	for (uint32_t o = 0; o < n; o++) {
		const struct box *outer = &src->boxes[o];
		if (!is_container(w, src->shape_nodes[o], o) || !camera_is_outside(w, &w->shapes[o]))
			continue;
		for (uint32_t k = find_lower_bound(by_x, n, outer->min.x); k < n && by_x[k].value <= outer->max.x;
		     k++) {
			uint32_t i = (uint32_t)by_x[k].weight;
			if (i != o && shape[i] == VISIBILITY_VISIBLE && !surface_is_moving(&w->shapes[i]) &&
			    box_contains(outer, &src->boxes[i]) && contains(&w->shapes[o], &w->shapes[i]))
				shape[i] = VISIBILITY_ENCLOSED;
		}
	}
}

bool visibility_bounds_see_emitter(const struct world *w, const enum visibility *shape, uint32_t emitter)
{
	uint32_t surface = w->emitter_shapes[emitter];
	return w->emitters[emitter].power > 0 && (surface == UINT32_MAX || shape[surface] != VISIBILITY_ENCLOSED);
}

void visibility_bounds_shapes(const struct world *w, const struct effects_source *src, uint32_t max_depth,
			      enum visibility *shape)
{
	for (uint32_t i = 0; i < w->shape_count; i++)
		shape[i] = VISIBILITY_VISIBLE;
	find_enclosed(w, src, shape);
	bool dark = true;
	bool media_scatter = false; /* then faces that are not vertices let light through, whatever the depth */
	for (uint32_t i = 0; i < w->emitter_count; i++)
		dark &= !visibility_bounds_see_emitter(w, shape, i);
	for (uint32_t i = 0; i < w->media_count; i++) {
		if (w->media[i].is_emissive)
			return;
		media_scatter |= w->media[i].is_scattering;
	}
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (shape[i] == VISIBILITY_VISIBLE && (dark || (max_depth <= 1 && !media_scatter)))
			shape[i] = dark ? VISIBILITY_DARK : VISIBILITY_TOO_SHORT;
}

static struct triangle triangle_at(const struct geom_shape *g, uint32_t i)
{
	const float(*p)[3] = (const float(*)[3])g->position;
	return g->placement ? placement_triangle(g->placement, p, g->index[i]) : triangle_from(p, g->index[i]);
}

static bool lies_in_plane(const struct triangle *plane, const struct geom_shape *g)
{
	for (uint32_t i = 0; i < g->triangle_count; i++)
		for (int k = 0; k < 3; k++)
			if (triangle_height(plane, load_vertex(g, g->index[i][k])) != 0)
				return false;
	return true;
}

uint32_t visibility_bounds_depth(const struct world *w, const enum visibility *shape)
{
	bool has_plane = false;
	struct triangle plane;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct geom_shape *g = &w->shapes[i];
		if (shape[i] != VISIBILITY_VISIBLE || w->bsdfs[w->shape_bindings[i].bsdf].is_black)
			continue;
		if (g->is_sphere || g->curves || surface_is_moving(g))
			return UINT32_MAX;
		if (!has_plane)
			plane = triangle_at(g, 0);
		has_plane = true;
		if (!lies_in_plane(&plane, g))
			return UINT32_MAX;
	}
	return has_plane ? 2 : 1;
}
