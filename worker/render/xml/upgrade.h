/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Upgrades files of Mitsuba before 0.5 to what 0.5 reads: plug-ins and parameters have new names since, cameras are
 * sensors and luminaires emitters, and before 0.4 a camera was mirrored. Works on the tree of one file, before it is
 * interpreted; one thread.
 */
#ifndef WORKER_RENDER_XML_UPGRADE_H
#define WORKER_RENDER_XML_UPGRADE_H

#include "common/base/arena.h"
#include "worker/render/xml/element.h"
#include "worker/render/plugin/plugin.h"

/* A file without a version is from before 0.3 if its camera or lights are called as they were then. */
bool upgrade_is_unmarked(const struct xml_element *scene);

/* scene: the root of the file, of version 0.MINOR, minor < 5. Included files are upgraded separately. */
int upgrade_file(struct xml_element *scene, int minor, struct arena *arena, struct error *e);

/* The i-th name that is read as another; false after the last. */
bool upgrade_name_at(size_t i, struct renamed *out);

/* The same for 2.x and 3.x, whose plug-ins have been renamed before a release only; in the whole tree. */
void upgrade_unreleased(struct xml_element *root);

#endif
