/* SPDX-License-Identifier: Apache-2.0 */
/* <transform>: its contents apply in the order they stand in, each to the result of those before. Pure. */
#ifndef WORKER_RENDER_SCENE_TRANSFORM_H
#define WORKER_RENDER_SCENE_TRANSFORM_H

#include "worker/render/scene/node.h"
#include "worker/render/scene/xml.h"

int transform_read(const struct xml_element *el, mat4 *out, struct error *e);

/* x=, y=, z= (those missing are `missing`) or value="x, y, z"; one_for_all: value="s" stands for three. */
int transform_read_vec3(const struct xml_element *el, double missing, bool one_for_all, vec3 *out, struct error *e);

/* *el, an <animation>, becomes the first of its transforms, for time stands still here. *moves: it has others, which is
 * an error but for the lenient. */
int transform_still(const struct xml_element **el, bool lenient, bool *moves, struct error *e);

#endif
