/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One scene being read: what all objects of the file share, and the node of one object with all that is inside it. A
 * problem is reported with file and line, and an object with problems inside still becomes a node (report.h). -ENOMEM
 * ends the reading. One thread.
 */
#ifndef WORKER_RENDER_SCENE_MAKER_H
#define WORKER_RENDER_SCENE_MAKER_H

#include "worker/render/scene/asset_list.h"
#include "worker/render/scene/id_table.h"
#include "worker/render/scene/notes.h"
#include "worker/render/scene/report.h"
#include "worker/render/scene/xml.h"

struct scene;

/* All pointers lead into the arena, which is the scene's. */
struct maker {
	struct scene *scene; /* what scene.c makes of it all */
	struct arena *arena;
	const char *name; /* of the scene file */
	const struct asset_source *assets_from;
	const struct plugin_decl *decls;
	struct error *error;
	struct xml_tree *tree;
	struct id_table ids;
	struct report report;
	struct notes notes;
	struct asset_list assets;
	uint64_t objects; /* with all references followed */
	int depth;
	bool lenient;
};

int maker_out_of_memory(struct maker *m);
void *maker_allocate(struct maker *m, size_t count, size_t size);
int maker_add_asset(struct maker *m, const char *name, const struct xml_element *by);

/* The node of an element, made once: references share it. */
int maker_node(struct maker *m, struct xml_element *el, const struct scene_node **out);
/* An element that means nothing here: a problem, or with `lenient` a note. */
int maker_foreign(struct maker *m, const struct xml_element *el);

#endif
