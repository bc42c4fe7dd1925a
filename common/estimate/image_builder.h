/* SPDX-License-Identifier: Apache-2.0 */
/* The state shared by the steps that make an image. Private to common/estimate. */
#ifndef COMMON_ESTIMATE_IMAGE_BUILDER_H
#define COMMON_ESTIMATE_IMAGE_BUILDER_H

#include "common/estimate/image.h"
#include "common/film/canvas_films.h"

struct image_builder {
	const struct canvas *c;
	struct canvas_image *img;
	bool includes_open_rounds;	/* a preview, which includes open rounds */
	struct tally *totals;		/* sums of prefix, bootstrap and, for a preview, open rounds */
	double factor[PLAN_GROUPS_MAX]; /* from grid units to the group's own image; 0: the group has no samples */
	double pooled_factor;		/* from the sums over all groups to the image */
	double b[PLAN_GROUPS_MAX];	/* by group */
};

#endif
