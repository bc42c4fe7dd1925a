/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Instances of meshes: one tree of Embree's for each mesh, in the mesh's own frame, and one geometry that holds all
 * instances as primitives. A ray that enters the box of one is moved into the mesh's frame in double, begins there
 * where it enters that box, and only then becomes float: Embree's own instances would round transform and ray in the
 * world, so that what is proposed would be off by parts of the scene instead of parts of the mesh. What Embree proposes
 * is judged in the world, as everywhere (accel.h).
 *
 * Runs inside Embree's traversal: any thread; allocates nothing there.
 */
#ifndef WORKER_RENDER_GEOM_INSTANCES_H
#define WORKER_RENDER_GEOM_INSTANCES_H

#include "worker/render/geom/solved.h"

struct instance_tree {
	RTCScene scene;
	vec3 low, high; /* of the mesh, in its frame */
	double reach;	/* how far Embree's floats can be off in it */
	bool mirrored;	/* the winding of its triangles is that of mirrored instances */
};

struct instance {
	uint32_t shape, tree;
};

struct instances {
	const struct accel_shape *shapes;
	uint32_t tree_count, count;
	struct instance_tree *trees; /* one a mesh */
	struct instance *list;
	double off, off_far; /* how far a ray of the world can be off at p: off + off_far |p| */
};

/* Of all shapes that have a place. The device reports what goes wrong in Embree. -ENOMEM. */
int instances_init(struct instances *s, RTCDevice device, const struct accel_shape *shapes, uint32_t count);
void instances_fini(struct instances *s);

/* What the user geometry is made of; s outlives it, and knows off and off_far when it is committed. */
void instances_geometry(RTCGeometry g, struct instances *s);

#endif
