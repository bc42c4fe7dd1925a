/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Files of Mitsuba before 0.5, made into what 0.5 would read: plug-ins and parameters have new names since, cameras are
 * sensors and luminaires emitters, and before 0.4 a camera saw the world the other way round from left to right. Works
 * on the tree of one file, before anything is interpreted; one thread.
 */
#ifndef WORKER_RENDER_SCENE_UPGRADE_H
#define WORKER_RENDER_SCENE_UPGRADE_H

#include "common/base/arena.h"
#include "worker/render/scene/element.h"

/* scene: the root of the file, of version 0.MINOR, minor < 5. Included files are left to themselves. */
int upgrade_file(struct xml_element *scene, int minor, struct arena *arena, struct error *e);

#endif
