/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Canonical names of a scene's files: components separated by '/', relative to the scene's folder, without "." and
 * without components that a ".." cancels. Each ".." that leads out of the folder is written as "%2e%2e" at the
 * beginning, so that no name sent to another machine contains "..", and that machine, reading the same scene, arrives
 * at the same name. For the same reason "%2f" stands before an absolute name. Whether a file outside the folder may be
 * read is decided where it is opened (asset.h). Pure; any thread.
 */
#ifndef WORKER_RENDER_ASSET_ASSET_NAME_H
#define WORKER_RENDER_ASSET_ASSET_NAME_H

#include <stddef.h>
#include <stdint.h>

#define ASSET_NAME_PARENT "%2e%2e"
#define ASSET_NAME_ROOT "%2f"

/* Bytes that the canonical name of a name of this length may take, with its terminating 0. */
#define ASSET_NAME_SIZE_MAX(length) (3 * (size_t)(length) + 1)

/* "a/./b//../c" becomes "a/c", "a/../../b" becomes "%2e%2e/b", "/a/../b" becomes "%2f/b". Names that cannot be a
 * file ("", "a/..") stay as they are, since they are never opened. A canonical name stays the same. */
void asset_name_canonicalize(const char *written, char *out);

/* Returns by how many folders the name leads up from the scene's, or ASSET_NAME_ABSOLUTE; *rest is the remaining
 * name. */
#define ASSET_NAME_ABSOLUTE SIZE_MAX
size_t asset_name_levels_up(const char *canonical, const char **rest);

/* Writes the name as its author would: with ".." where it leads out, and with "/" before an absolute name. Returns
 * out; the name is cut off if it does not fit. */
const char *asset_name_display(const char *canonical, char *out, size_t size);

#endif
