/* SPDX-License-Identifier: Apache-2.0 */
/* A bump or normal map that names its picture itself, as in forks of Mitsuba, becomes one with a texture. */
#ifndef WORKER_RENDER_SCENE_RELIEF_FILES_H
#define WORKER_RENDER_SCENE_RELIEF_FILES_H

#include "common/base/arena.h"
#include "worker/render/scene/element.h"

/* <string name="filename" value="x.png"/> directly in a `bumpmap` or `normalmap` becomes a <texture type="bitmap"> of
 * that file whose numbers are not decoded, in all of the tree. 0 or -ENOMEM. */
int relief_files_settle(struct xml_element *root, struct arena *arena, struct error *e);

#endif
