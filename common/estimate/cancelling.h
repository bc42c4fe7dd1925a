/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Channels that are nearly zero because colours cancel in them, such as the blue of gold. The pixel's light as a whole
 * is well known, but such a channel is positive in some groups and negative in others, so that neither its own value
 * nor the mean of its neighbours can stand for its brightness. Private to common/estimate. Pure; nothing allocates.
 */
#ifndef COMMON_ESTIMATE_CANCELLING_H
#define COMMON_ESTIMATE_CANCELLING_H

#include "common/estimate/inverse_square.h"
#include "common/estimate/tile_error.h"

/* Returns whether colours cancel in channel k of the pixel. */
bool channel_is_cancelling(const struct tile_error *t, size_t pixel, size_t k);

/* Sets t->cancelling_spread from the pixels and channels that are marked in t->is_cancelling. */
void cancelling_find_spread(struct tile_error *t);

/* Returns the moments of 1 / (B^2 + floor^2) over the brightnesses B that the channel may have. */
struct inverse_square cancelling_weight(const struct tile_error *t, size_t pixel, size_t k);

#endif
