/* SPDX-License-Identifier: Apache-2.0 */
/*
 * OBJ shapes of Mitsuba 0.6 whose file names materials: a BSDF with a name is that of the faces after `usemtl` of this
 * name, one without a name that of all, and where there is neither the .mtl file counts. Such a shape becomes a `merge`
 * of shapes with one material each. Works on the tree of elements; one thread.
 */
#ifndef WORKER_RENDER_SCENE_OBJ_MATERIALS_H
#define WORKER_RENDER_SCENE_OBJ_MATERIALS_H

#include "worker/render/scene/asset_list.h"
#include "worker/render/scene/id_table.h"
#include "worker/render/scene/report.h"
#include "worker/render/scene/xml.h"

enum { OBJ_MATERIALS_MAX = 4096 }; /* of a file */

/* Lists the .mtl files in `files`. What is wrong ends in the report. 0, -ENOMEM or REPORT_FULL. */
int obj_materials_spread(struct xml_tree *t, struct id_table *ids, const struct asset_source *assets,
			 struct asset_list *files, struct arena *arena, struct report *report, struct error *e);

#endif
