/* SPDX-License-Identifier: Apache-2.0 */
/* Notes about a camera that sees nothing or black backs, and about emitters without light: the first things to know
 * about an image that is empty or too dark. Any thread; allocates nothing. */
#ifndef WORKER_RENDER_WORLD_VISIBILITY_NOTES_H
#define WORKER_RENDER_WORLD_VISIBILITY_NOTES_H

#include "worker/render/texture/picture_cache.h"
#include "worker/render/world/world_origin.h"
#include "worker/render/world/world.h"

/* Sets w->notes.nothing_visible if there are shapes and no shape's box (one per shape, in the scene's coordinates)
 * reaches into the camera's view. If it is set, no camera ray meets a shape. The converse does not hold: boxes beside
 * the image's corners may count as visible. */
void world_note_nothing_visible(struct world *w, const struct box *boxes);

/* Sets w->notes.no_light if there are emitters, but neither they nor any medium emit light at the wavelengths that are
 * rendered. dropped_emitter: emitters on shapes have been left out, so that no emitter at all is left. */
void world_note_no_light(struct world *w, bool dropped_emitter);

/* Sets w->notes.negative_pixels if an image has pixels with a value that is negative where none may be. */
void world_note_negative_pixels(struct world *w, const struct raised_pictures *images);

/* Sets w->notes.black_backs if at least one in twenty of the camera rays that meet a surface meets the back of an
 * opaque material without `twosided`. black: the scene's dialect makes backs black, a surprise where a mesh is inside
 * out; otherwise they are lit, which differs from Mitsuba 0.6. Traces 1,024 rays; needs w->accel. */
void world_note_black_backs(struct world *w, bool black);

#endif
