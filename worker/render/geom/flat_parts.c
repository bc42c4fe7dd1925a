/* SPDX-License-Identifier: Apache-2.0 */
/* Triangles are sorted by their planes, rounded to a grid. The axes and planes through the origin lie in the middle of
 * a grid cell; a plane on the border of two cells counts as two planes. */
#include "worker/render/geom/flat_parts.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"

#include <stdlib.h>

#define GRID_CELLS_PER_UNIT 0x1p10
#define AREA_SHARE_MIN 0.01

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

static int32_t round_to_grid(double x)
{
	return (int32_t)lrint(fmin(fmax(x, -4), 4) * GRID_CELLS_PER_UNIT);
}

/* round_to_grid suffices for distances because the mesh fits into the unit sphere. */
static struct face make_face(const struct accel_shape *s, uint32_t prim)
{
	const struct triangle t = triangle_from(s->position, s->index[prim]);
	double length = vec3_length(t.n);
	vec3 n = length > 0 ? vec3_scale(1 / length, t.n) : (vec3){0, 0, 0};
	return (struct face){
		{round_to_grid(n.x), round_to_grid(n.y), round_to_grid(n.z), round_to_grid(vec3_dot(n, t.v[0]))},
		prim,
		length};
}

static void keep_large(struct flat_parts *f, const struct face *faces, uint32_t n, double min_area)
{
	for (uint32_t i = 0, end; i < n; i = end) {
		double area = 0;
		for (end = i; end < n && compare_planes(&faces[end], &faces[i]) == 0; end++)
			area += faces[end].area;
		for (uint32_t k = i; k < end && area >= min_area; k++)
			f->prims[f->count++] = faces[k].prim;
	}
	if (f->count > 0)
		qsort(f->prims, f->count, sizeof *f->prims, compare_prims);
}

int flat_parts_find(struct flat_parts *f, const struct accel_shape *s)
{
	uint32_t n = s->triangle_count;
	double total_area = 0;
	*f = (struct flat_parts){.prims = mem_alloc(n, sizeof *f->prims)};
	struct face *faces = mem_alloc(n, sizeof *faces);
	if (!f->prims || !faces) {
		mem_free(faces);
		return -ENOMEM;
	}
	for (uint32_t i = 0; i < n; i++) {
		faces[i] = make_face(s, i);
		total_area += faces[i].area;
		if (i % 4096 == 0)
			liveness_tick();
	}
	if (n > 0)
		qsort(faces, n, sizeof *faces, compare_faces);
	keep_large(f, faces, n, AREA_SHARE_MIN * total_area);
	mem_free(faces);
	return 0;
}
