/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Builds the world's media. Each medium is made once; every side of a shape that states a medium, and the camera,
 * refers to it by number. Where media scatter, light sub-paths must know in which medium they start: for emitters whose
 * shapes state none, build_scattering finds it by tracing a ray to the next shape that states one.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_MEDIA_H
#define WORKER_RENDER_WORLD_BUILD_MEDIA_H

#include "worker/render/world/build_private.h"

int build_media(struct builder *b);
/* Call after the emitters are built. Sets w->notes.endless_medium if an unbounded medium around the camera
 * hides emitters at infinity. */
void build_note_endless_medium(struct builder *b);
/* Call after Embree's tree is built. Determines through which shapes light passes without a vertex, and
 * the media around emitters. */
int build_scattering(struct builder *b);

#endif
