/* SPDX-License-Identifier: Apache-2.0 */
/* Assets from memory: what a scene refers to, without files. */
#ifndef TESTS_SUPPORT_MEMORY_ASSETS_H
#define TESTS_SUPPORT_MEMORY_ASSETS_H

#include "worker/render/asset/asset.h"

struct memory_file {
	const char *name;
	const void *bytes;
	size_t size;
};

/* files ends with a NULL name; a name that is not there gives -ENOENT. Must outlive the source. */
struct asset_source memory_assets(const struct memory_file *files);

#endif
