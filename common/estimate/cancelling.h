/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Channels that are nearly zero because colours cancel in them, such as the blue of gold. The pixel's light is well
 * known, but this channel is positive in some groups and negative in others, so that neither its own value nor the mean
 * of its neighbours is its brightness. Private to common/estimate. Pure; nothing allocates.
 */
#ifndef COMMON_ESTIMATE_CANCELLING_H
#define COMMON_ESTIMATE_CANCELLING_H

#include "common/estimate/inverse_square.h"
#include "common/estimate/tile_error.h"

/* Whether colours cancel in the pixel's channel k. */
bool cancelling_channel(const struct tile_error *t, size_t pixel, size_t k);

/* The spread of such channels in the tile, from those that are marked in t->cancels. */
void cancelling_find_spread(struct tile_error *t);

/* Moments of 1 / (B^2 + floor^2) over the brightnesses that the channel may have. */
struct inverse_square cancelling_weight(const struct tile_error *t, size_t pixel, size_t k);

#endif
