/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds the files that a scene file names: in which of its folders each is, and so its canonical name (asset_name.h).
 * Names are put into the arena. Pure but for the files that are opened; any thread.
 */
#ifndef WORKER_RENDER_XML_XML_FILES_H
#define WORKER_RENDER_XML_XML_FILES_H

#include "common/base/arena.h"
#include "worker/render/asset/asset.h"
#include "worker/render/xml/element.h"

#include <stdbool.h>
#include <stdint.h>

struct xml_files {
	const struct asset_source *assets;
	struct arena *arena;
	const char *file;		/* which names them */
	const struct xml_element *hook; /* the <include> by which it is read; NULL: it is the scene */
	const char *const *paths;	/* values of <path> */
	uint32_t path_count;
	/* Result: the name of the file if it was found by the end of its path alone; otherwise NULL. */
	const char *by_end;
};

/* Replaces *name by the file's canonical name; 0 or -ENOMEM. A file that is in no folder is reported by whoever opens
 * it. A name that was written on Windows is tried with '/' for '\\'. The absolute path of a file that is not on this
 * machine is looked for by its end: "/home/me/a/b.obj" as "home/me/a/b.obj", "me/a/b.obj" and so on. nested: the
 * folders of the file that names it, and of those that include it, are searched, too. */
int xml_files_find(struct xml_files *f, const char **name, bool nested);

#endif
