/* SPDX-License-Identifier: Apache-2.0 */
/* The state shared by the steps that make an image. Private to common/estimate. */
#ifndef COMMON_ESTIMATE_IMAGE_BUILDER_H
#define COMMON_ESTIMATE_IMAGE_BUILDER_H

#include "common/estimate/image.h"
#include "common/film/canvas_films.h"

/* An image being made. */
struct image_builder {
	const struct canvas *c;
	struct canvas_image *img;
	bool open_rounds;
	struct tally *all;		/* prefix, bootstrap and, for a preview, the open rounds */
	double factor[PLAN_MAX_GROUPS]; /* grid units to the group's image; 0: the group has nothing */
	double pooled_factor;
	double b[PLAN_MAX_GROUPS];
};

#endif
