/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Moving shapes, while a world is built. A shape is built where it is when the shutter opens, and then moves like an
 * instance of its own mesh, by its transforms after the inverse of the first; a mesh in a shapegroup is built as it is
 * there. One thread.
 */
#ifndef WORKER_RENDER_WORLD_MOVING_H
#define WORKER_RENDER_WORLD_MOVING_H

#include "worker/render/shape/group.h"
#include "worker/render/world/build_private.h"

/* Of shape `id`, which has been read and has the box `from`: its motion, and the box in which it stays. -ENOTSUP: it
 * cannot move like that; -ERANGE: it leaves the range of coordinates. */
int moving_begin(struct builder *b, const struct listed_shape *l, uint32_t id, struct box from);
/* After the world has been rescaled: its placement, from a frame of that centre and scale in which it has this box.
 * -EINVAL as placement_make; -ENOMEM. */
int moving_place(struct builder *b, uint32_t id, vec3 center, double scale, const struct box *box, struct placement *p);
/* The same for a sphere of the world. */
int moving_place_sphere(struct builder *b, uint32_t id);

/* An emitter without a surface, after that; it has been made where it is first. -EINVAL, -ERANGE: it cannot move so. */
int moving_emitter(struct builder *b, struct emitter *em, const struct scene_node *n);

/* The camera, after the world has been rescaled. -EINVAL, -ERANGE: it cannot move like that. */
int moving_camera(struct builder *b);

#endif
