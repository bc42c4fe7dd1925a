/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of curves: one control point per line, position and radius, and an empty line between curves. One thread; what
 * is read lasts until curve_points_free.
 */
#ifndef WORKER_RENDER_SHAPE_CURVE_FILE_H
#define WORKER_RENDER_SHAPE_CURVE_FILE_H

#include "common/base/list.h"
#include "worker/render/scene/scene.h"

struct curve_points {
	const double (*point)[4]; /* x y z in world space (to_world applied), radius */
	const uint32_t *first;	  /* of each curve, and the count of points at the end */
	uint32_t count, curves;
	struct list points, firsts; /* which hold them */
};

/* A file of text in which a curve has at least that many points. */
int curve_file_read(const struct scene_node *n, const struct asset_source *assets, uint32_t least,
		    struct curve_points *out, struct error *e);
/* A file of Mitsuba 0.6's hair, text or binary, where all radii are the same. A hair of one point is left out. */
int curve_file_read_hair(const struct scene_node *n, const struct asset_source *assets, double radius,
			 struct curve_points *out, struct error *e);
void curve_points_free(struct curve_points *p);

#endif
