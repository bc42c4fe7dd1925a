/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Where a scene's files come from: a folder (hslt-render, hslt-submit) or a content-addressed store (workers).
 * Names are those in the scene file, in their canonical form (asset_name.h).
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
	uint64_t device, inode; /* which file it is, from a folder */
};

struct picture_cache; /* worker/render/texture/picture_cache.h */
struct obj_cache;     /* worker/render/shape/obj_read.h */

struct asset_source {
	void *user;
	/* The whole file, in memory. 0 or negative errno with a sentence. Any thread. */
	int (*open)(void *user, const char *name, struct asset *out, struct error *e);
	void (*close)(void *user, struct asset *a);
	struct picture_cache *decoded; /* NULL: each texture decodes its picture for itself */
	struct obj_cache *parsed;      /* NULL: each shape reads its file for itself */
};

/* A folder: names must stay below it (no "..", no absolute paths to elsewhere, no symbolic links that
 * lead out of it, regular files only, at most 4 GB). `folder` must outlive it. */
struct asset_source asset_folder(const char *folder);

/* Folders in which a file is searched in turn, each as above: the scene's own, then those that the user adds. */
enum { ASSET_FOLDERS_MAX = 17 };
struct asset_folders {
	size_t count;
	const char *folder[ASSET_FOLDERS_MAX];
};

/* own, and the first ASSET_FOLDERS_MAX - 1 of others. */
struct asset_folders asset_folders_of(const char *own, const char *const *others, size_t count);
struct asset_source asset_search(const struct asset_folders *folders); /* they must outlive it */

#endif
