/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scene nodes without a scene file: "roughconductor alpha=0.1 distribution=ggx eta=rgb(0.2,0.9,1.1) on=true". Values
 * are numbers, booleans, rgb(r,g,b), or else strings (no spaces; '_' in a string becomes a space). Everything is
 * allocated in the arena; out of memory or bad text aborts. One thread.
 */
#ifndef TESTS_SUPPORT_NODES_H
#define TESTS_SUPPORT_NODES_H

#include "worker/render/scene/scene.h"

struct scene_node *node_make(struct arena *a, enum plugin_class cls, const char *text);
/* Makes a BSDF and what it holds, each after '|': "mask opacity=0.3 | plastic", a phase function after the word
 * "phase", a texture after the word "texture" or, if it has a name, after "@NAME". Contents of these follow after '/',
 * and contents of the latter after ';'. */
struct scene_node *node_make_bsdf(struct arena *a, const char *text);
void node_add_child(struct arena *a, struct scene_node *n, const struct scene_node *child); /* without a name */
void node_add_ref(struct arena *a, struct scene_node *n, const char *name, const struct scene_node *child);
void node_add_transform(struct arena *a, struct scene_node *n, const char *name, mat4 transform);

#endif
