/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Vertices that are computed while the file is read, because a shape cannot read them from one buffer as they are:
 * quantized ones, sparse accessors, attributes in several buffers, compressed views, morph targets, skins. Private to
 * gltf*.c.
 */
#ifndef WORKER_RENDER_GLTF_GLTF_POSE_H
#define WORKER_RENDER_GLTF_GLTF_POSE_H

#include "worker/render/gltf/gltf_tree.h"

enum gltf_source {
	GLTF_POSITION,
	GLTF_NORMAL,
	GLTF_TEXCOORD,
	GLTF_TEXCOORD_OTHER,
	GLTF_COLOR,
	GLTF_INDEX,
	GLTF_SOURCES
};

/* A primitive and its accessors; .json of an accessor is NULL if the primitive does not have it. */
struct gltf_primitive {
	const struct gltf_entry *mesh, *node;
	const json_t *json;
	struct gltf_entry sources[GLTF_SOURCES];
};

/* Returns whether the primitive's vertices have to be computed. */
bool gltf_has_computed_vertices(struct gltf *g, const struct gltf_primitive *p);
/* Puts the vertices into the shape, in its own space; those of a skin in world space, in which case *to_world
 * becomes the identity. Extends the scene's bounding box by them. */
void gltf_put_computed_vertices(struct gltf *g, struct xml_element *shape, const struct gltf_primitive *p,
				mat4 *to_world);

#endif
