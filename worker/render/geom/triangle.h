/* SPDX-License-Identifier: Apache-2.0 */
/* A triangle in double, with vertices that are usually floats: its plane, and where a line
 * crosses it. Pure; any thread. */
#ifndef WORKER_RENDER_GEOM_TRIANGLE_H
#define WORKER_RENDER_GEOM_TRIANGLE_H

#include "worker/render/math/vec3.h"

#include <stdbool.h>
#include <stdint.h>

struct triangle {
	vec3 v[3], n;	     /* vertices, and normal n, not normalised */
	double edge_product; /* upper bound on the terms of n */
	double rounding;     /* error of the vertices, relative to their coordinates */
};

static inline vec3 triangle_vertex(const float (*position)[3], uint32_t i)
{
	return (vec3){(double)position[i][0], (double)position[i][1], (double)position[i][2]};
}

static inline double triangle_norm_max(vec3 v)
{
	return fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
}

static inline double triangle_norm1(vec3 v)
{
	return fabs(v.x) + fabs(v.y) + fabs(v.z);
}

/* e1, e2: the edges v1 - v0 and v2 - v0. */
static inline struct triangle triangle_between(vec3 v0, vec3 v1, vec3 v2, vec3 e1, vec3 e2)
{
	return (struct triangle){{v0, v1, v2}, vec3_cross(e1, e2), triangle_norm1(e1) * triangle_norm1(e2), 0x1p-24};
}

static inline struct triangle triangle_from(const float (*position)[3], const uint32_t i[3])
{
	vec3 v0 = triangle_vertex(position, i[0]), v1 = triangle_vertex(position, i[1]),
	     v2 = triangle_vertex(position, i[2]);
	return triangle_between(v0, v1, v2, vec3_sub(v1, v0), vec3_sub(v2, v0));
}

static inline vec3 triangle_vertex_unrounded(const double (*position)[3], uint32_t i)
{
	return (vec3){position[i][0], position[i][1], position[i][2]};
}

/* A triangle with vertices in double, each with an error of a few roundings of its inputs. */
static inline struct triangle triangle_unrounded(const double (*position)[3], const uint32_t i[3])
{
	vec3 v0 = triangle_vertex_unrounded(position, i[0]), v1 = triangle_vertex_unrounded(position, i[1]),
	     v2 = triangle_vertex_unrounded(position, i[2]);
	struct triangle t = triangle_between(v0, v1, v2, vec3_sub(v1, v0), vec3_sub(v2, v0));
	t.rounding = 0x1p-50;
	return t;
}

/* Returns the height of p over the plane, times |n|; 0 if p is in the plane as far as double can tell. p and n carry
 * the rounding errors of a few operations, whose terms `edge_product` bounds. */
static inline double triangle_height(const struct triangle *t, vec3 p)
{
	vec3 offset = vec3_sub(t->v[0], p);
	double h = vec3_dot(t->n, offset);
	return fabs(h) <= 0x1p-49 * t->edge_product * (triangle_norm1(p) + triangle_norm1(offset)) ? 0 : h;
}

/* Returns the smallest of the three altitudes; 0 if the triangle is a point. */
static inline double triangle_altitude(const struct triangle *t)
{
	vec3 e[3] = {vec3_sub(t->v[1], t->v[0]), vec3_sub(t->v[2], t->v[1]), vec3_sub(t->v[0], t->v[2])};
	double longest2 = fmax(vec3_dot(e[0], e[0]), fmax(vec3_dot(e[1], e[1]), vec3_dot(e[2], e[2])));
	return longest2 > 0 ? sqrt(vec3_dot(t->n, t->n) / longest2) : 0;
}

/* Returns the largest side of the bounding box. */
float triangle_extent(const float (*position)[3], const uint32_t i[3]);

/* Sets *t to where o + t d crosses the plane; returns false unless that is within the triangle. Two triangles that
 * share an edge leave no gap, because both test it with the same operations. */
bool triangle_intersect(const struct triangle *k, vec3 o, vec3 d, double *t);

#endif
