/* SPDX-License-Identifier: Apache-2.0 */
/* Means over blocks of each group's own image; the canvas's image is their mean. Any thread while nobody adds to the
 * canvas. */
#ifndef COMMON_ESTIMATE_CANVAS_BLOCKS_H
#define COMMON_ESTIMATE_CANVAS_BLOCKS_H

#include "common/film/canvas.h"

/* Mean X+Y+Z of each of across x down blocks of the crop in each group's own image (the prefix of complete rounds),
 * and last that of the whole crop: out[group][across * down + 1]. Groups are independent, so their spread is the
 * error of these means. across and down: at most width and height. */
void canvas_group_blocks(const struct canvas *c, uint32_t across, uint32_t down, double *out);

/* For each group, the weighted sum over pixels and R, G, B of the squared difference between its image and the mean
 * of all groups: out[groups], with weight[height][width][3] as canvas_image's rgb. Their mean over groups - 1 is the
 * weighted sum of squared standard errors. */
void canvas_group_distances(const struct canvas *c, const double *weight, double *out);

#endif
