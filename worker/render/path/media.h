/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Media that absorb are numbers: 0 is none, others are 1 + an index into world.media. The camera stands in none. From
 * it on, the medium changes where the path leaves a shape that states an interior or an exterior, to the one on that
 * side (a side without one is empty), and nowhere else, as in Mitsuba: a stone in water need not state any. So the
 * medium of every edge follows from the path seen from the camera, whichever technique made it.
 */
#ifndef WORKER_RENDER_PATH_MEDIA_H
#define WORKER_RENDER_PATH_MEDIA_H

#include "worker/render/path/vertex.h"

/* The medium of the edge that leaves v along `away`, towards the light, if v was reached through `medium`. */
uint32_t path_medium_after(const struct world *w, const struct path_vertex *v, uint32_t medium, vec3 away);
/* The share of light that the edge between two vertices lets through. */
spectrum path_transmittance(const struct world *w, const struct wavelengths *wl, uint32_t medium,
			    const struct path_vertex *a, const struct path_vertex *b);
/* Gives `to`, which the camera's sub-path reached from `at` along wi, its medium, and to its beta what that lets
 * through. On the light's sub-path that is done when it is joined: only the camera's knows which medium it is in. */
void path_absorb(const struct path_context *c, const struct path_vertex *at, vec3 wi, struct path_vertex *to);

#endif
