/* SPDX-License-Identifier: Apache-2.0 */
/* Pixels of a film that does not say how many: Mitsuba's. */
#ifndef WORKER_RENDER_SCENE_FILM_H
#define WORKER_RENDER_SCENE_FILM_H

enum { SCENE_FILM_WIDTH = 768, SCENE_FILM_HEIGHT = 576 };

#endif
