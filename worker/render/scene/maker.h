/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The state of reading one scene, shared by all its objects, and the making of nodes: of an object and everything
 * inside it. A problem is reported with file and line, and an object with problems inside still becomes a node
 * (report.h), so that one run finds all problems. -ENOMEM ends the reading. One thread.
 */
#ifndef WORKER_RENDER_SCENE_MAKER_H
#define WORKER_RENDER_SCENE_MAKER_H

#include "worker/render/scene/asset_list.h"
#include "worker/render/scene/id_table.h"
#include "worker/render/scene/notes.h"
#include "worker/render/scene/report.h"
#include "worker/render/xml/xml.h"

struct scene;

/* All pointers point into the arena, which belongs to the scene. */
struct maker {
	struct scene *scene; /* the result, filled in by scene.c */
	struct arena *arena;
	const char *name; /* of the scene file */
	const struct asset_source *asset_source;
	const struct plugin_decl *decls;
	struct error *error;
	struct xml_tree *tree;
	struct id_table ids;
	struct report report;
	struct notes notes;
	struct asset_list assets;
	uint64_t object_count; /* objects made so far, with all references followed; limited by nesting.h */
	int depth;
	bool is_resumed; /* what is read now was too deep before: a second sentence would tell nothing new */
	uint32_t flawed_count;
	const struct scene_node **flawed; /* like scene.flawed */
	uint32_t flat_shape_count;	  /* number of shapes left out because their transforms have no inverse */
	const struct xml_element *first_flat_shape;
	bool is_lenient;
};

int maker_out_of_memory(struct maker *m); /* returns -ENOMEM and sets the message */
/* Lists a file. element: the element that names it; NULL for an included file. */
int maker_add_asset(struct maker *m, const char *name, const struct xml_element *element);

/* Stores the node of an element that is an object. It is made at the first call; references to the element share it. */
int maker_make_node(struct maker *m, struct xml_element *el, const struct scene_node **out);
/* Refuses an element that has no meaning where it stands; with `is_lenient`, leaves it out with a note. */
int maker_reject_element(struct maker *m, const struct xml_element *el);

#endif
