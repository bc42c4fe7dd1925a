/* SPDX-License-Identifier: Apache-2.0 */
/* The names of the files that a scene refers to, as they are met. One thread; lives in the arena given. */
#ifndef WORKER_RENDER_SCENE_ASSET_LIST_H
#define WORKER_RENDER_SCENE_ASSET_LIST_H

#include "common/base/arena.h"

struct asset_list {
	const char **names;
	size_t count, room;
};

int asset_list_add(struct asset_list *l, const char *name, struct arena *arena); /* 0 or -ENOMEM */

/* Sorts them, and leaves each once and `but` not at all. */
void asset_list_finish(struct asset_list *l, const char *but);

#endif
