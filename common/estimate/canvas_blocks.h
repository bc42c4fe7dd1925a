/* SPDX-License-Identifier: Apache-2.0 */
/* What each group's own image of a canvas says, of which the canvas's image is the mean. Any thread while nobody adds
 * to the canvas. */
#ifndef COMMON_ESTIMATE_CANVAS_BLOCKS_H
#define COMMON_ESTIMATE_CANVAS_BLOCKS_H

#include "common/film/canvas.h"

/* Mean X+Y+Z of each of across x down blocks of the crop in each group's own image, of the prefix of complete rounds,
 * and that of the whole crop as the last: out[group][across * down + 1]. Groups are independent, so that their spread
 * is these means' error. across and down: at most width and height. */
void canvas_group_blocks(const struct canvas *c, uint32_t across, uint32_t down, double *out);

/* Sum over pixels and R, G, B (weight[height][width][3], as canvas_image's rgb) of the weighted square of a group's
 * image less the mean of the groups': out[groups]. Their mean over groups - 1 is the same sum of squared standard
 * errors. */
void canvas_group_distances(const struct canvas *c, const double *weight, double *out);

#endif
