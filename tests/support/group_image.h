/* SPDX-License-Identifier: Apache-2.0 */
/* Images whose groups have values that a test chooses, made by a canvas as the farm makes them. */
#ifndef TESTS_SUPPORT_GROUP_IMAGE_H
#define TESTS_SUPPORT_GROUP_IMAGE_H

#include "common/estimate/image.h"
#include "common/plan/plan.h"

#include <stdint.h>

enum { GROUP_IMAGE_GROUPS = 16 };

/* Of one part, one round of one epoch; at most TILE_SIZE pixels a side. Of samples the caller may make the groups
 * fewer. */
struct plan group_image_plan(enum plan_kind kind, uint32_t width, uint32_t height);

/* What a pixel has in a group, asked once for each, in order. */
typedef double group_image_value(void *user, uint32_t group, uint32_t pixel);

/* One round in which pixel i of group g has the value of(user, g, i) in all channels. canvas_image_fini frees it. */
void group_image(const struct plan *p, group_image_value *of, void *user, struct canvas_image *img);
/* blue: what the blue channel has besides, or NULL. */
void group_image_with_blue(const struct plan *p, group_image_value *of, group_image_value *blue, void *user,
			   struct canvas_image *img);

#endif
