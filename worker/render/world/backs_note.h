/* SPDX-License-Identifier: Apache-2.0 */
/* Backs that are black because the scene's dialect makes them so: a surprise where a mesh is inside out. */
#ifndef WORKER_RENDER_WORLD_BACKS_NOTE_H
#define WORKER_RENDER_WORLD_BACKS_NOTE_H

#include "worker/render/world/world.h"

/* Sets w->notes.backs if one in twenty of the camera's rays that meet a surface meets the back of an opaque material
 * which reflects on its front alone. Traces 1,024 rays; needs w->accel. Any thread; allocates nothing. */
void backs_note(struct world *w);

#endif
