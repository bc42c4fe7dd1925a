/* SPDX-License-Identifier: Apache-2.0 */
/* What a scene that was read says and has. One thread. */
#ifndef TESTS_SUPPORT_SCENE_PARTS_H
#define TESTS_SUPPORT_SCENE_PARTS_H

#include "worker/render/scene/scene.h"

#include <stdbool.h>

/* A note that contains the text. */
bool scene_has_note(const struct scene *s, const char *text);
/* The object with that id; fails the test where there is none. */
const struct scene_node *scene_named(const struct scene *s, const char *id);

#endif
