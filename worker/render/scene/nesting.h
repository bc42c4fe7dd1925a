/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How deep objects hold each other, and how many they are when each reference is followed: a ladder of masks where each
 * refers twice to the one below is short to write and has 2^n rungs. Bounded while the scene is read, for everything
 * that comes after follows every reference, by recursion. Pure; one thread.
 */
#ifndef WORKER_RENDER_SCENE_NESTING_H
#define WORKER_RENDER_SCENE_NESTING_H

#include "common/base/error.h"
#include "worker/render/scene/param.h"
#include "worker/render/scene/xml.h"

#define NESTING_HEIGHT_MAX 8192
#define NESTING_PARTS_MAX 65536	     /* of one material or texture: an evaluation may meet them all */
#define NESTING_OBJECTS_MAX 67108864 /* of the scene */

/* The object that `el` is, of class `cls`, takes another that has been made; `el` inside it names that one. `once`: it
 * is built once for all that take it, and adds nothing but height. -E2BIG with a sentence; `owner` stays as it was. */
int nesting_take(struct xml_nesting *owner, enum plugin_class cls, const struct xml_element *el,
		 const struct xml_element *taken, bool once, struct error *e);

/* Adds what the object holds to the objects of the scene, once for each element. -E2BIG with a sentence. */
int nesting_count(uint64_t *objects, struct xml_element *el, struct error *e);

#endif
