/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Instances of meshes: one Embree tree for each mesh, in the mesh's own frame, and one user geometry with all instances
 * as primitives. A ray that enters the box of one is transformed into the mesh's frame in double, starts where it
 * enters that box, and only then becomes float. Embree's own instances would round transform and ray in the world, so
 * their errors would be proportional to the scene instead of the mesh. What Embree proposes is checked in the world, as
 * everywhere (accel.h).
 *
 * Runs inside Embree's traversal: any thread; allocates nothing there.
 */
#ifndef WORKER_RENDER_GEOM_INSTANCES_H
#define WORKER_RENDER_GEOM_INSTANCES_H

#include "worker/render/geom/solved.h"

struct instance_tree {
	RTCScene scene;
	vec3 low, high; /* of the mesh, in its frame */
	double reach;	/* the error bound of Embree's floats in it */
	bool mirrored;	/* its triangles are wound as for mirrored instances */
};

struct instance {
	uint32_t shape, tree;
};

struct instances {
	const struct accel_shape *shapes;
	uint32_t tree_count, count;
	struct instance_tree *trees; /* one per mesh */
	struct instance *list;
	double off, off_far; /* the error bound of a ray of the world at p: off + off_far |p| */
};

/* For all shapes with a placement. The device reports Embree's errors. -ENOMEM. */
int instances_init(struct instances *s, RTCDevice device, const struct accel_shape *shapes, uint32_t count);
void instances_fini(struct instances *s);

/* Their data is a struct instances, which must outlive the geometry, with off and off_far set when it is committed. */
extern const struct embree_ops instances_ops;

#endif
