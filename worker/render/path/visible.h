/* SPDX-License-Identifier: Apache-2.0 */
#ifndef WORKER_RENDER_PATH_VISIBLE_H
#define WORKER_RENDER_PATH_VISIBLE_H

#include "worker/render/path/vertex.h"

/* Nothing lies between a (not at infinity) and b (not the camera). For a camera, what is before its near plane or
 * behind its far one is not there. Counts a ray. */
bool path_visible(struct path_context *c, const struct path_vertex *a, const struct path_vertex *b);

/* The distance at which a ray from there along d begins: 0, or a camera's near plane, before which nothing is seen. */
double path_ray_begin(const struct world *w, const struct path_vertex *from, vec3 d);

#endif
