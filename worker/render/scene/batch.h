/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Mitsuba 3's `batch` holds sensors whose pictures it puts side by side on its film. Here each is a sensor of the
 * scene, in the batch's place and order, to be chosen like any other: with its share of the batch's film, of the same
 * height, and with the batch's sampler; its own count for nothing, as in Mitsuba.
 */
#ifndef WORKER_RENDER_SCENE_BATCH_H
#define WORKER_RENDER_SCENE_BATCH_H

#include "common/base/arena.h"
#include "worker/render/scene/node.h"

bool batch_is(const struct scene_node *n);

/* The sensors of a batch, at most as many as it has children. Fails when it has none, when the film's width is no
 * multiple of their number, for a crop window, and for a batch may not hold another batch. */
int batch_spread(const struct scene_node *batch, struct arena *arena, const struct scene_node **out, uint32_t *count,
		 struct error *e);

#endif
