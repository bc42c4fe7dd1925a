/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The attributes of one mesh, as seen by the textures on it. Meshes may differ in their attributes, so a BSDF whose
 * textures use some belongs to one shape; equal numbers of several meshes are stored once. One thread, while the world
 * is built.
 */
#ifndef WORKER_RENDER_TEXTURE_ATTRIBUTE_TABLE_H
#define WORKER_RENDER_TEXTURE_ATTRIBUTE_TABLE_H

#include "common/base/arena.h"
#include "worker/render/math/attribute.h"
#include "worker/render/scene/scene.h"

/* Decoded numbers of an attribute, shared by all that use them. */
struct attribute_values {
	struct attribute_values *next;
	size_t count;
	uint64_t hash;
	uint32_t channels;
	float least, most; /* of the first three channels */
	bool grey;	   /* they are constant */
	const float *value;
};

/* Attributes that textures use, by their hashes; in the world's arena. A scene may have 2^18 meshes with colours. */
enum { ATTRIBUTE_POOL_LISTS = 1 << 12 };
struct attribute_pool {
	struct attribute_values *first[ATTRIBUTE_POOL_LISTS];
};

/* Whether a texture was made that uses the attributes or, of this shape alone, the edges; and how many points of a
 * triangle have the extremes of what it may be: the corners, or these and where all edges are equally far. */
enum attribute_asked { ASKED_NOTHING = 0, ASKED_ATTRIBUTES = 3, ASKED_EDGES = 4 };

struct attribute_table {
	const struct scene_node *shape;
	uint32_t vertex_count, triangle_count; /* 0 triangles: not a mesh */
	const uint32_t (*index)[3];	       /* outlives the textures */
	const float (*position)[3];	       /* so do these; as in struct geom_shape */
	const double (*unrounded)[3];
	vec3 axis[3]; /* their axes, in scene units */
	uint32_t count;
	const struct attribute *attributes;
	struct attribute_pool *pool;
	enum attribute_asked asked;
};

enum attribute_use { ATTRIBUTE_COLOR, ATTRIBUTE_COORDINATES };

/* The edges of a triangle in scene units, each across from the corner of its number. */
void attribute_table_sides(const struct attribute_table *t, uint32_t triangle, vec3 side[3]);

/* The attribute `name`; NULL, with -EINVAL's sentence, which names the mesh and the nearest name: there is none, or
 * its numbers are not valid for that use. n: the texture. */
const struct attribute *attribute_find(const struct attribute_table *t, const char *name, enum attribute_use use,
				       const struct scene_node *n, struct error *e);

/* Its numbers, decoded from sRGB if `decode`; allocated in the arena, or shared. NULL: out of memory. */
const struct attribute_values *attribute_keep(struct attribute_table *t, const struct attribute *a, bool decode,
					      struct arena *arena);

#endif
