/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Instances of meshes: one Embree tree for each mesh, in the mesh's own frame, and one user geometry with all instances
 * as primitives. A ray that enters the box of an instance is transformed into the mesh's frame in double, starts where
 * it enters that box, and only then becomes float. Embree's own instances would round the transform and the ray in
 * world space, so their errors would be proportional to the scene instead of the mesh. The hits that Embree proposes
 * are checked in world space, as everywhere (accel.h).
 *
 * Runs inside Embree's traversal: any thread; allocates nothing there.
 */
#ifndef WORKER_RENDER_GEOM_INSTANCES_H
#define WORKER_RENDER_GEOM_INSTANCES_H

#include "worker/render/geom/user_geometry.h"

struct instance_tree {
	RTCScene scene;
	vec3 box_min, box_max; /* bounding box of the mesh, in its frame */
	double float_error;    /* error bound of Embree's floats in the mesh's frame */
	bool is_mirrored;      /* its triangles are wound as in mirrored instances */
};

struct instance {
	uint32_t shape, tree;
};

struct instances {
	const struct accel_shape *shapes;
	uint32_t tree_count, count;
	struct instance_tree *trees; /* one for each mesh */
	struct instance *items;
	/* Error bound of a ray in world space at p: ray_error + ray_error_slope |p|. */
	double ray_error, ray_error_slope;
};

/* Builds the trees for all shapes with a placement. Embree's errors are reported through the device. Returns
 * -ENOMEM if out of memory. */
int instances_init(struct instances *s, RTCDevice device, const struct accel_shape *shapes, uint32_t count);
void instances_fini(struct instances *s);

/* Callbacks whose user data is a struct instances. It must outlive the geometry, and ray_error and ray_error_slope must
 * be set when the geometry is committed. */
extern const struct embree_ops instances_ops;

#endif
