/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The attributes of one mesh, for the textures on it. Meshes may differ in their attributes, so a BSDF whose textures
 * use attributes belongs to one shape. Equal values of several meshes are stored once. One thread, while the world is
 * built.
 */
#ifndef WORKER_RENDER_TEXTURE_ATTRIBUTE_TABLE_H
#define WORKER_RENDER_TEXTURE_ATTRIBUTE_TABLE_H

#include "common/base/arena.h"
#include "worker/render/math/attribute.h"
#include "worker/render/scene/scene.h"

/* The decoded values of an attribute, shared by all textures that use them. */
struct attribute_values {
	struct attribute_values *next;
	size_t count;
	uint64_t hash;
	uint32_t channels;
	float min, max; /* bounds of the first three channels */
	bool is_grey;	/* the first three channels are equal everywhere */
	const float *value;
};

/* The values that textures use, in a hash table whose entries are in the world's arena. A scene may have 2^18 meshes
 * with colours. */
enum { ATTRIBUTE_POOL_BUCKETS = 1 << 12 };
struct attribute_pool {
	struct attribute_values *bucket[ATTRIBUTE_POOL_BUCKETS];
};

/* Whether some texture uses the attributes, or the edges of this shape. The value is the number of points of a triangle
 * at which such a texture has its extremes: the corners, and for edges also the point at equal distances from all
 * three. */
enum triangle_probes { TRIANGLE_PROBES_NONE = 0, TRIANGLE_PROBES_CORNERS = 3, TRIANGLE_PROBES_EDGES = 4 };

struct attribute_table {
	const struct scene_node *shape;
	uint32_t vertex_count, triangle_count; /* 0 triangles: not a mesh */
	const uint32_t (*index)[3];	       /* must outlive the textures */
	const float (*position)[3];	       /* so must these; as in struct geom_shape */
	const double (*unrounded)[3];
	vec3 axis[3]; /* axes of the positions, in scene units */
	uint32_t count;
	const struct attribute *attributes;
	struct attribute_pool *pool;
	enum triangle_probes probes_per_triangle;
};

enum attribute_use { ATTRIBUTE_COLOR, ATTRIBUTE_COORDINATES };

/* Computes the edges of a triangle in scene units; edge[k] is opposite corner k. */
void attribute_table_edges(const struct attribute_table *t, uint32_t triangle, vec3 edge[3]);

/* Finds the attribute `name`. Returns NULL if there is none or its values are not valid for that use, and sets e to
 * -EINVAL with a sentence that names the mesh and the most similar name. n: node of the texture. */
const struct attribute *attribute_find(const struct attribute_table *t, const char *name, enum attribute_use use,
				       const struct scene_node *n, struct error *e);

/* Returns the values of an attribute, decoded from sRGB if `decode`, either new in the arena or shared. NULL if out of
 * memory. */
const struct attribute_values *attribute_values_intern(struct attribute_table *t, const struct attribute *a,
						       bool decode, struct arena *arena);

#endif
