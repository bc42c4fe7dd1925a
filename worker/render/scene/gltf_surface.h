/* SPDX-License-Identifier: Apache-2.0 */
/* The surface of a material below its layers. Private to gltf*.c. */
#ifndef WORKER_RENDER_SCENE_GLTF_SURFACE_H
#define WORKER_RENDER_SCENE_GLTF_SURFACE_H

#include "worker/render/scene/gltf_tree.h"

struct gltf_surface {
	double base[4]; /* colour and alpha */
	double metallic, roughness;
	const json_t *colour; /* textures that multiply the base; NULL: none */
	const json_t *both;   /* ... and roughness and metallic, as green and blue */
};

struct gltf_surface gltf_surface_read(struct gltf *g, const struct gltf_at *material);

#endif
