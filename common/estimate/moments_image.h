/* SPDX-License-Identifier: Apache-2.0 */
/* What the moments of a canvas say of an image. Private to common/estimate. */
#ifndef COMMON_ESTIMATE_MOMENTS_IMAGE_H
#define COMMON_ESTIMATE_MOMENTS_IMAGE_H

#include "common/base/error.h"
#include "common/estimate/image.h"

struct moments;

/* What moments_image needs of a group: independent samples of its bootstrap, mutations that are merged, b. */
struct moments_group {
	uint64_t bootstrap, mutations;
	double b;
};
/* Fills img->classes and, where there are complete rounds of chains and this is no preview, the arrays by tile. */
int moments_image(const struct moments *m, const struct moments_group *groups, uint64_t rounds, bool open_rounds,
		  struct canvas_image *img, struct error *e);

#endif
