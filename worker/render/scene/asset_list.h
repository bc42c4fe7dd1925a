/* SPDX-License-Identifier: Apache-2.0 */
/* The names of the files that a scene refers to, as they are met. One thread; lives in the arena given. */
#ifndef WORKER_RENDER_SCENE_ASSET_LIST_H
#define WORKER_RENDER_SCENE_ASSET_LIST_H

#include "common/base/arena.h"
#include "worker/render/xml/element.h"

struct asset_use {
	const char *name;
	const struct xml_element *by; /* NULL: no object */
	size_t at;		      /* in the order in which they are met */
};

struct asset_list {
	struct asset_use *uses;
	size_t count, room;
	const char **names, **places; /* once finished; a place is "scene.xml:12: <shape type=\"obj\">", or "" */
};

/* 0 or -ENOMEM. */
int asset_list_add(struct asset_list *l, const char *name, const struct xml_element *by, struct arena *arena);

/* Sorts them, removes duplicates (the first place that names a file is kept), and removes `but`. 0 or -ENOMEM. */
int asset_list_finish(struct asset_list *l, const char *but, struct arena *arena);

#endif
