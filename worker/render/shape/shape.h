/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes. One file per plug-in and one line in shape_list.h: the scene reader knows it, and the generic tests include
 * it.
 *
 * A shape becomes triangles or a sphere in world space (to_world applied, not yet rescaled), in double. Triangles are
 * wound counter-clockwise as seen from outside. v = 0 is the top row of an image, as in both Mitsubas (OBJ files count
 * from the bottom and are converted unless flip_tex_coords is false).
 */
#ifndef WORKER_RENDER_SHAPE_SHAPE_H
#define WORKER_RENDER_SHAPE_SHAPE_H

#include "worker/render/scene/scene.h"
#include "worker/render/shape/mesh.h"

struct sphere {
	vec3 center;
	double radius;
	bool flip_normals; /* normals point inwards */
	mat4 to_world;	   /* rotation of the parametrisation only (uv), orthonormal */
};

enum shape_kind { SHAPE_MESH, SHAPE_SPHERE };

struct shape_geometry {
	enum shape_kind kind;
	struct mesh mesh;  /* arrays owned by the arena given */
	bool placed;	   /* to_world has been applied to it */
	bool made_here;	   /* no file has its triangles, so those without area are not reported */
	bool face_normals; /* its file wants flat shading */
	bool materials;	   /* its file assigns materials to faces, which are not read */
	struct sphere sphere;
};

struct shape_ops {
	const char *type;
	const struct param *params;
	/* NULL: it holds other shapes (group.h), and is not built itself. */
	/* Fills in *out: the sphere in world space, or the mesh, in object space unless it is `placed` (shape_build
	 * places and checks it). */
	int (*build)(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		     struct shape_geometry *out, struct error *e);
	unsigned nested_classes; /* classes of unnamed objects that it may hold; 0: shape_nested_classes */
};

extern const struct shape_ops *const shape_registry[]; /* ends with NULL */
/* Classes of unnamed objects that a shape may hold: struct plugin_decl. */
extern const unsigned shape_nested_classes;

/* Builds the geometry of a PLUGIN_SHAPE node. Checked: finite, indices in range. Triangles without area are dropped
 * and counted in *dropped; a mesh may have none left. One thread; allocates in the arena. */
int shape_build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		struct shape_geometry *out, uint64_t *dropped, struct error *e);

#endif
