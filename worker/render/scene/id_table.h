/* SPDX-License-Identifier: Apache-2.0 */
/* Objects of a scene by their ids, aliases included. One thread; lives in the arena given. */
#ifndef WORKER_RENDER_SCENE_ID_TABLE_H
#define WORKER_RENDER_SCENE_ID_TABLE_H

#include "worker/render/scene/xml.h"

struct id_entry {
	const char *id;
	struct xml_element *element;
};

struct id_table {
	struct id_entry *entries; /* sorted */
	size_t count;
	size_t compared; /* ids that were looked at for hints so far: bounded, for a file may miss as many as it has */
};

/* Objects may be referred to before they stand in the file, as 3.x allows and 0.6 does not. An id that is given twice,
 * and an alias of nothing, is an error. */
int id_table_make(struct id_table *t, const struct xml_tree *tree, struct arena *arena, struct error *e);

/* The object that the attribute of el names. -ENOENT with the nearest id. */
int id_table_find(struct id_table *t, const struct xml_element *el, const char *attribute, struct xml_element **out,
		  struct error *e);

#endif
