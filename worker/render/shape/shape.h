/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes. One file per plug-in and one line in shape_list.h: the scene reader knows it, and the generic tests include
 * it.
 *
 * A shape becomes triangles, a sphere or curves in world space (to_world applied, not yet rescaled), in double.
 * Triangles are wound counter-clockwise as seen from outside. v = 0 is the top row of an image, as in both Mitsubas
 * (OBJ files count from the bottom and are converted unless flip_tex_coords is false).
 */
#ifndef WORKER_RENDER_SHAPE_SHAPE_H
#define WORKER_RENDER_SHAPE_SHAPE_H

#include "worker/render/scene/scene.h"
#include "worker/render/shape/curve.h"
#include "worker/render/shape/mesh.h"

struct sphere {
	vec3 center;
	double radius;
	bool flip_normals; /* normals point inwards */
	mat4 to_world;	   /* rotation of the parametrisation only (uv), orthonormal */
};

enum shape_kind { SHAPE_MESH, SHAPE_SPHERE, SHAPE_CURVE };

struct shape_geometry {
	enum shape_kind kind;
	struct mesh mesh;  /* arrays owned by the arena given */
	bool placed;	   /* to_world has been applied to it */
	bool made_here;	   /* no file has its triangles, so those without area are not reported */
	bool face_normals; /* its file wants flat shading */
	bool materials;	   /* its file assigns materials to faces, which are not read */
	struct sphere sphere;
	struct curve curve;
};

struct shape_ops {
	struct plugin_decl decl;
	/* NULL: it holds other shapes (group.h), and is not built itself. */
	/* Fills in *out: the sphere or the curves in world space, or the mesh, in object space unless it is `placed`
	 * (shape_build places and checks it). */
	int (*build)(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		     struct shape_geometry *out, struct error *e);
};

extern const struct shape_ops *const shape_registry[]; /* ends with NULL */
/* The operations of a shape NAME that may hold a BSDF and an emitter, in a source with `build`; then its parameters. */
#define SHAPE_OPS(NAME, ...)                                                                                     \
	const struct shape_ops shape_ops_##NAME = {{PLUGIN_SHAPE, #NAME, PARAMS(__VA_ARGS__),                    \
						    1u << PLUGIN_BSDF | 1u << PLUGIN_EMITTER, PARAM_UNDERSTOOD}, \
						   build}

/* Builds the geometry of a PLUGIN_SHAPE node. Checked: finite, indices in range. Triangles without area are dropped
 * and counted in *dropped; a mesh may have none left. One thread; allocates in the arena. */
int shape_build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		struct shape_geometry *out, uint64_t *dropped, struct error *e);
/* Makes the curves of a SHAPE_CURVE node a mesh of tubes. */
int shape_curve_mesh(struct shape_geometry *g, const struct scene_node *n, struct arena *arena, uint64_t *dropped,
		     struct error *e);

#endif
