/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Canonical names of a scene's files: parts with '/' between, relative to the scene's folder, without "." and without
 * parts that a ".." takes back. What of ".." leads out of the folder stands in front as "%2e%2e", so that no name that
 * is sent to others has "..", and the machine that reads the scene there arrives at the same name; for the same reason
 * "%2f" stands in front of an absolute name. Whoever opens files decides what is outside and may be read (asset.h).
 * Pure; any thread.
 */
#ifndef WORKER_RENDER_ASSET_ASSET_NAME_H
#define WORKER_RENDER_ASSET_ASSET_NAME_H

#include <stddef.h>
#include <stdint.h>

#define ASSET_NAME_UP "%2e%2e"
#define ASSET_NAME_TOP "%2f"

/* Room for the canonical name of one of that length, with its end. */
#define ASSET_NAME_ROOM(length) (3 * (size_t)(length) + 1)

/* "a/./b//../c" becomes "a/c", "a/../../b" becomes "%2e%2e/b", "/a/../b" becomes "%2f/b". Names of no file ("", "a/..")
 * stay as they are: nobody opens them. A canonical name is its own. */
void asset_name_canonical(const char *written, char *out);

/* How many folders up from the scene's, or ASSET_NAME_ABSOLUTE; *rest is what follows. */
#define ASSET_NAME_ABSOLUTE SIZE_MAX
size_t asset_name_up(const char *canonical, const char **rest);

/* As its author would write it, with ".." for what leads out, and "/" before what is absolute. Returns out; ends early
 * where there is no room. */
const char *asset_name_shown(const char *canonical, char *out, size_t size);

#endif
