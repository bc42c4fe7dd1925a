/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Mitsuba 3's `batch` holds sensors whose pictures it puts side by side on its film. Here each of them becomes a sensor
 * of the scene, in the batch's place and order, which can be selected like any other. It has its share of the width of
 * the batch's film, the full height, and the batch's sampler; as in Mitsuba, its own film and sampler have no effect.
 */
#ifndef WORKER_RENDER_SCENE_BATCH_H
#define WORKER_RENDER_SCENE_BATCH_H

#include "common/base/arena.h"
#include "worker/render/scene/node.h"

bool node_is_batch(const struct scene_node *n);

/* Stores the sensors of a batch, at most as many as it has children. Fails if there is none, if the film's width is
 * not a multiple of their number, for a crop window, and for a batch inside a batch. */
int batch_expand(const struct scene_node *batch, struct arena *arena, const struct scene_node **out, uint32_t *count,
		 struct error *e);

#endif
