/* SPDX-License-Identifier: Apache-2.0 */
/* Animations of a glTF file. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_ANIMATION_H
#define WORKER_RENDER_GLTF_GLTF_ANIMATION_H

#include "worker/render/gltf/gltf_tree.h"

/* Moves nodes to where they are when the first animation begins, with a note. Does nothing if there is no animation. */
void gltf_apply_animation_start(struct gltf *g);

#endif
