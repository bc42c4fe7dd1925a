/* SPDX-License-Identifier: Apache-2.0 */
/* Means over blocks of pixels, and distances, of the images of single groups. Any thread while nobody adds to the
 * canvas. */
#ifndef COMMON_ESTIMATE_CANVAS_BLOCKS_H
#define COMMON_ESTIMATE_CANVAS_BLOCKS_H

#include "common/film/canvas.h"

/* Divides the crop into across x down blocks and computes the mean X+Y+Z of each block, and last of the whole crop, in
 * each group's own image (the prefix of complete rounds): out[group][across * down + 1]. Groups are independent, so the
 * error of the means follows from the spread between groups. across and down: at most the crop's width and height. */
void canvas_group_blocks(const struct canvas *c, uint32_t across, uint32_t down, double *out);

/* Computes for each group the weighted sum, over pixels and R, G, B, of the squared difference between its image and
 * the mean of all groups: out[groups]; weight[height][width][3] is laid out like rgb of canvas_image. The mean of these
 * sums divided by (groups - 1) is the weighted sum of squared standard errors. */
void canvas_group_distances(const struct canvas *c, const double *weight, double *out);

#endif
