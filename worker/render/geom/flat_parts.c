/* SPDX-License-Identifier: Apache-2.0 */
/* Triangles are sorted by their planes, rounded to a grid. The axes and planes through the origin lie in the middle of
 * a grid cell; a plane on the border of two cells counts as two planes. */
#include "worker/render/geom/flat_parts.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"

#include <stdlib.h>

#define GRID 0x1p10
#define LEAST_SHARE 0.01

struct face {
	int32_t plane[4];
	uint32_t prim;
	double area;
};

static int compare_planes(const struct face *a, const struct face *b)
{
	for (int k = 0; k < 4; k++)
		if (a->plane[k] != b->plane[k])
			return a->plane[k] < b->plane[k] ? -1 : 1;
	return 0;
}

static int compare_faces(const void *x, const void *y)
{
	const struct face *a = x, *b = y;
	int order = compare_planes(a, b);
	return order ? order : a->prim < b->prim ? -1 : a->prim > b->prim;
}

static int compare_prims(const void *x, const void *y)
{
	uint32_t a = *(const uint32_t *)x, b = *(const uint32_t *)y;
	return a < b ? -1 : a > b;
}

static int32_t on_grid(double x)
{
	return (int32_t)lrint(fmin(fmax(x, -4), 4) * GRID);
}

/* on_grid suffices for distances because the mesh fits into the unit sphere. */
static struct face face_of(const struct accel_shape *s, uint32_t prim)
{
	const struct triangle t = triangle_from(s->position, s->index[prim]);
	double length = vec3_length(t.n);
	vec3 n = length > 0 ? vec3_scale(1 / length, t.n) : (vec3){0, 0, 0};
	return (struct face){{on_grid(n.x), on_grid(n.y), on_grid(n.z), on_grid(vec3_dot(n, t.v[0]))}, prim, length};
}

static void keep_large(struct flat_parts *f, const struct face *faces, uint32_t n, double least)
{
	for (uint32_t i = 0, end; i < n; i = end) {
		double area = 0;
		for (end = i; end < n && compare_planes(&faces[end], &faces[i]) == 0; end++)
			area += faces[end].area;
		for (uint32_t k = i; k < end && area >= least; k++)
			f->prim[f->count++] = faces[k].prim;
	}
	if (f->count > 0)
		qsort(f->prim, f->count, sizeof *f->prim, compare_prims);
}

int flat_parts_find(struct flat_parts *f, const struct accel_shape *s)
{
	uint32_t n = s->triangle_count;
	double all = 0;
	*f = (struct flat_parts){.prim = mem_alloc(n, sizeof *f->prim)};
	struct face *faces = mem_alloc(n, sizeof *faces);
	if (!f->prim || !faces) {
		mem_free(faces);
		return -ENOMEM;
	}
	for (uint32_t i = 0; i < n; i++) {
		faces[i] = face_of(s, i);
		all += faces[i].area;
		if (i % 4096 == 0)
			liveness_tick();
	}
	if (n > 0)
		qsort(faces, n, sizeof *faces, compare_faces);
	keep_large(f, faces, n, LEAST_SHARE * all);
	mem_free(faces);
	return 0;
}
