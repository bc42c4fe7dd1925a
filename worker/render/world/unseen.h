/* SPDX-License-Identifier: Apache-2.0 */
/* A camera that sees nothing: the first thing to know of an image that is empty. Pure; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_WORLD_UNSEEN_H
#define WORKER_RENDER_WORLD_UNSEEN_H

#include "worker/render/world/origin.h"
#include "worker/render/world/world.h"

/* Sets w->notes.unseen if no shape's box (one a shape, in the scene's coordinates) lies in what the camera sees, and
 * there are shapes. Sound: then no ray of the camera meets one. Boxes beside the image's corners may go unnoticed. */
void unseen_note(struct world *w, const struct box *boxes);

#endif
