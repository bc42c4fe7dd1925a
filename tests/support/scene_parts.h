/* SPDX-License-Identifier: Apache-2.0 */
/* Looks up notes and objects of a scene that was read. One thread. */
#ifndef TESTS_SUPPORT_SCENE_PARTS_H
#define TESTS_SUPPORT_SCENE_PARTS_H

#include "worker/render/scene/scene.h"

#include <stdbool.h>

/* Returns whether there is a note that contains the text. */
bool scene_has_note(const struct scene *s, const char *text);
/* Returns the object with that id; fails the test if there is none. */
const struct scene_node *scene_find_object(const struct scene *s, const char *id);

#endif
