/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The attributes of one mesh as the textures of what lies on it see them. Meshes may differ in their attributes, so a
 * BSDF whose textures look some up belongs to one shape; equal numbers of several meshes are kept once.
 * One thread, while the world is built.
 */
#ifndef WORKER_RENDER_TEXTURE_ATTRIBUTE_TABLE_H
#define WORKER_RENDER_TEXTURE_ATTRIBUTE_TABLE_H

#include "common/base/arena.h"
#include "worker/render/math/attribute.h"
#include "worker/render/scene/scene.h"

/* Numbers of an attribute; as many as they are asked for at once. */
struct attribute_values {
	struct attribute_values *next;
	size_t count;
	uint64_t hash;
	uint32_t channels;
	float least, most; /* of the first three channels */
	bool grey;	   /* these are equal everywhere */
	const float *value;
};

/* What textures asked for; in the world's arena. */
struct attribute_pool {
	struct attribute_values *first;
};

struct attribute_table {
	const struct scene_node *shape;
	uint32_t vertex_count, triangle_count; /* 0 triangles: it is no mesh */
	const uint32_t (*index)[3];	       /* outlives the textures */
	uint32_t count;
	const struct attribute *attributes;
	struct attribute_pool *pool;
	bool asked; /* set where a texture was made that looks one up */
};

/* The attribute `name`; NULL with -EINVAL's sentence, which names the mesh and the nearest name: it has none such, or
 * its numbers are no colour. n: the texture. */
const struct attribute *attribute_find(const struct attribute_table *t, const char *name, const struct scene_node *n,
				       struct error *e);

/* Its numbers, decoded from sRGB where `decode`; kept in the arena, or found among those that are. NULL: out of
 * memory. */
const struct attribute_values *attribute_keep(struct attribute_table *t, const struct attribute *a, bool decode,
					      struct arena *arena);

#endif
