/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Limits on how deeply objects are nested, and on how many objects there are when every reference is followed: a chain
 * of n masks, each referring twice to the next, is short to write and has 2^n objects. Checked while the scene is read,
 * because everything after it follows every reference, recursively. Pure; one thread.
 */
#ifndef WORKER_RENDER_SCENE_NESTING_H
#define WORKER_RENDER_SCENE_NESTING_H

#include "common/base/error.h"
#include "worker/render/plugin/param.h"
#include "worker/render/scene/report.h"
#include "worker/render/xml/xml.h"

#define NESTING_HEIGHT_MAX 8192
#define NESTING_PARTS_MAX 65536	     /* for one material or texture: an evaluation may visit all its objects */
#define NESTING_OBJECTS_MAX 67108864 /* for the scene */

/* Adds `part`, which has been made, to the contents of `owner`, an object of class `cls`; `el` is the element inside
 * the owner that names it. is_shared: `part` is built once for all its owners, and adds only depth. Returns -E2BIG with
 * a sentence if a limit is exceeded. `owner` is then marked as beyond the limits, and taking it returns
 * REPORT_ALREADY_REPORTED, without another sentence. */
int nesting_add(struct xml_nesting *owner, enum plugin_class cls, const struct xml_element *el,
		const struct xml_element *part, bool is_shared, struct error *e);

/* Adds an object with its contents to the scene's number of objects, once per element. Returns -E2BIG with a
 * sentence the first time that there are too many, then REPORT_ALREADY_REPORTED, also for an object beyond the limits.
 */
int nesting_add_to_scene(uint64_t *scene_object_count, struct xml_element *el, struct error *e);

#endif
