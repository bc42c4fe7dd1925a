/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Spreads points over refracting surfaces by systematic sampling: the areas of all primitives are laid end to end, and
 * a point falls on each multiple of a step. A low-discrepancy sequence gives the position on the triangle or sphere, so
 * that the points on a large triangle are spread, too. Of meshes with many triangles, only every n-th one is used and
 * stands for its neighbours.
 */
#include "worker/render/world/refracting.h"

#include "worker/render/world/world.h"

#include <errno.h>

enum {
	POINTS_MAX = 128,
	TRIANGLES_MAX = 1 << 16,     /* most triangles that are used of all meshes together */
	MESH_TRIANGLES_MIN = 1 << 4, /* fewest triangles that are used of each mesh */
};

/* State of the systematic sampling. */
struct area_sampling {
	struct world *w;
	/* area: total area passed so far; step: area between two points, or 0 to only sum the areas. */
	double area, step;
	uint32_t max_triangles; /* most triangles that are used of a mesh */
};

static double triangle_area(const struct geom_shape *s, struct prim_ref prim)
{
	struct surface_point corner[3];
	for (int k = 0; k < 3; k++)
		surface_on_triangle(s, prim, k == 1, k == 2, &corner[k]);
	return vec3_length(vec3_cross(vec3_sub(corner[1].p, corner[0].p), vec3_sub(corner[2].p, corner[0].p))) / 2;
}

/* Returns the k-th number of Weyl's sequence for that irrational. */
static double weyl(uint32_t k, double irrational)
{
	double x = (k + 0.5) * irrational;
	return x - floor(x);
}

/* Returns the k-th point, placed on the primitive. The two irrationals are those of Roberts:
 * powers of the plastic number. */
static struct surface_point point_on(const struct geom_shape *s, struct prim_ref prim, uint32_t k)
{
	struct surface_point x;
	double u = weyl(k, 0.7548776662466927), v = weyl(k, 0.5698402909980532);
	if (s->is_sphere) {
		double z = 1 - 2 * u, r = sqrt(fmax(0, 1 - z * z));
		surface_on_sphere(s, prim, (vec3){r * cos(2 * M_PI * v), r * sin(2 * M_PI * v), z}, &x);
	} else {
		bool fold = u + v > 1;
		surface_on_triangle(s, prim, fold ? 1 - u : u, fold ? 1 - v : v, &x);
	}
	return x;
}

static void place_points(struct area_sampling *s, double area, struct prim_ref prim)
{
	struct world *w = s->w;
	s->area += area;
	if (!(s->step > 0))
		return;
	while (w->refracting_point_count < POINTS_MAX && (w->refracting_point_count + 0.5) * s->step < s->area) {
		struct refracting_point *point = &w->refracting_points[w->refracting_point_count];
		struct surface_point x = point_on(&w->shapes[prim.shape], prim, w->refracting_point_count);
		double eta = w->bsdfs[w->shape_bindings[prim.shape].bsdf].eta;
		*point = (struct refracting_point){x.p, eta < 1 ? vec3_neg(x.ng) : x.ng, fmax(eta, 1 / eta)};
		w->refracting_point_count++;
	}
}

static void sample_shape(struct area_sampling *s, uint32_t i)
{
	const struct geom_shape *g = &s->w->shapes[i];
	struct prim_ref prim = {i, 0, 0.5};
	if (g->is_sphere) {
		place_points(s, 4 * M_PI * g->radius * g->radius, prim);
		return;
	}
	const uint32_t stride = 1 + (g->triangle_count > 0 ? (g->triangle_count - 1) / s->max_triangles : 0);
	for (prim.prim = stride / 2; prim.prim < g->triangle_count; prim.prim += stride)
		place_points(s, stride * triangle_area(g, prim), prim);
}

static bool is_refracting(const struct world *w, uint32_t shape)
{
	return !w->shapes[shape].curves && bsdf_refracts_connections(&w->bsdfs[w->shape_bindings[shape].bsdf]);
}

static void sample_all_shapes(struct area_sampling *s)
{
	s->area = 0;
	for (uint32_t i = 0; i < s->w->shape_count; i++)
		if (is_refracting(s->w, i))
			sample_shape(s, i);
}

int refracting_points_make(struct world *w)
{
	struct area_sampling s = {.w = w, .step = 0};
	uint32_t shapes = 0;
	for (uint32_t i = 0; i < w->shape_count; i++)
		shapes += is_refracting(w, i);
	if (!shapes)
		return 0;
	s.max_triangles = TRIANGLES_MAX / shapes > MESH_TRIANGLES_MIN ? TRIANGLES_MAX / shapes : MESH_TRIANGLES_MIN;
	sample_all_shapes(&s);
	if (!(s.area > 0))
		return 0;
	w->refracting_points = arena_alloc(&w->arena, POINTS_MAX, sizeof *w->refracting_points);
	if (!w->refracting_points)
		return -ENOMEM;
	s.step = s.area / POINTS_MAX;
	sample_all_shapes(&s);
	return 0;
}

/* Whether z lies in the denser medium behind q. */
static inline bool is_behind(const struct refracting_point *q, vec3 z)
{
	return vec3_dot(vec3_sub(q->p, z), q->n) > 0;
}

static const struct refracting_point *find_nearest(const struct world *w, vec3 z)
{
	const struct refracting_point *best = NULL;
	double min_distance2 = INFINITY;
	for (uint32_t i = 0; i < w->refracting_point_count; i++) {
		vec3 d = vec3_sub(w->refracting_points[i].p, z);
		double distance2 = vec3_dot(d, d);
		if (distance2 < min_distance2) {
			min_distance2 = distance2;
			best = &w->refracting_points[i];
		}
	}
	return best;
}

/* Returns the optical length of the path from z through q to the light; for light from infinity up to a constant. */
static double optical_path(const struct refracting_point *q, vec3 z, const struct refracting_light *light)
{
	vec3 d = vec3_sub(q->p, z);
	double inside = q->eta * vec3_length(d);
	return light->is_infinite ? inside - vec3_dot(d, light->position)
				  : inside + vec3_length(vec3_sub(light->position, q->p));
}

uint32_t refracting_points_rank(const struct world *w, vec3 z, const struct refracting_light *light,
				const struct refracting_point *out[REFRACTING_POINTS_RANKED])
{
	double lengths[REFRACTING_POINTS_RANKED];
	uint32_t count = 0;
	const struct refracting_point *nearest = find_nearest(w, z);
	if (!nearest || !is_behind(nearest, z))
		return 0;
	for (uint32_t i = 0; i < w->refracting_point_count; i++) {
		const struct refracting_point *q = &w->refracting_points[i];
		double length = is_behind(q, z) ? optical_path(q, z, light) : INFINITY;
		if (!(length < (count < REFRACTING_POINTS_RANKED ? INFINITY : lengths[count - 1])))
			continue;
		uint32_t slot = count < REFRACTING_POINTS_RANKED ? count++ : count - 1;
		for (; slot > 0 && length < lengths[slot - 1]; slot--) {
			lengths[slot] = lengths[slot - 1];
			out[slot] = out[slot - 1];
		}
		lengths[slot] = length;
		out[slot] = q;
	}
	return count;
}
