/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The source of a scene's files: a folder (hslt-render, hslt-submit) or a content-addressed store (workers). Names are
 * those in the scene file, in their canonical form (asset_name.h).
 */
#ifndef WORKER_RENDER_ASSET_ASSET_H
#define WORKER_RENDER_ASSET_ASSET_H

#include "common/base/error.h"

#include <stddef.h>
#include <stdint.h>

struct asset {
	const unsigned char *bytes;
	size_t size;
	void *handle;
	uint64_t device, inode; /* identify the file, if it comes from a folder */
};

struct picture_cache; /* worker/render/texture/picture_cache.h */
struct obj_cache;     /* worker/render/shape/obj_read.h */

struct asset_source {
	void *user;
	/* Reads the whole file into memory. Returns 0, or a negative errno with a sentence in *e. Any thread. */
	int (*open)(void *user, const char *name, struct asset *out, struct error *e);
	void (*close)(void *user, struct asset *a);
	struct picture_cache *picture_cache; /* NULL: each texture decodes its own picture */
	struct obj_cache *obj_cache;	     /* NULL: each shape parses its own file */
};

/* A source for one folder. Names must stay below it: no "..", no absolute paths to elsewhere, no symbolic links that
 * lead out of it; regular files only, at most 4 GB. `folder` must outlive the source. */
struct asset_source asset_source_for_folder(const char *folder);

/* Folders that are searched in turn, each with the rules of asset_source_for_folder(): the scene's own, then those that
 * the user adds. */
enum { ASSET_FOLDERS_MAX = 17 };
struct asset_folders {
	size_t count;
	const char *folder[ASSET_FOLDERS_MAX];
};

/* Returns `scene_folder` followed by the first ASSET_FOLDERS_MAX - 1 of `extra_folders`. */
struct asset_folders asset_folders_make(const char *scene_folder, const char *const *extra_folders, size_t count);
/* The folders must outlive the source. */
struct asset_source asset_source_for_folders(const struct asset_folders *folders);

#endif
