/* SPDX-License-Identifier: Apache-2.0 */
/* Textures of materials. Private to gltf*.c. */
#ifndef WORKER_RENDER_GLTF_GLTF_TEXTURE_H
#define WORKER_RENDER_GLTF_GLTF_TEXTURE_H

#include "worker/render/gltf/gltf_tree.h"

/* How an image is read: which channels of a pixel, and whether they are colours. */
struct gltf_channel {
	const char *name; /* "r", "g", "b", "a"; NULL: all three colours */
	bool is_colour;
	double factor[3]; /* factor of each colour; of a single channel, the first */
	double cutoff;	  /* alpha below it becomes 0, otherwise 1; negative: no cutoff */
};

/* The sets of texture coordinates that a material's textures use, at most two. The first is the normal map's if
 * there is one. If there are no textures, sets[0] is 0. */
struct gltf_texcoord_sets {
	unsigned sets[2], count;
};
struct gltf_texcoord_sets gltf_material_texcoord_sets(struct gltf *g, const struct gltf_entry *material);
/* Adds the texture that `info` of the material names, as the property `name` of el. */
void gltf_put_texture(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const char *name,
		      const json_t *info, const struct gltf_channel *c);
/* Add a colour, or a number from 0 to 1 that one channel multiplies, times the texture (NULL: none). */
void gltf_put_colour(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const char *name,
		     const double rgb[3], const json_t *texture);
void gltf_put_factor(struct gltf *g, struct xml_element *el, const struct gltf_entry *material, const char *name,
		     double x, const json_t *texture, const char *channel);

#endif
