/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of curves: one control point per line, position and radius, and an empty line between curves. One thread; the
 * points are kept until curve_points_free.
 */
#ifndef WORKER_RENDER_SHAPE_CURVE_FILE_H
#define WORKER_RENDER_SHAPE_CURVE_FILE_H

#include "common/base/list.h"
#include "worker/render/scene/scene.h"

struct curve_points {
	const double (*point)[4];    /* x y z in world space (to_world applied), radius */
	const uint32_t *first_point; /* index of each curve's first point; first_point[curve_count] is `point_count` */
	uint32_t point_count, curve_count;
	struct list point_list, first_point_list; /* own the memory of `point` and `first_point` */
};

/* Reads a text file in which each curve has at least `min_points` points. Returns 0 or a negative error code. */
int curve_file_read(const struct scene_node *n, const struct asset_source *assets, uint32_t min_points,
		    struct curve_points *out, struct error *e);
/* Reads a text or binary hair file of Mitsuba 0.6, with the same radius at all points. Hairs of one point are left out.
 * Returns 0 or a negative error code. */
int curve_file_read_hair(const struct scene_node *n, const struct asset_source *assets, double radius,
			 struct curve_points *out, struct error *e);
void curve_points_free(struct curve_points *p);

#endif
