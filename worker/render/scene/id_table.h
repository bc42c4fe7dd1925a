/* SPDX-License-Identifier: Apache-2.0 */
/* Looks up objects of a scene, and aliases of them, by id. One thread; allocated in the given arena. */
#ifndef WORKER_RENDER_SCENE_ID_TABLE_H
#define WORKER_RENDER_SCENE_ID_TABLE_H

#include "worker/render/scene/report.h"
#include "worker/render/xml/xml.h"

struct id_entry {
	const char *id;
	struct xml_element *element;
};

struct id_table {
	struct id_entry *entries; /* sorted by id */
	size_t count;
	bool is_incomplete;	 /* a file or an alias that may define more ids is missing */
	size_t comparison_count; /* number of ids compared for hints so far; limited, because a file may refer to as
			    many unknown ids as it defines */
};

/* Fills the table. As in 3.x but not in 0.6, objects may be referred to before they appear in the file. A duplicate
 * id and an alias of an unknown id are errors. */
int id_table_build(struct id_table *t, const struct xml_tree *tree, struct arena *arena, struct report *report,
		   struct error *e);

/* Returns whether an id may name the element: it is an object, or a spectrum with a type. */
bool id_table_can_name(const struct xml_element *el);

/* Returns whether the element is a <subsurface> or <field>, of which no node is ever made: it is reported where it
 * stands, not where it is referred to. */
bool id_table_is_never_node(const struct xml_element *el);

/* Returns the object with that id, or NULL. */
struct xml_element *id_table_lookup(const struct id_table *t, const char *id);

/* Finds the object that el's id refers to. If there is none, returns -ENOENT with the most similar id, or
 * REPORT_ALREADY_REPORTED if the missing file or alias has already been reported. */
int id_table_resolve(struct id_table *t, const struct xml_element *el, struct xml_element **out, struct error *e);

#endif
