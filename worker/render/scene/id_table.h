/* SPDX-License-Identifier: Apache-2.0 */
/* Objects of a scene by id, aliases included. One thread; allocated in the given arena. */
#ifndef WORKER_RENDER_SCENE_ID_TABLE_H
#define WORKER_RENDER_SCENE_ID_TABLE_H

#include "worker/render/scene/report.h"
#include "worker/render/xml/xml.h"

struct id_entry {
	const char *id;
	struct xml_element *element;
};

struct id_table {
	struct id_entry *entries; /* sorted */
	size_t count;
	bool incomplete; /* a file or an alias that may bring more is not there */
	size_t compared; /* ids compared for hints so far: bounded, because a file may miss as many as it has */
};

/* Objects may be referred to before they appear in the file, as in 3.x but not in 0.6. A duplicate id, and an alias
 * of nothing, is an error. */
int id_table_make(struct id_table *t, const struct xml_tree *tree, struct arena *arena, struct report *report,
		  struct error *e);

/* Whether it is an element that an id may name: an object, or a spectrum with a type. */
bool id_table_names(const struct xml_element *el);

/* One of those that is never made, subsurface or field: reported where it stands, not where it is referred to. */
bool id_table_is_absent(const struct xml_element *el);

/* The object of that id. NULL: none. */
struct xml_element *id_table_look(const struct id_table *t, const char *id);

/* The object that el's id names. -ENOENT, with the nearest id, or REPORT_TOLD, where what is missing has been
 * reported. */
int id_table_find(struct id_table *t, const struct xml_element *el, struct xml_element **out, struct error *e);

#endif
