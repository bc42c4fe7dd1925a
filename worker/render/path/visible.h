/* SPDX-License-Identifier: Apache-2.0 */
#ifndef WORKER_RENDER_PATH_VISIBLE_H
#define WORKER_RENDER_PATH_VISIBLE_H

#include "worker/render/path/vertex.h"

/* Whether nothing lies between a (not at infinity) and b (not the camera). A camera does not see anything in front of
 * its near plane or behind its far plane. Counts a ray. */
bool path_is_visible(struct path_context *c, const struct path_vertex *a, const struct path_vertex *b);

/* Returns the distance at which a ray from `from` along d begins: for a camera that of its near plane, otherwise 0. */
double path_ray_t_min(const struct world *w, const struct path_vertex *from, vec3 d);

#endif
