/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Upgrades files of Mitsuba before 0.5 to what 0.5 reads: plug-ins and parameters have new names since then, cameras
 * have become sensors and luminaires emitters, and before 0.4 a camera was mirrored. Works on the tree of one file,
 * before it is interpreted; one thread.
 */
#ifndef WORKER_RENDER_XML_UPGRADE_H
#define WORKER_RENDER_XML_UPGRADE_H

#include "common/base/arena.h"
#include "worker/render/xml/element.h"
#include "worker/render/plugin/plugin.h"

/* Returns whether a file that states no version is from before 0.3, to judge by its names for cameras and lights. */
bool upgrade_is_before_0_3(const struct xml_element *scene);

/* Upgrades one file of version 0.MINOR, minor < 5; scene is its root. Included files are upgraded separately.
 * Returns 0 or -ENOMEM. */
int upgrade_file(struct xml_element *scene, int minor, struct arena *arena, struct error *e);

/* Stores the i-th name that is read as another one; returns false after the last. */
bool upgrade_rename_at(size_t i, struct renamed_name *out);

/* Renames, in a whole tree of 2.x or 3.x, the plug-ins whose names changed before their release. */
void upgrade_prerelease_names(struct xml_element *root);

#endif
