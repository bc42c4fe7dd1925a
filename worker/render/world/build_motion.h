/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Moving shapes while a world is built. A shape is built in the position in which its first transform places it, and
 * then moves like an instance of its own mesh, by its transforms combined with the inverse of the first; a mesh in a
 * shapegroup is built in the coordinates of the group. One thread.
 */
#ifndef WORKER_RENDER_WORLD_BUILD_MOTION_H
#define WORKER_RENDER_WORLD_BUILD_MOTION_H

#include "worker/render/shape/group.h"
#include "worker/render/world/build_private.h"

/* For shape `id`, which has been read and has the bounding box `start_box`: computes its motion, and the box in which
 * it stays while it moves. -ENOTSUP: it cannot move like that; -ERANGE: it leaves the range of coordinates. */
int build_motion_begin(struct builder *b, const struct listed_shape *l, uint32_t id, struct box start_box);
/* After the world has been rescaled: computes the placement of shape `id`, whose mesh has the given centre, scale and
 * box. Returns -EINVAL where placement_make fails; -ENOMEM. */
int build_motion_place(struct builder *b, uint32_t id, vec3 center, double scale, const struct box *box,
		       struct placement *p);
/* Like build_motion_place(), but for a sphere of the world. */
int build_motion_place_sphere(struct builder *b, uint32_t id);

/* Sets the motion of an emitter without a surface, after the world has been rescaled. The emitter has been made in its
 * first position. -EINVAL, -ERANGE, -ENOTSUP: it cannot move like that. */
int build_motion_set_emitter(struct builder *b, struct emitter *em, const struct scene_node *n);

/* Sets the motion of the camera, after the world has been rescaled. -EINVAL, -ERANGE, -ENOTSUP:
 * it cannot move like that. */
int build_motion_set_camera(struct builder *b);

#endif
