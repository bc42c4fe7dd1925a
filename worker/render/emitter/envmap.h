/* SPDX-License-Identifier: Apache-2.0 */
/* Shared by emitters that are environment maps. Private to worker/render/emitter. */
#ifndef WORKER_RENDER_EMITTER_ENVMAP_H
#define WORKER_RENDER_EMITTER_ENVMAP_H

#include "worker/render/emitter/emitter.h"
#include "worker/render/texture/raster.h"

/* The local axes x, y (up) and z in the world, and the rows of the inverse: the same, unless to_world stretches. Its
 * even scale is left out. */
struct envmap_axes {
	vec3 axis[3], back[3];
	bool stretched;
};

/* `data` of such an emitter. */
struct envmap {
	struct raster raster;
	double scale;
	struct envmap_axes at;
	bool to_poles;	    /* the outer rows are the poles */
	uint32_t rows;	    /* of cells: height + 1, to_poles: height - 1 */
	uint32_t columns;   /* width */
	double *row_cdf;    /* rows + 1; the last is 1; all 0 when black */
	uint32_t *cell_cdf; /* [rows][columns + 1] */
};

/* -EINVAL: to_world is singular. */
int envmap_axes_read(const struct scene_node *n, struct envmap_axes *a, struct error *e);
/* Makes em from the image, times scale. to_poles: its first and last rows are the poles. The image is kept. */
int envmap_make(struct emitter *em, const struct raster *picture, bool to_poles, double scale,
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
