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

struct attribute_table {
	const struct scene_node *shape;
	uint32_t vertex_count, triangle_count; /* 0 triangles: not a mesh */
	const uint32_t (*index)[3];	       /* outlives the textures */
	uint32_t count;
	const struct attribute *attributes;
	struct attribute_pool *pool;
	bool asked; /* set if a texture was made that uses one */
};

enum attribute_use { ATTRIBUTE_COLOR, ATTRIBUTE_COORDINATES };

/* The attribute `name`; NULL, with -EINVAL's sentence, which names the mesh and the nearest name: there is none, or
 * its numbers are not valid for that use. n: the texture. */
const struct attribute *attribute_find(const struct attribute_table *t, const char *name, enum attribute_use use,
				       const struct scene_node *n, struct error *e);

/* Its numbers, decoded from sRGB if `decode`; allocated in the arena, or shared. NULL: out of memory. */
const struct attribute_values *attribute_keep(struct attribute_table *t, const struct attribute *a, bool decode,
					      struct arena *arena);

#endif
