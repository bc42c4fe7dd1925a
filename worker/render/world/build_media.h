/* SPDX-License-Identifier: Apache-2.0 */
/* The world's media: each once, with a number for every side of a shape that states it. */
#ifndef WORKER_RENDER_WORLD_BUILD_MEDIA_H
#define WORKER_RENDER_WORLD_BUILD_MEDIA_H

#include "worker/render/world/build_private.h"

int build_media(struct builder *b);

#endif
