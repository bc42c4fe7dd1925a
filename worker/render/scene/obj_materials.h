/* SPDX-License-Identifier: Apache-2.0 */
/*
 * OBJ shapes of Mitsuba 0.6 whose file names materials. A BSDF with a name applies to the faces that follow `usemtl`
 * with that name, one without a name to all faces; faces with neither get the material of the .mtl file. Such a shape
 * becomes a `merge` of shapes with one material each. Works on the tree of elements; one thread.
 */
#ifndef WORKER_RENDER_SCENE_OBJ_MATERIALS_H
#define WORKER_RENDER_SCENE_OBJ_MATERIALS_H

#include "worker/render/scene/asset_list.h"
#include "worker/render/scene/id_table.h"
#include "worker/render/scene/report.h"
#include "worker/render/xml/xml.h"

enum { OBJ_MATERIALS_MAX = 4096 }; /* per file */

/* Splits all such shapes of the tree. Adds the .mtl files to `files` and problems to the report. Returns 0, -ENOMEM
 * or REPORT_FULL. */
int obj_materials_split(struct xml_tree *t, struct id_table *ids, const struct asset_source *assets,
			struct asset_list *files, struct arena *arena, struct report *report, struct error *e);

#endif
