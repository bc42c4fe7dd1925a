/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Vertices that are computed while the file is read, because a shape cannot read them from one buffer as they are:
 * quantized ones, sparse accessors, attributes in several buffers, morph targets, skins. Private to gltf*.c.
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

/* The accessors of a primitive; .json NULL: it has none of that. */
struct gltf_primitive {
	const struct gltf_at *mesh, *node;
	const json_t *json;
	struct gltf_at sources[GLTF_SOURCES];
};

/* Its vertices have to be computed. */
bool gltf_is_posed(struct gltf *g, const struct gltf_primitive *p);
/* Puts them into the shape, in its own space; of a skin in the world's, and *to_world becomes the identity. The box of
 * the scene grows by them. */
void gltf_put_pose(struct gltf *g, struct xml_element *shape, const struct gltf_primitive *p, mat4 *to_world);

#endif
