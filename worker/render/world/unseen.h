/* SPDX-License-Identifier: Apache-2.0 */
/* A camera that sees nothing or black backs, and emitters without light: the first things to know of an image that is
 * empty or too dark. Any thread; allocates nothing. */
#ifndef WORKER_RENDER_WORLD_UNSEEN_H
#define WORKER_RENDER_WORLD_UNSEEN_H

#include "worker/render/world/origin.h"
#include "worker/render/world/world.h"

/* Sets w->notes.unseen if no shape's box (one a shape, in the scene's coordinates) lies in what the camera sees, and
 * there are shapes. Sound: then no ray of the camera meets one. Boxes beside the image's corners may go unnoticed. */
void unseen_note(struct world *w, const struct box *boxes);

/* Sets w->notes.dark if there are emitters, and none of them and no medium gives light at wavelengths that are
 * rendered. lost: there were emitters on shapes that have been left out.
 */
void dark_note(struct world *w, bool lost);

/* Sets w->notes.backs if one in twenty of the camera's rays that meet a surface meets the back of an opaque material
 * which reflects on its front alone, because the scene's dialect makes it black: a surprise where a mesh is inside out.
 * Traces 1,024 rays; needs w->accel. */
void backs_note(struct world *w);

#endif
