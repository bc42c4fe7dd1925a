/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The world's media: each once, with a number for every side of a shape that states it, and for the camera. Where media
 * scatter, light sub-paths must know in which one they start: build_scattering finds it for each emitter whose shape
 * states none, by a ray to the next shape that does.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_MEDIA_H
#define WORKER_RENDER_WORLD_BUILD_MEDIA_H

#include "worker/render/world/build_private.h"

int build_media(struct builder *b);
/* After the emitters: sets w->notes.endless if one around the camera hides what shines from infinity. */
void build_media_note(struct builder *b);
/* After Embree's tree: which shapes light passes without a vertex, and the media around emitters. */
int build_scattering(struct builder *b);

#endif
