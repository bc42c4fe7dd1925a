/* SPDX-License-Identifier: Apache-2.0 */
/* Images whose groups have values that a test chooses, made by a canvas as on the farm. */
#ifndef TESTS_SUPPORT_GROUP_IMAGE_H
#define TESTS_SUPPORT_GROUP_IMAGE_H

#include "common/estimate/image.h"
#include "common/plan/plan.h"

#include <stdint.h>

enum { GROUP_IMAGE_GROUPS = 16 };

/* Returns a plan of one part and one round of one epoch, of at most TILE_SIZE pixels a side. The caller may reduce
 * the groups of a plan of samples. */
struct plan group_image_plan(enum plan_kind kind, uint32_t width, uint32_t height);

/* Returns the value of a pixel in a group; called once for each, in order. */
typedef double group_image_value(void *user, uint32_t group, uint32_t pixel);

/* Makes an image of one round in which pixel i of group g has value(user, g, i) in all channels.
 * canvas_image_fini frees it. */
void group_image_make(const struct plan *p, group_image_value *value, void *user, struct canvas_image *img);
/* blue: an additional value for the blue channel, or NULL. */
void group_image_make_with_blue(const struct plan *p, group_image_value *value, group_image_value *blue, void *user,
				struct canvas_image *img);

#endif
