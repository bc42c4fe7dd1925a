/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Random scenes: some shapes with materials drawn from a list, in a room with gaps or on a floor, with emitters and a
 * camera of any kind. They depend only on the number. Everything is a few units large, and no lobe is narrower than the
 * narrowest of the list, so that each integrator converges.
 */
#ifndef TESTS_SUPPORT_RANDOM_SCENE_H
#define TESTS_SUPPORT_RANDOM_SCENE_H

#include "worker/render/world/world.h"

#include <stdbool.h>

struct random_scene {
	char body[1 << 15]; /* contents of <scene>, of 3.x */
	size_t used;
	char materials[1024];	/* materials drawn from the list, separated by "; " */
	bool needs_light_paths; /* some of its light is a beam or a point light, whose caustics `path` cannot find */
};

/* From the first number on, most materials of shapes have a normal map; from the second on they have none, but there
 * are scattering media. */
enum { RANDOM_SCENES_WITH_RELIEF = 1000, RANDOM_SCENES_WITH_FOG = 2000 };

/* materials: texts for node_make_bsdf (tests/support/nodes.h). */
void random_scene_make(struct random_scene *s, uint64_t number, const char *const *materials, uint32_t count);
/* Parses "3" or "0-9". */
void random_scene_parse_range(const char *text, uint64_t *first, uint64_t *last);
/* Builds the scene; the caller frees the world. */
struct world *random_scene_world(const struct random_scene *s, uint32_t width, uint32_t height);

#endif
