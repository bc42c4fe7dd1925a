/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Limits on how deeply objects are nested, and on how many there are if each reference is followed: a chain of masks,
 * each referring twice to the next, is short to write and has 2^n objects. Checked while the scene is read, because
 * everything after it follows every reference, recursively. Pure; one thread.
 */
#ifndef WORKER_RENDER_SCENE_NESTING_H
#define WORKER_RENDER_SCENE_NESTING_H

#include "common/base/error.h"
#include "worker/render/plugin/param.h"
#include "worker/render/xml/xml.h"

#define NESTING_HEIGHT_MAX 8192
#define NESTING_PARTS_MAX 65536	     /* of one material or texture: an evaluation may visit them all */
#define NESTING_OBJECTS_MAX 67108864 /* of the scene */

/* The object `el`, of class `cls`, takes another that has been made; `el` is the element inside that names it.
 * `once`: it is built once for all that take it, and adds only depth. -E2BIG with a sentence; `owner` is unchanged
 * then. */
int nesting_take(struct xml_nesting *owner, enum plugin_class cls, const struct xml_element *el,
		 const struct xml_element *taken, bool once, struct error *e);

/* Adds an object with its contents to the objects of the scene, once per element. -E2BIG with a sentence. */
int nesting_count(uint64_t *objects, struct xml_element *el, struct error *e);

#endif
