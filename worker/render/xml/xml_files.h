/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds the files that a scene file names: the folder in which each lies, and so its canonical name (asset_name.h).
 * Names are allocated in the arena. Has no effect other than opening files; any thread.
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
	const char *naming_file; /* the scene file that names the file */
	/* The <include> by which that scene file is read; NULL: it is the main file. */
	const struct xml_element *include;
	const char *const *search_paths; /* values of <path> */
	uint32_t path_count;
	/* Result: the file's name if it was found only by the end of its path; otherwise NULL. */
	const char *found_by_suffix;
};

/* Replaces *name by the file's canonical name. Returns 0 or -ENOMEM; a file found in no folder is reported by the
 * code that opens it. A name with '\\', written on Windows, is also tried with '/' instead. The absolute path of a file
 * that is not on this machine is looked for by its end: "/home/me/a/b.obj" as "home/me/a/b.obj", "me/a/b.obj" and so
 * on. nested: also search the folders of the scene file that names it and of those that include that file. */
int xml_files_find(struct xml_files *f, const char **name, bool nested);

#endif
