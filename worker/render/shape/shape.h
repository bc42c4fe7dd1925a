/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shapes. One file per plug-in and one line in shape_list.h, by which the scene reader knows the shape and the
 * generic tests include it.
 *
 * A shape becomes triangles, a sphere or curves in world space (to_world applied, not yet rescaled), in double.
 * Triangles are wound counter-clockwise seen from outside. v = 0 is the top row of an image, as in both Mitsuba
 * dialects (OBJ files count v from the bottom and are converted unless flip_tex_coords is false).
 */
#ifndef WORKER_RENDER_SHAPE_SHAPE_H
#define WORKER_RENDER_SHAPE_SHAPE_H

#include "worker/render/scene/scene.h"
#include "worker/render/shape/curve.h"
#include "worker/render/shape/mesh.h"

struct sphere {
	vec3 center;
	double radius;
	bool flips_normals; /* normals point inwards */
	mat4 to_world;	    /* rotation of the (u,v) parametrisation only, orthonormal */
};

enum shape_kind { SHAPE_MESH, SHAPE_SPHERE, SHAPE_CURVE };

struct shape_geometry {
	enum shape_kind kind;
	struct mesh mesh;	/* its arrays are in the arena given */
	bool is_in_world_space; /* to_world has been applied to the mesh */
	bool is_generated;	/* the triangles do not come from a file, so those without area are not reported */
	bool has_face_normals;	/* the file asks for flat shading */
	bool has_materials;	/* the file assigns materials to faces; these are not read */
	struct sphere sphere;
	struct curve curve;
};

struct shape_ops {
	struct plugin_decl decl;
	/* NULL: the shape contains others (group.h) and is not built itself. */
	/* Sets *out to the sphere or the curves in world space, or to the mesh, which is in object space unless
	 * `is_in_world_space`; shape_build transforms and checks it. Returns 0 or a negative error code. */
	int (*build)(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		     struct shape_geometry *out, struct error *e);
};

extern const struct shape_ops *const shape_registry[]; /* ends with NULL */
/* Defines the operations of a shape NAME that may contain a BSDF and an emitter, with the function `build` of the
 * source; the parameters follow. */
#define SHAPE_OPS(NAME, ...)                                                                                     \
	const struct shape_ops shape_ops_##NAME = {{PLUGIN_SHAPE, #NAME, PARAMS(__VA_ARGS__),                    \
						    1u << PLUGIN_BSDF | 1u << PLUGIN_EMITTER, PARAM_UNDERSTOOD}, \
						   build}

/* Builds the geometry of a PLUGIN_SHAPE node, with finite numbers and indices in range. Triangles without area are
 * dropped and counted in *dropped; the mesh may be left without any. Returns 0 or a negative error code. One thread;
 * allocates in the arena. */
int shape_build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		struct shape_geometry *out, uint64_t *dropped, struct error *e);
/* Replaces the curves of node n by a mesh of tubes. Returns 0, -EFBIG, -ENOMEM or another negative error code. */
int shape_curves_to_mesh(struct shape_geometry *g, const struct scene_node *n, struct arena *arena, uint64_t *dropped,
			 struct error *e);

#endif
