/* SPDX-License-Identifier: Apache-2.0 */
/* Animations. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_ANIMATION_H
#define WORKER_RENDER_GLTF_GLTF_ANIMATION_H

#include "worker/render/gltf/gltf_tree.h"

/* Puts nodes where the first animation begins, with a note. Nothing happens if there is none. */
void gltf_animation_begin(struct gltf *g);

#endif
