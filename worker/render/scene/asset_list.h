/* SPDX-License-Identifier: Apache-2.0 */
/* The names of the files that a scene refers to, in the order in which they are found. One thread; allocated in the
 * given arena. */
#ifndef WORKER_RENDER_SCENE_ASSET_LIST_H
#define WORKER_RENDER_SCENE_ASSET_LIST_H

#include "common/base/arena.h"
#include "worker/render/xml/element.h"

struct asset_use {
	const char *name;
	const struct xml_element *element; /* the element that names the file; NULL: none */
	size_t index;			   /* in order of appearance */
};

struct asset_list {
	struct asset_use *uses;
	size_t count, capacity;
	const char **names, **places; /* once finished; a place is "scene.xml:12: <shape type=\"obj\">", or "" */
};

/* Returns 0 or -ENOMEM. */
int asset_list_add(struct asset_list *l, const char *name, const struct xml_element *element, struct arena *arena);

/* Sorts the names, removes duplicates (keeping the first place that names a file) and removes the name `excluded`.
 * Returns 0 or -ENOMEM. */
int asset_list_finish(struct asset_list *l, const char *excluded, struct arena *arena);

#endif
