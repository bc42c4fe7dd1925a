/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the files are called that a scene file names: their canonical names (asset_name.h), once it is known which of
 * the scene's folders has them. Names are put into the arena. Pure but for the files that are opened; any thread.
 */
#ifndef WORKER_RENDER_SCENE_XML_FILES_H
#define WORKER_RENDER_SCENE_XML_FILES_H

#include "common/base/arena.h"
#include "worker/render/scene/asset.h"
#include "worker/render/scene/element.h"

#include <stdbool.h>
#include <stdint.h>

struct xml_files {
	const struct asset_source *assets;
	struct arena *arena;
	const char *file;		/* which names them */
	const struct xml_element *hook; /* the <include> by which it is read; NULL: it is the scene */
	const char *const *paths;	/* values of <path> */
	uint32_t path_count;
	const char *by_end; /* result: the name of the file, where only the end of the path of another one led to it */
};

/* A name that no folder has is kept, and reported by whoever opens it. One written on Windows is tried with '/' for
 * '\\'. The path of a file that is not on this machine is looked for by its end: "/home/me/a/b.obj" as
 * "home/me/a/b.obj", "me/a/b.obj" and so on. nested: files around the one that names it have a say. */
int xml_files_find(struct xml_files *f, const char **name, bool nested);

#endif
