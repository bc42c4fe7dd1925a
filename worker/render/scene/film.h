/* SPDX-License-Identifier: Apache-2.0 */
/* The size in pixels of a film that states none, as in Mitsuba. */
#ifndef WORKER_RENDER_SCENE_FILM_H
#define WORKER_RENDER_SCENE_FILM_H

enum { SCENE_FILM_WIDTH = 768, SCENE_FILM_HEIGHT = 576 };

#endif
