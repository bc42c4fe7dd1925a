/* SPDX-License-Identifier: Apache-2.0 */
/* The image of a canvas. Any thread while nobody adds to the canvas. */
#ifndef COMMON_ESTIMATE_CANVAS_IMAGE_H
#define COMMON_ESTIMATE_CANVAS_IMAGE_H

#include "common/estimate/image.h"
#include "common/film/canvas.h"

/* Makes the image of the complete rounds; with open_rounds, a preview of everything merged, without errors. Allocates
 * img's arrays, which canvas_image_fini frees. Returns 0 or -ENOMEM. */
int canvas_image_init(const struct canvas *c, bool open_rounds, struct canvas_image *img, struct error *e);
void canvas_image_fini(struct canvas_image *img);

#endif
