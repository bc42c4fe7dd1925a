/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Meshes while they are built: in object space, possibly without normals. One thread; arrays in the given arena.
 */
#ifndef WORKER_RENDER_SHAPE_MESH_H
#define WORKER_RENDER_SHAPE_MESH_H

#include "common/base/arena.h"
#include "worker/render/math/attribute.h"
#include "worker/render/scene/scene.h"

struct mesh {
	uint32_t vertex_count, triangle_count;
	double (*position)[3];
	double (*normal)[3];	       /* NULL: flat shading; otherwise unit vectors, facing outwards */
	uint32_t invalid_normal_count; /* number of vertices whose normals are not finite in the file, and count as
					  missing */
	double (*uv)[2];	       /* NULL: none */
	uint32_t (*index)[3];
	uint32_t attribute_count;
	struct attribute *attributes;
};

enum { MESH_TRIANGLES_MAX = 1 << 27 };
#define MESH_COORDINATE_MAX PARAM_LENGTH_MAX
/* Limit of texture coordinates: up to it, a double resolves a ten-thousandth of a texture's width, and tangents are at
 * least 1e-12 of an edge. */
#define MESH_UV_MAX 1e12

static inline vec3 vec3_load(const double v[3])
{
	return (vec3){v[0], v[1], v[2]};
}

static inline void vec3_store(double out[3], vec3 v)
{
	out[0] = v.x;
	out[1] = v.y;
	out[2] = v.z;
}

/* Returns v normalised, however long it is; 0 if v has no length or is not finite. */
vec3 vec3_unit_or_zero(vec3 v);

/* Stores the normal of a vertex, of any length. One that is not finite becomes 0, which is a missing one, and is
 * counted. */
void mesh_set_normal(struct mesh *m, uint32_t i, vec3 normal);

/* Opens the file that shape n names; the caller closes it. Returns 0 or a negative error code. */
int mesh_open_file(const struct scene_node *n, const struct asset_source *assets, struct asset *a, struct error *e);

/* Allocates the arrays of a mesh. Returns false if out of memory. */
bool mesh_alloc(struct mesh *m, uint32_t vertices, uint32_t triangles, bool normals, bool uv, struct arena *arena);

/* Adds an attribute with all values 0. capacity: the most attributes that will be added to the mesh. Returns NULL if
 * out of memory. */
struct attribute *mesh_add_attribute(struct mesh *m, const char *name, bool per_face, uint32_t channels,
				     uint32_t capacity, struct arena *arena);

/* Sets one number of an attribute. A number beyond MESH_ATTRIBUTE_MAX, or not finite, marks the attribute as
 * damaged. */
#define MESH_ATTRIBUTE_MAX 1e12
void mesh_set_attribute(struct attribute *a, size_t item, uint32_t channel, double x);

/* Copies the attributes of triangle `source` to triangle `target`. */
void mesh_copy_face_attributes(struct mesh *m, uint32_t source, uint32_t target);

/* Sets vertex i of a mesh with normals and texture coordinates; n: a unit vector. */
void mesh_set_vertex(struct mesh *m, uint32_t i, vec3 p, vec3 n, double u, double v);

/* The (u, v) of the corners of a parallelogram, in order around it. */
extern const double mesh_quad_corners[4][2];
/* Sets the two triangles of a parallelogram, `triangle` and the next, with the vertices first .. first+3 in order
 * around it. */
void mesh_set_quad(struct mesh *m, uint32_t triangle, uint32_t first);

#endif
