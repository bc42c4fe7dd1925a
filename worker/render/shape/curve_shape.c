/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/shape/curve_shape.h"

#include <string.h>

int curve_shape_build(const struct scene_node *n, struct curve_points *points, bool spline, struct arena *arena,
		      struct shape_geometry *out, struct error *e)
{
	double(*p)[4] = arena_alloc(arena, points->point_count, sizeof *p);
	uint32_t *first = arena_alloc(arena, (size_t)points->curve_count + 1, sizeof *first);
	out->kind = SHAPE_CURVE;
	out->curve = (struct curve){.point = (const double(*)[4])p,
				    .first_point = first,
				    .point_count = points->point_count,
				    .curve_count = points->curve_count,
				    .is_spline = spline};
	if (p && first) {
		memcpy(p, points->point, points->point_count * sizeof *p);
		memcpy(first, points->first_point, ((size_t)points->curve_count + 1) * sizeof *first);
	}
	curve_points_free(points);
	int rc = p && first ? curve_measure(&out->curve) : -ENOMEM;
	if (rc == -EFBIG)
		return node_error(n, e, EFBIG, "its curves have too many segments");
	return rc ? node_error(n, e, -rc, "out of memory") : 0;
}
