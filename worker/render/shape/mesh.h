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
	double (*normal)[3]; /* NULL: none, shade flat; unit length; facing the outside */
	double (*uv)[2];     /* NULL: none */
	uint32_t (*index)[3];
	uint32_t attribute_count;
	struct attribute *attributes;
};

enum { MESH_TRIANGLES_MAX = 1 << 27 };
#define MESH_COORDINATE_MAX PARAM_LENGTH_MAX
/* A double then resolves a ten-thousandth of a texture's width, and tangents are at least 1e-12 of an edge. */
#define MESH_UV_MAX 1e12

static inline vec3 mesh_load(const double v[3])
{
	return (vec3){v[0], v[1], v[2]};
}

static inline void mesh_store(double out[3], vec3 v)
{
	out[0] = v.x;
	out[1] = v.y;
	out[2] = v.z;
}

/* v normalised, however long it is; 0 if it has no length, or is not finite. */
vec3 mesh_unit(vec3 v);

/* The file that a shape names; the caller closes it. */
int mesh_open(const struct scene_node *n, const struct asset_source *assets, struct asset *a, struct error *e);

/* Allocates the arrays; false: out of memory. */
bool mesh_alloc(struct mesh *m, uint32_t vertices, uint32_t triangles, bool normals, bool uv, struct arena *arena);

/* Adds an attribute of zeros to a mesh with room for `room` of them; NULL: out of memory. */
struct attribute *mesh_add_attribute(struct mesh *m, const char *name, bool per_face, uint32_t channels, uint32_t room,
				     struct arena *arena);

/* Numbers beyond this count as damaged, like those that are not finite. */
#define MESH_ATTRIBUTE_MAX 1e12
void mesh_set_attribute(struct attribute *a, size_t item, uint32_t channel, double x);

/* Triangle `from` becomes triangle `to` in the attributes. */
void mesh_move_face(struct mesh *m, uint32_t from, uint32_t to);

/* Vertex i; n: a unit vector. */
void mesh_set_vertex(struct mesh *m, uint32_t i, vec3 p, vec3 n, double u, double v);

/* Parallelograms. Corners in order around one: (u, v) of each. */
extern const double quad_corner[4][2];
/* Two triangles, `triangle` and the next, with the vertices first .. first+3 in order around it. */
void quad_set(struct mesh *m, uint32_t triangle, uint32_t first);

#endif
