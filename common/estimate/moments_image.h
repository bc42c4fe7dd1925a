/* SPDX-License-Identifier: Apache-2.0 */
/* Statistics of an image from the moments of its canvas. Private to common/estimate. */
#ifndef COMMON_ESTIMATE_MOMENTS_IMAGE_H
#define COMMON_ESTIMATE_MOMENTS_IMAGE_H

#include "common/base/error.h"
#include "common/estimate/image.h"

struct moments;

/* The input for each group. */
struct moments_group {
	uint64_t bootstrap; /* independent samples of the group's bootstrap */
	uint64_t mutations; /* merged mutations or samples */
	double b;
};
/* Fills in img->classes and, for complete rounds of chains (not for previews), the arrays by tile. Returns 0 or
 * -ENOMEM. */
int moments_fill_image(const struct moments *m, const struct moments_group *groups, uint64_t rounds, bool open_rounds,
		       struct canvas_image *img, struct error *e);

#endif
