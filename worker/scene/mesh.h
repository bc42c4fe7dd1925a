/*
 * Triangles in world space (to_world applied, not yet rescaled), in double. They are wound counter-clockwise as seen
 * from outside. v = 0 is the top row of a picture, as in both Mitsubas (obj files count from the bottom and are turned
 * round unless flip_tex_coords is false).
 */
#ifndef WORKER_SCENE_MESH_H
#define WORKER_SCENE_MESH_H

#include "worker/scene/scene.h"

struct mesh {
	uint32_t vertex_count, triangle_count;
	double (*position)[3];
	double (*normal)[3];   /* NULL: none, shade flat; unit length; facing the outside */
	double (*uv)[2];       /* NULL: none */
	uint32_t (*index)[3];
};

struct sphere {
	vec3 center;
	double radius;
	bool flip_normals; /* normals point inwards */
	mat4 to_world;     /* rotation of the parametrisation only (uv), orthonormal */
};

enum shape_kind { SHAPE_MESH, SHAPE_SPHERE };

struct shape_geometry {
	enum shape_kind kind;
	struct mesh mesh;     /* arrays owned by the arena given */
	struct sphere sphere;
};

/* Builds the geometry of a PLUGIN_SHAPE node (obj, rectangle, cube, sphere). Checked: finite, indices in range,
 * at least one triangle of area > 0 (others are dropped and counted in *dropped). */
int shape_build(const struct scene_node *n, const struct asset_source *assets, struct arena *arena,
		struct shape_geometry *out, uint64_t *dropped, struct error *e);

/* The plug-in declarations of shapes; ends with a NULL type. */
extern const struct plugin_decl shape_decls[];

#endif
