/* SPDX-License-Identifier: Apache-2.0 */
/* Functions shared by emitters that are environment maps. Private to worker/render/emitter. */
#ifndef WORKER_RENDER_EMITTER_ENVMAP_H
#define WORKER_RENDER_EMITTER_ENVMAP_H

#include "worker/render/emitter/emitter.h"
#include "worker/render/texture/raster.h"

/* The local axes x, y (up) and z in the world, and the rows of the inverse matrix, which are the same vectors unless
 * to_world stretches. A uniform scale of to_world has no effect. */
struct envmap_axes {
	vec3 axis[3], inverse_row[3];
	bool is_stretched;
};

/* `data` of an emitter that is an environment map. */
struct envmap {
	struct raster raster;
	double scale;
	struct envmap_axes axes;
	bool has_rows_at_poles; /* the outer rows are the poles */
	uint32_t rows;		/* rows of cells: height - 1 if has_rows_at_poles, otherwise height + 1 */
	uint32_t columns;	/* columns of cells, and of pixels */
	double *row_cdf;	/* [rows + 1]; the last one is 1, or all are 0 if the map is black */
	uint32_t *cell_cdf;	/* running sums, [rows][columns + 1] */
};

/* Reads to_world. -EINVAL if it is flat, or nearly so. */
int envmap_read_axes(const struct scene_node *n, struct envmap_axes *a, struct error *e);
/* Makes em an environment map of the image, times scale. has_rows_at_poles: the first and last rows are the poles. The
 * pixels must outlive em. -ENOMEM. */
int envmap_init(struct emitter *em, const struct raster *picture, bool has_rows_at_poles, double scale,
		const struct envmap_axes *axes, const struct scene_node *n, const struct emitter_build *build,
		struct error *e);

spectrum envmap_radiance(const struct emitter *em, const struct emitter_point *x, vec3 w, const struct wavelengths *wl);
bool envmap_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x, double *pdf_point);
double envmap_pdf_point(const struct emitter *em, const struct emitter_point *x);
void envmap_point_inverse(const struct emitter *em, const struct emitter_point *x, double u[2]);

#define ENVMAP_OPS                                                                                       \
	.radiance = envmap_radiance, .sample_point = envmap_sample_point, .pdf_point = envmap_pdf_point, \
	.point_inverse = envmap_point_inverse, .data_size = sizeof(struct envmap)

#endif
